"""When the aircraft stood still: the flight code's test (StandstillDetector.h), for a log.

Its thresholds, against means over its half second. A log also knows what comes: a sample rests that
keeps to what was before it or to what follows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strix.calibrate.outcome import GRAVITY_M_S2, angle_deg
from strix.calibrate.readings import Imu, runs
from strix.flightlog import Array

# In flight 1 m/s^2: here neither bias nor scale of the accelerometer is taken off yet.
RAW_FORCE_M_S2 = 2.0
# At its ends a stretch still knows the hand that put the aircraft down, and the one that takes it.
TRIM_S = 0.3
GAP_S = 0.1  # without a sample: what happened there nobody knows
BLOCK_S = 1.0  # of which means are taken, to see more than the white noise


@dataclass(frozen=True)
class Stretch:
    """Records [begin, end) of the IMU, a standstill without a break, its ends cut off."""

    begin: int
    end: int
    begin_s: float
    end_s: float

    @property
    def duration_s(self) -> float:
        return self.end_s - self.begin_s


def still_stretches(imu: Imu) -> list[Stretch]:
    """In order of time. The thresholds are NavigationConfig's."""
    from strix import _core

    limits = _core.NavigationConfig().standstill
    time_s = imu.time_s
    steps_s = np.diff(time_s)
    period_s = float(np.median(steps_s)) if len(steps_s) else 0.0
    if period_s <= 0.0:
        return []
    width = max(1, round(limits.lowPass / period_s))

    def near_its_past(gyro: Array, accel: Array) -> NDArray[np.bool_]:
        mean_gyro, mean_accel = _mean_of_last(gyro, width), _mean_of_last(accel, width)
        force = np.linalg.norm(mean_accel, axis=1)
        return np.asarray(
            (np.linalg.norm(gyro - mean_gyro, axis=1) < limits.rate)
            & (np.linalg.norm(accel - mean_accel, axis=1) < limits.acceleration)
            & (np.linalg.norm(mean_gyro, axis=1) < limits.meanRate)
            & (np.abs(force - GRAVITY_M_S2) < RAW_FORCE_M_S2)
        )

    past = near_its_past(imu.gyro_rad_s, imu.accel_m_s2)
    future = near_its_past(imu.gyro_rad_s[::-1], imu.accel_m_s2[::-1])[::-1]
    # A jump from one rest into the next keeps to its past before it and to its future behind it.
    goes_on = (past[1:] & past[:-1]) | (future[1:] & future[:-1])
    goes_on &= steps_s < GAP_S
    found = []
    for begin, end in runs(goes_on):
        if time_s[end] - time_s[begin] < limits.duration * 1e-6:
            continue
        first = int(np.searchsorted(time_s, time_s[begin] + TRIM_S))
        last = int(np.searchsorted(time_s, time_s[end] - TRIM_S))
        found.append(Stretch(first, last, float(time_s[first]), float(time_s[last - 1])))
    return found


def longest_still(imu: Imu) -> Stretch | None:
    return max(still_stretches(imu), key=lambda stretch: stretch.duration_s, default=None)


def block_means(time_s: Array, values: Array, block_s: float = BLOCK_S) -> Array:
    """Means of whole blocks of equal duration, a row a block."""
    number = np.floor((time_s - time_s[0]) / block_s).astype(int)
    count = int(np.floor((time_s[-1] - time_s[0]) / block_s + 1e-9))
    keep = number < count
    sums = np.zeros((count, values.shape[1]))
    np.add.at(sums, number[keep], values[keep])
    sizes = np.bincount(number[keep], minlength=count)
    full = sizes > 0
    return np.asarray(sums[full] / sizes[full, None])


def mean_and_sigma(time_s: Array, values: Array, block_s: float = BLOCK_S) -> tuple[Array, Array]:
    """Mean, and its one sigma from the scatter of the block means: noise that lasts longer than a
    sample counts as it should.
    """
    blocks = block_means(time_s, values, block_s)
    mean = values.mean(axis=0)
    if len(blocks) < 2:
        return mean, values.std(axis=0, ddof=1) / np.sqrt(len(values))
    return mean, blocks.std(axis=0, ddof=1) / np.sqrt(len(blocks))


def turned_deg(time_s: Array, vectors: Array) -> float:
    """Angle between the mean directions of the first and the last tenth."""
    tenth = (time_s[-1] - time_s[0]) / 10.0
    first = vectors[time_s <= time_s[0] + tenth].mean(axis=0)
    last = vectors[time_s >= time_s[-1] - tenth].mean(axis=0)
    return angle_deg(first, last)


def _mean_of_last(values: Array, width: int) -> Array:
    """Of `width` values up to each; of as many as there are at the begin."""
    sums = np.cumsum(values - values[0], axis=0)  # small numbers lose no digits
    sums[width:] = sums[width:] - sums[:-width]
    counts = np.minimum(np.arange(1, len(values) + 1), width)
    return np.asarray(values[0] + sums / counts[:, None])
