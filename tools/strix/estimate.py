"""Running the flight filter on a recording."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strix._core import (
    GeoPoint,
    LocalFrame,
    Navigation9,
    Navigation18,
    NavigationConfig,
    alignStill,
)
from strix.errors import BadInput
from strix.recording import FIX, FIX_3D, PLACE, VELOCITY, Array, Recording
from strix.still import StillStart, find_still_start

EST_COLUMNS = ("t_s", "qw", "qx", "qy", "qz", "pn", "pe", "pd", "vn", "ve", "vd")
DELAYED_SENSORS = ("mag", "baro", "gps")
MAX_DELAY_S = 0.6  # what MotionHistory.h remembers
NAVIGATIONS: dict[int, type[Navigation9] | type[Navigation18]] = {9: Navigation9, 18: Navigation18}


@dataclass(frozen=True)
class Estimate:
    """The filter's state after each IMU sample, from the still start on."""

    table: Array  # columns as in EST_COLUMNS
    start: StillStart
    gps_innovations: Array  # t_s, north and east in m, north and east in m/s, a row a fix


def parse_delays(text: str) -> dict[str, float]:
    """'gps=0.22,baro=0.35' as {'gps': 0.22, 'baro': 0.35}, in seconds."""
    delays: dict[str, float] = {}
    for part in filter(None, (part.strip() for part in text.split(","))):
        sensor, _, number = (piece.strip() for piece in part.partition("="))
        if sensor not in DELAYED_SENSORS:
            raise BadInput(
                f"--delay: expected SENSOR=SECONDS with a sensor of {', '.join(DELAYED_SENSORS)}, "
                f"found {part!r}"
            )
        try:
            delays[sensor] = float(number)
        except ValueError:
            delays[sensor] = math.nan
        if not 0.0 <= delays[sensor] <= MAX_DELAY_S:
            raise BadInput(
                f"--delay: expected {sensor}= a number of seconds from 0 to {MAX_DELAY_S:g}, "
                f"found {number!r}"
            )
    return delays


def estimate(
    recording: Recording,
    declination_rad: float = 0.0,
    delays_s: Mapping[str, float] | None = None,
    config: NavigationConfig | None = None,
    states: int = 18,
) -> Estimate:
    """Align at the still start and run the navigation from there, in the order of the flight loop.

    A reading is used at the IMU sample nearest to its time stamp, and of GPS and barometer the
    navigation knows the age. The field's time stamp is moved back by its age instead: the
    navigation remembers where it was, but not how it was turned.
    """
    if states not in NAVIGATIONS:
        raise BadInput(f"--states: expected 9 or 18, found {states}")
    if not math.isfinite(declination_rad):
        raise BadInput(f"--declination: expected a number of degrees, found {declination_rad}")
    delays_s = delays_s or {}
    recording = _undelayed(recording, {"mag": delays_s.get("mag", 0.0)})
    start = find_still_start(recording)
    imu = recording.imu[np.searchsorted(recording.imu[:, 0], start.begin_s) :]
    config = config or NavigationConfig()
    if not start.resting:
        _expect_motion(config)
    config.gpsDelay = round(1e6 * delays_s.get("gps", 0.0))
    config.altDelay = round(1e6 * delays_s.get("baro", 0.0))
    gravity = float(np.linalg.norm(start.accel_m_s2)) if start.resting else config.gravity
    navigation = NAVIGATIONS[states](config)
    alignment = alignStill(_single(start.accel_m_s2), _single(start.mag_ut), declination_rad)

    now = micros(imu[:, 0])
    navigation.initialize(alignment, gravity, now[0])
    accel = _single(imu[:, 1:4])
    gyro = _single(imu[:, 4:7] - start.gyro_bias_rad_s)
    mag = _Readings(recording.mag, imu)
    mag_ut = _single(mag.table[:, 1:4])
    alt = _Readings(recording.baro, imu)
    height_m = (alt.table[:, 1] - start.alt_m).tolist()
    gps = _Readings(recording.gps[recording.gps[:, FIX] >= FIX_3D], imu)
    position = _single(local_ned(gps.table[:, PLACE], start.place))
    velocity = _single(gps.table[:, VELOCITY])

    innovations: list[list[float]] = []
    table = np.empty((len(imu), len(EST_COLUMNS)))
    table[:, 0] = imu[:, 0]
    for row in range(len(imu)):
        navigation.predict(accel[row], gyro[row], now[row])
        navigation.updateTiltMeas(accel[row])
        for i in mag.at(row):
            navigation.updateMagMeas(mag_ut[i], now[row])
        for i in alt.at(row):
            navigation.updateAltMeas(height_m[i], now[row])
        for i in gps.at(row):
            navigation.updateGPSMeas(position[i], velocity[i], now[row])
            innovations.append([imu[row, 0], *navigation.gpsInnovation().value])
        navigation.finishPass(now[row])
        table[row, 1:5] = navigation.attitude
        table[row, 5:8] = navigation.positionNed
        table[row, 8:11] = navigation.velocityNed
    return Estimate(table, start, np.array(innovations).reshape(-1, 5))


