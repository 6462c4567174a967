"""Phase and gain margin of a loop that may be conditionally stable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strix.gains.model import RATE_HZ, Matrix

LEAST_PHASE_MARGIN_DEG = 45.0
LEAST_GAIN_MARGIN_DB = 6.0
FREQUENCIES_RAD_S: Matrix = np.geomspace(1e-2, np.pi * RATE_HZ, 1_000)[:-1]


@dataclass(frozen=True)
class Margins:
    """Smallest over all crossings; the crossover is the highest."""

    phase_deg: float
    more_gain_db: float  # how much more gain is stable
    less_gain_db: float  # and how much less; infinite where none upsets it
    crossover_rad_s: float

    @property
    def gain_db(self) -> float:
        """The smaller of the two."""
        return min(self.more_gain_db, self.less_gain_db)


def margins_of(w: Matrix, loop: NDArray[np.complex128]) -> Margins:
    """Margins of 1 + loop at the frequencies w, rad/s. A chain of integrators is conditionally
    stable: less gain can also upset it.
    """
    log_w = np.log(w)
    gain_db = 20.0 * np.log10(np.abs(loop))
    phase_deg = np.degrees(np.unwrap(np.angle(loop)))

    def at_zero(y: Matrix, *others: Matrix) -> list[list[float]]:
        found = []
        for i in np.flatnonzero(y[:-1] * y[1:] < 0.0):
            t = y[i] / (y[i] - y[i + 1])
            found.append([float(o[i] + t * (o[i + 1] - o[i])) for o in others])
        return found

    crossovers = at_zero(gain_db, phase_deg, log_w)
    turns = range(int(phase_deg.min() // 360.0) - 1, int(phase_deg.max() // 360.0) + 2)
    inversions = [g for n in turns for (g,) in at_zero(phase_deg - (360.0 * n - 180.0), gain_db)]
    return Margins(
        phase_deg=min(
            (abs(phase % 360.0 - 180.0) for phase, _ in crossovers), default=float("inf")
        ),
        more_gain_db=min((-g for g in inversions if g < 0.0), default=float("inf")),
        less_gain_db=min((g for g in inversions if g >= 0.0), default=float("inf")),
        crossover_rad_s=float(np.exp(max((log for _, log in crossovers), default=-np.inf))),
    )
