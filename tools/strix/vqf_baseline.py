"""VQF, the best published attitude filter without velocity aid, on a recording (Laidig and Seel,
Information Fusion 2023; their own implementation, with its defaults).

VQF's world is east, north, up with magnetic north; any body frame will do, as it learns what the
sensors measure at rest from the specific force alone.
"""

from __future__ import annotations

import math

import numpy as np
from vqf import VQF, offlineVQF

from strix.recording import Array, Recording
from strix.score import multiply

# Turns coordinates in east, north, up into north, east, down: half a turn about north-east.
ENU_TO_NED = np.array([0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0])


def real_time(recording: Recording, declination_rad: float = 0.0) -> Array:
    """t_s, qw, qx, qy, qz after each IMU sample, from what was measured until then."""
    t_s, accel, gyro = _imu(recording)
    mag = recording.mag
    due = np.searchsorted(mag[:, 0], t_s, side="right").tolist()
    filter_ = VQF(_interval(t_s), magTs=_interval(mag[:, 0]) if len(mag) > 1 else -1.0)
    fields = np.ascontiguousarray(mag[:, 1:4])
    attitude = np.empty((len(t_s), 4))
    used = 0
    for row in range(len(t_s)):
        filter_.updateGyr(gyro[row])
        filter_.updateAcc(accel[row])
        for i in range(used, due[row]):
            filter_.updateMag(fields[i])
        used = due[row]
        attitude[row] = filter_.getQuat9D()
    return _in_ned(t_s, attitude, declination_rad)


def offline(recording: Recording, declination_rad: float = 0.0) -> Array:
    """The same from the whole recording at once: it knows the future, so no flight filter can be
    asked to be as good.
    """
    t_s, accel, gyro = _imu(recording)
    mag = recording.mag
    if not len(mag):
        attitude = offlineVQF(gyro, accel, None, _interval(t_s))["quat6D"]
    else:
        field = [np.interp(t_s, mag[:, 0], mag[:, axis]) for axis in (1, 2, 3)]
        attitude = offlineVQF(gyro, accel, np.column_stack(field), _interval(t_s))["quat9D"]
    return _in_ned(t_s, attitude, declination_rad)


def _imu(recording: Recording) -> tuple[Array, Array, Array]:
    """Times, specific force in m/s^2, rate in rad/s."""
    imu = recording.imu
    return imu[:, 0], np.ascontiguousarray(imu[:, 1:4]), np.ascontiguousarray(imu[:, 4:7])


def _interval(t_s: Array) -> float:
    return float((t_s[-1] - t_s[0]) / (len(t_s) - 1))


def _in_ned(t_s: Array, attitude: Array, declination_rad: float) -> Array:
    half = 0.5 * declination_rad  # about down: from magnetic to true north
    turn = np.array([[math.cos(half), 0.0, 0.0, math.sin(half)]])
    to_ned = np.repeat(multiply(turn, ENU_TO_NED[None]), len(t_s), axis=0)
    return np.column_stack([t_s, multiply(to_ned, attitude)])
