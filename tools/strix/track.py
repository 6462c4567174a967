"""What really happened in a simulated flight: the plant's truth, sampled at a fixed rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TruthTrack:
    """N samples. Time is log time; frames are NED and FRD as everywhere (DESIGN.md, 2)."""

    time_s: Array  # (N,)
    position_ned_m: Array  # (N, 3), from the start position
    velocity_ned_m_s: Array  # (N, 3)
    attitude: Array  # (N, 4), [w x y z], body to NED
    rate_body_rad_s: Array  # (N, 3)
    rotor_speed: Array  # (N, 4), in the vehicle's unit
    on_ground: NDArray[np.bool_]  # (N,)

    def at(self, time_s: Array, values: Array) -> Array:
        """One of the arrays above, interpolated column by column to other times."""
        columns = [np.interp(time_s, self.time_s, values[:, i]) for i in range(values.shape[1])]
        return np.stack(columns, axis=1)


class TruthRecorder:
    """Collects samples during a flight."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, ...]] = []

    def add(self, truth: Any) -> None:
        """Adds one strix.plant.plant.Truth."""
        self._rows.append(
            (
                truth.time_us * 1e-6,
                *truth.position_ned_m,
                *truth.velocity_ned_m_s,
                *truth.q_body_to_ned,
                *truth.rate_body_rad_s,
                *truth.rotor_speed,
                float(truth.on_ground),
            )
        )

    def track(self) -> TruthTrack:
        rows = np.array(self._rows, dtype=np.float64).reshape(len(self._rows), 19)
        attitude = rows[:, 7:11].copy()
        # q and -q are the same attitude; neighbours are given the same sign, so that both plotting
        # and interpolation see a continuous curve.
        flips = np.cumprod(np.where(np.sum(attitude[1:] * attitude[:-1], axis=1) < 0, -1.0, 1.0))
        attitude[1:] *= flips[:, None]
        return TruthTrack(
            time_s=rows[:, 0],
            position_ned_m=rows[:, 1:4],
            velocity_ned_m_s=rows[:, 4:7],
            attitude=attitude,
            rate_body_rad_s=rows[:, 11:14],
            rotor_speed=rows[:, 14:18],
            on_ground=rows[:, 18] > 0.5,
        )
