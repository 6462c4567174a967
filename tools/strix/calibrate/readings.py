"""Raw readings of a flight log, in sensor axes, looked at before anybody averages them.

A folder as `strix estimate` reads it (strix/recording.py) serves too: its IMU and magnetometer.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strix.calibrate.outcome import GRAVITY_M_S2
from strix.errors import BadInput
from strix.flightlog import Array, FlightLog, Topic, read_flight_log, refuse_backwards
from strix.recording import Recording, read_recording

# Full scale as src/board sets the IMU up (ImuIcm20649.cpp: 30 g, 2000 deg/s), and of the LIS2MDL:
# 16 bits of 0.15 uT (AN5069: +-50 gauss).
ACCEL_RANGE_M_S2 = 30.0 * GRAVITY_M_S2
GYRO_RANGE_RAD_S = np.radians(2000.0)
MAG_RANGE_UT = 4915.2
# A range that is smaller than we think shows as a flat top: an axis stays at its extreme, bit for
# bit, while the others go on. Noise of a count or more does not do that ten times in a row.
FLAT_SAMPLES = 10
STUCK_S = 1.0  # no noise at all for so long is no sensor


@dataclass(frozen=True)
class Imu:
    where: str
    time_s: Array
    accel_m_s2: Array  # (N, 3)
    gyro_rad_s: Array  # (N, 3)
    temperature_degc: Array  # (N,), nan where nobody measured it

    @property
    def rate_hz(self) -> float:
        """Mean."""
        return (len(self.time_s) - 1) / float(self.time_s[-1] - self.time_s[0])

    def part(self, begin: int, end: int) -> Imu:
        """Records [begin, end)."""
        return Imu(
            self.where,
            self.time_s[begin:end],
            self.accel_m_s2[begin:end],
            self.gyro_rad_s[begin:end],
            self.temperature_degc[begin:end],
        )


@dataclass(frozen=True)
class Mag:
    where: str
    time_s: Array
    field_ut: Array  # (N, 3)


@dataclass(frozen=True)
class Baro:
    where: str
    time_s: Array
    pressure_pa: Array
    temperature_degc: Array


@dataclass(frozen=True)
class Gps:
    where: str
    time_s: Array
    lat_deg: Array
    lon_deg: Array
    alt_m: Array
    speed_knots: Array
    course_deg: Array
    hdop: Array
    fix_type: Array
    satellites: Array


@dataclass(frozen=True)
class Throttle:
    where: str
    time_s: Array
    throttle: Array  # mean motor command between its limits, 0 to 1


class Readings:
    """Of one log or recording."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._recording: Recording | None = None
        self._log: FlightLog | None = None
        if path.is_dir():
            self._recording = read_recording(path)
        else:
            self._log = read_flight_log(path)

    def imu(self) -> Imu:
        if self._recording is not None:
            table = self._recording.imu
            unknown = np.full(len(table), np.nan)
            imu = Imu(f"{self.path}: imu", table[:, 0], table[:, 1:4], table[:, 4:7], unknown)
        else:
            topic = self._topic("sensor_combined")
            temperature_degc = topic["temperature"]
            accel, gyro = topic["accelerometer_m_s2"], topic["gyro_rad"]
            imu = Imu(topic.where, _sampled_s(topic), accel, gyro, temperature_degc)
            refuse_not_finite(topic.where, "temperature", temperature_degc)
        _check_vectors(imu.where, "accelerometer", imu.time_s, imu.accel_m_s2)
        _check_vectors(imu.where, "gyro", imu.time_s, imu.gyro_rad_s)
        refuse_clipped(imu.where, "accelerometer", "m/s^2", imu.accel_m_s2, ACCEL_RANGE_M_S2, 15.0)
        refuse_clipped(imu.where, "gyro", "rad/s", imu.gyro_rad_s, float(GYRO_RANGE_RAD_S), 1.0)
        return imu

    def mag(self) -> Mag:
        if self._recording is not None:
            table = self._recording.mag
            if not len(table):
                raise BadInput(f"{self.path}: expected mag.csv or mag.csv.gz, found neither")
            mag = Mag(f"{self.path}: mag", table[:, 0], table[:, 1:4])
        else:
            topic = self._topic("sensor_mag")
            mag = Mag(topic.where, _sampled_s(topic), topic["field_ut"])
        _check_vectors(mag.where, "field", mag.time_s, mag.field_ut)
        refuse_clipped(mag.where, "field", "uT", mag.field_ut, MAG_RANGE_UT, 0.0)
        return mag

    def has_mag(self) -> bool:
        if self._recording is not None:
            return len(self._recording.mag) > 0
        return self._log is not None and self._log.has("sensor_mag")

    def has_imu(self) -> bool:
        return self._recording is not None or (
            self._log is not None and self._log.has("sensor_combined")
        )

    def baro(self) -> Baro:
        topic = self._topic("sensor_baro")
        baro = Baro(topic.where, _sampled_s(topic), topic["pressure"], topic["temperature"])
        for field in ("pressure", "temperature"):
            refuse_not_finite(topic.where, field, topic[field])
        _refuse_stuck(baro.where, "pressure", baro.time_s, baro.pressure_pa)
        return baro

    def gps(self) -> Gps:
        topic = self._topic("vehicle_gps_position")
        for field in ("speed_knots", "course_deg", "hdop"):
            refuse_not_finite(topic.where, field, topic[field])
        return Gps(
            topic.where,
            _sampled_s(topic),
            topic["lat"] * 1e-7,
            topic["lon"] * 1e-7,
            topic["alt"] * 1e-3,
            topic["speed_knots"],
            topic["course_deg"],
            topic["hdop"],
            topic["fix_type"],
            topic["satellites_used"],
        )

    def throttle(self) -> Throttle:
        """Mean motor command between its limits, off to the largest the ESC takes."""
        from strix import _core

        topic = self._topic("actuator_outputs")
        name = self._log.info.get("vehicle", "") if self._log is not None else ""
        try:
            vehicle = _core.vehicle(name)
        except KeyError:
            known = ", ".join(_core.vehicle_names())
            raise BadInput(
                f"{self.path}: expected a vehicle with known limits of its motor commands "
                f"({known}), found {name!r}"
            ) from None
        off, most = vehicle["command_off"], vehicle["command_max"]
        refuse_not_finite(topic.where, "output", topic["output"])
        throttle = (topic["output"].mean(axis=1) - off) / (most - off)
        return Throttle(topic.where, topic.time_s, np.clip(throttle, 0.0, 1.0))

    def _topic(self, name: str) -> Topic:
        if self._log is None:
            raise BadInput(f"{self.path}: expected a flight log with topic {name}, found a folder")
        return self._log.topic(name)


