"""What the motors' current adds to the magnetometer: props off, motors stepped, nothing moves.

    raw = still field + perThrottle * throttle

throttle is the mean motor command between its limits, 0 to 1. The field of a current grows with
the current, and that only roughly with the command: how much of the change the line explains is
told, and a line that explains little is refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from strix.calibrate.outcome import AXES, Incomplete, numbers, sizes
from strix.calibrate.readings import Imu, Mag, Throttle
from strix.calibrate.standstill import block_means, turned_deg
from strix.flightlog import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OFF = 0.02  # throttle below which no motor turns
LEAST_STILL_S = 2.0  # of it, for the still field
LEAST_ON_S = 5.0
LEAST_SPAN = 0.2  # of throttle: what a line through less is extended to is a guess
BLOCK_S = 0.2  # of which means are taken: motors have settled (0.04 s), 20 readings
LEAST_EXPLAINED = 0.7  # of the variance
MOST_TURN_DEG = 2.0  # of gravity, first to last
MOST_RETURN_UT = 2.0  # the still field before and after; a turn of 4 deg in 30 uT does that
SILENT_SIGMAS = 3.0  # a change below so many of its sigmas is none


@dataclass(frozen=True)
class ThrottleResult:
    where: str
    per_throttle_ut: Array
    sigma_ut: Array
    explained: float  # of the field's variance, 0 to 1
    returned_ut: float  # still field after, minus before; nan when the log ends with motors on
    span: tuple[float, float]  # of throttle
    samples: int
    throttle: Array = field(repr=False)  # block means, for the figure
    change_ut: Array = field(repr=False)

    @property
    def silent(self) -> bool:
        """The motors do not show."""
        return bool((np.abs(self.per_throttle_ut) < SILENT_SIGMAS * self.sigma_ut).all())

    def sentences(self) -> list[str]:
        low, high = self.span
        lines = [
            f"magnetometer against throttle {low:.2f} to {high:.2f}, {self.samples} samples, "
            "sensor axes",
            f"  per throttle  {numbers(self.per_throttle_ut, 2)} uT, +- {sizes(self.sigma_ut, 2)}",
        ]
        if self.silent:
            lines.append("  the motors do not show in the field: zeros serve as well")
        else:
            lines.append(f"  the line explains {100 * self.explained:.0f} % of the change")
        if np.isfinite(self.returned_ut):
            lines.append(f"  still field after minus before: {self.returned_ut:.2f} uT")
        else:
            lines.append("  next: end the log with 3 s of motors off: it shows that nothing moved")
        return lines

    def to_dict(self) -> dict[str, Any]:
        return {
            "calibration": "throttle",
            "per_throttle_ut": self.per_throttle_ut.tolist(),
            "sigma_ut": self.sigma_ut.tolist(),
            "explained": self.explained,
            "still_field_change_ut": self.returned_ut if np.isfinite(self.returned_ut) else None,
            "throttle": list(self.span),
            "samples": self.samples,
        }

    def members(self) -> Mapping[str, Array]:
        return {"magPerThrottle": self.per_throttle_ut}

    def draw(self, figure: Figure) -> None:
        axes = figure.subplots(1, 3, sharey=True)
        ends = np.array([0.0, self.span[1]])
        for i, axis in enumerate(axes):
            axis.plot(self.throttle, self.change_ut[:, i], ".", markersize=3)
            axis.plot(ends, ends * self.per_throttle_ut[i], color="tab:orange")
            axis.set_title(f"{AXES[i]}: {self.per_throttle_ut[i]:+.2f} uT", loc="left")
            axis.set_xlabel("throttle")
            axis.grid(visible=True, alpha=0.3)
        axes[0].set_ylabel("field minus still field, uT")


def calibrate_throttle(mag: Mag, throttle: Throttle, imu: Imu | None) -> ThrottleResult:
    """`imu` tells whether the aircraft lay still."""
    inside = (mag.time_s >= throttle.time_s[0]) & (mag.time_s <= throttle.time_s[-1])
    time_s, field_ut = mag.time_s[inside], mag.field_ut[inside]
    if len(time_s) < 2:
        raise Incomplete(f"{mag.where}: expected readings beside the motor commands, found none")
    # The command that held when the field was read.
    at = np.searchsorted(throttle.time_s, time_s, side="right") - 1
    level = throttle.throttle[at]
    _refuse_poor_steps(mag, throttle, time_s, level)
    if imu is not None:
        turn = turned_deg(imu.time_s, imu.accel_m_s2)
        if turn > MOST_TURN_DEG:
            raise Incomplete(
                f"{imu.where}: expected an aircraft that does not move, found gravity turned by "
                f"{turn:.1f} deg from begin to end: tie it down, props off"
            )
    returned_ut = _still_change(time_s, level, field_ut)
    if returned_ut > MOST_RETURN_UT:
        raise Incomplete(
            f"{mag.where}: expected the same still field before and after (within {MOST_RETURN_UT} "
            f"uT), found {returned_ut:.1f} uT of change: the aircraft or iron near it moved"
        )
    blocks = block_means(time_s, np.column_stack([level, field_ut]), BLOCK_S)
    x, y = blocks[:, 0], blocks[:, 1:]
    off = x < OFF
    change = y - y[off].mean(axis=0)
    A = np.column_stack([x, np.ones(len(x))])
    found, *_ = np.linalg.lstsq(A, change, rcond=None)
    left = change - A @ found
    variance = float(((change - change.mean(axis=0)) ** 2).sum())
    explained = 1.0 - float((left**2).sum()) / variance
    sigma = np.sqrt((left**2).sum(axis=0) / (len(x) - 2) * np.linalg.inv(A.T @ A)[0, 0])
    result = ThrottleResult(
        where=mag.where,
        per_throttle_ut=found[0],
        sigma_ut=sigma,
        explained=explained,
        returned_ut=returned_ut,
        span=(float(x.min()), float(x.max())),
        samples=len(time_s),
        throttle=x,
        change_ut=change,
    )
    if explained < LEAST_EXPLAINED and not result.silent:
        raise Incomplete(
            f"{mag.where}: expected a field that follows the throttle, found that a line explains "
            f"{100 * explained:.0f} % of its change ({100 * LEAST_EXPLAINED:.0f} % are needed; per "
            f"throttle {numbers(found[0], 1)} uT, +- {sizes(sigma, 1)}): iron moved, or another "
            "load on the battery changed; run all motors alike, in steps of 3 s"
        )
    return result


def _refuse_poor_steps(mag: Mag, throttle: Throttle, time_s: Array, level: Array) -> None:
    period_s = float(np.median(np.diff(time_s)))
    off_s = float((level < OFF).sum()) * period_s
    on_s = float((level >= OFF).sum()) * period_s
    most = float(level.max())
    if off_s < LEAST_STILL_S or on_s < LEAST_ON_S or most < LEAST_SPAN:
        raise Incomplete(
            f"{throttle.where}: expected motors off for {LEAST_STILL_S:.0f} s and on for "
            f"{LEAST_ON_S:.0f} s, up to a throttle of at least {LEAST_SPAN}, found {off_s:.1f} s, "
            f"{on_s:.1f} s and {most:.2f}, beside {len(time_s)} readings of {mag.where}: props "
            "off, tied down, 3 s off, steps of 3 s up to half throttle, 3 s off"
        )


def _still_change(time_s: Array, level: Array, field_ut: Array) -> float:
    """Length of the still field after the last step minus before the first; nan without one."""
    on = np.flatnonzero(level >= OFF)
    before = field_ut[: on[0]]
    settled = time_s > time_s[on[-1]] + 0.5
    after = field_ut[settled]
    if len(before) < 20 or len(after) < 20:
        return float("nan")
    return float(np.linalg.norm(after.mean(axis=0) - before.mean(axis=0)))
