"""The still start of a recording: what the aircraft's start-up calibration would measure there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strix.recording import FIX, FIX_3D, PLACE, Array, Recording

WINDOW_S = 2.0
SEARCH_S = 60.0  # how far from the start a still window is looked for
# At rest: well above sensor noise and idling motors, well below any hand or flight.
STILL_RATE_STD_RAD_S = 0.05
STILL_ACCEL_STD_M_S2 = 0.5
STILL_BIAS_RAD_S = 0.1


@dataclass(frozen=True)
class StillStart:
    """Means over the window. Without a reading of a sensor in it, the first one after it."""

    begin_s: float
    end_s: float
    accel_m_s2: Array
    gyro_bias_rad_s: Array
    mag_ut: Array  # zeros without a magnetometer
    alt_m: float  # zero without a barometer
    place: Array  # latitude and longitude in deg, altitude in m; zeros without GPS
    resting: bool
    note: str  # empty, or why this window


def find_still_start(recording: Recording) -> StillStart:
    """The first WINDOW_S seconds if the aircraft rests in them, else the stillest such window of
    the first SEARCH_S seconds.
    """
    imu = recording.imu
    begin = imu[0, 0]
    note = ""
    if not _rests(_window(imu, begin)):
        last = min(begin + SEARCH_S, imu[-1, 0]) - WINDOW_S
        begins = np.append(np.arange(begin, last, 0.25 * WINDOW_S), begin)
        begin = min(begins, key=lambda t: _unrest(_window(imu, t)))
        note = f"not at rest at the start: aligned at {begin:.1f} to {begin + WINDOW_S:.1f} s"
    rest = _window(imu, begin)
    resting = _rests(rest)
    if not resting:
        note += ", the stillest there is: expect errors of some degrees"
    fixes = recording.gps[recording.gps[:, FIX] >= FIX_3D]
    field = _mean_or_first(recording.mag, begin)
    height = _mean_or_first(recording.baro, begin)
    place = _mean_or_first(fixes, begin)
    return StillStart(
        begin_s=float(begin),
        end_s=float(rest[-1, 0]),
        accel_m_s2=rest[:, 1:4].mean(axis=0),
        gyro_bias_rad_s=rest[:, 4:7].mean(axis=0) if resting else np.zeros(3),
        mag_ut=field[1:4],
        alt_m=float(height[1]),
        place=place[PLACE],
        resting=resting,
        note=note,
    )


def _window(table: Array, begin_s: float) -> Array:
    first, last = np.searchsorted(table[:, 0], [begin_s, begin_s + WINDOW_S])
    return table[first : max(int(last), int(first) + 1)]


def _mean_or_first(table: Array, begin_s: float) -> Array:
    """Mean over the window, else the first row after it, else the last before it, else zeros."""
    if not len(table):
        return np.zeros(table.shape[1])
    if table[-1, 0] < begin_s:
        return np.asarray(table[-1])
    return np.asarray(_window(table, begin_s).mean(axis=0))


def _unrest(imu: Array) -> float:
    return float(
        max(
            imu[:, 1:4].std(axis=0).max() / STILL_ACCEL_STD_M_S2,
            imu[:, 4:7].std(axis=0).max() / STILL_RATE_STD_RAD_S,
            np.abs(imu[:, 4:7].mean(axis=0)).max() / STILL_BIAS_RAD_S,
        )
    )


def _rests(imu: Array) -> bool:
    return _unrest(imu) < 1.0