def _sampled_s(topic: Topic) -> Array:
    """When the sensor measured."""
    return topic["timestamp_sample"] * 1e-6


def _check_vectors(where: str, field: str, time_s: Array, values: Array) -> None:
    refuse_not_finite(where, field, values)
    refuse_backwards(where, "sample time", time_s)
    _refuse_stuck(where, field, time_s, values)


def refuse_not_finite(where: str, field: str, values: Array) -> None:
    """The first NaN or infinity ends it: nobody knows what else is wrong there."""
    bad = ~np.isfinite(values)
    if bad.any():
        row = int(np.argwhere(bad)[0][0])
        raise BadInput(
            f"{where}, record {row + 1}, {field}: expected finite numbers, "
            f"found {np.array2string(values[row])} ({int(bad.sum())} such numbers in all)"
        )


def _refuse_stuck(where: str, field: str, time_s: Array, values: Array) -> None:
    same = np.diff(values, axis=0) == 0.0
    begin, end = longest_run(same if same.ndim == 1 else same.all(axis=1))
    lasted_s = float(time_s[end] - time_s[begin]) if end > begin else 0.0
    if lasted_s >= STUCK_S:
        raise BadInput(
            f"{where}, {field}: expected noise, found the same value for {lasted_s:.1f} s from "
            f"{time_s[begin]:.1f} s: the sensor was stuck"
        )


def refuse_clipped(
    where: str, field: str, unit: str, values: Array, full_scale: float, from_size: float
) -> None:
    """Samples at full scale, or a flat top above `from_size`: what was there nobody knows."""
    clipped: NDArray[np.bool_] = np.abs(values) >= 0.999 * full_scale
    for axis in range(3):
        one = values[:, axis]
        others = np.delete(values, axis, axis=1)
        goes_on = (np.diff(others, axis=0) != 0.0).any(axis=1)
        for extreme in (float(one.min()), float(one.max())):
            if abs(extreme) < from_size:
                continue
            at_extreme = (one[1:] == extreme) & (one[:-1] == extreme) & goes_on
            for begin, end in runs(at_extreme):
                if end - begin + 1 >= FLAT_SAMPLES:
                    clipped[begin : end + 1, axis] = True
    if clipped.any():
        size = float(np.abs(values[clipped]).max())
        raise BadInput(
            f"{where}, {field}: expected readings within the sensor's range, found "
            f"{int(clipped.any(axis=1).sum())} of {len(values)} clipped (at {size:.4g} {unit}), "
            f"the first in record {int(np.argwhere(clipped)[0][0]) + 1}"
        )


def runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """[begin, end) of each unbroken run of True."""
    edges = np.diff(np.concatenate([[0], np.asarray(flags, dtype=np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return [(int(b), int(e)) for b, e in zip(begins, ends, strict=True)]


def longest_run(flags: NDArray[np.bool_]) -> tuple[int, int]:
    """[begin, end) of the longest, (0, 0) when there is none."""
    return max(runs(flags), key=lambda run: run[1] - run[0], default=(0, 0))