def write_estimate(path: Path, result: Estimate) -> None:
    """Write est.csv (gzipped where the name ends in .gz); its folder is made."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savetxt(
            path,
            result.table,
            fmt=["%.6f"] + 4 * ["%.8f"] + 6 * ["%.5f"],
            delimiter=",",
            header=",".join(EST_COLUMNS),
            comments="",
        )
    except OSError as error:
        raise BadInput(
            f"{path}: expected a file that can be written, "
            f"found: {error.strerror}: {error.filename}"
        ) from None


def micros(t_s: Array) -> list[int]:
    """The loop's clock: microseconds in 32 bits, which wrap after 71.6 min."""
    return [int(t) & 0xFFFFFFFF for t in np.rint(t_s * 1e6)]


def local_ned(places: Array, origin: Array) -> Array:
    """Latitude and longitude in deg and altitude in m, a row a fix, as NED from the origin in m."""
    frame = LocalFrame(_geo_point(origin))
    return np.array([frame.toNed(_geo_point(place)) for place in places]).reshape(-1, 3)


def _geo_point(place: Array) -> GeoPoint:
    latitude, longitude, altitude = (int(x) for x in np.rint(place * [1e7, 1e7, 1e3]))
    return GeoPoint(latitude, longitude, altitude)


def _expect_motion(config: NavigationConfig) -> None:
    """Be unsure of an alignment that took accelerations for gravity."""
    config.positionSigma0 = 5.0
    config.velocitySigma0 = 5.0
    config.tiltSigma0 = 0.2
    config.headingSigma0 = 0.5


class _Readings:
    """One sensor's readings, each at the IMU sample nearest in time."""

    def __init__(self, table: Array, imu: Array) -> None:
        t_s = imu[:, 0]
        self.table = table[(table[:, 0] >= t_s[0]) & (table[:, 0] <= t_s[-1])]
        self.now = micros(self.table[:, 0])
        row = np.searchsorted(0.5 * (t_s[1:] + t_s[:-1]), self.table[:, 0])
        self._first = np.searchsorted(row, np.arange(len(t_s) + 1)).tolist()

    def at(self, row: int) -> range:
        """Indices of the readings that belong to this IMU row."""
        return range(self._first[row], self._first[row + 1])


def _undelayed(recording: Recording, delays_s: Mapping[str, float]) -> Recording:
    """The recording with each time stamp moved back to when the sensor measured."""
    moved: dict[str, Any] = {}
    for sensor, delay_s in delays_s.items():
        table: Array = getattr(recording, sensor).copy()
        table[:, 0] -= delay_s
        moved[sensor] = table
    return replace(recording, **moved)


def _single(values: Array) -> NDArray[np.float32]:
    return np.ascontiguousarray(values, dtype=np.float32)
