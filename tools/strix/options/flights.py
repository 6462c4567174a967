"""Simulated flights for the comparisons: an exact trajectory, what the sensors say of it, and what
the navigation makes of that.

Truth is integrated in double by the discrete equations of DESIGN.md, 4. Attitude and velocity are
given independently: a body that can do more than a quadcopter can.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from strix._core import (
    Alignment,
    MotorState,
    Navigation9,
    Navigation18,
    NavigationConfig,
    alignStill,
)
from strix.ideal_flight import cumulative_product, exponential, rotated
from strix.plant.earth import MAGNETIC_DECLINATION_RAD, MAGNETIC_FIELD_NED_UT
from strix.score import conjugate, multiply

Array = NDArray[np.float64]
Navigation = Navigation9 | Navigation18
NAVIGATIONS: dict[int, type[Navigation]] = {9: Navigation9, 18: Navigation18}

GRAVITY = NavigationConfig().gravity
HZ = 200  # of the IMU, where nothing needs the aircraft's 1000
MAG_HZ, ALT_HZ, GPS_HZ = 100, 50, 10
RECORD_HZ = 10
LEVEL_NORTH = np.array([[1.0, 0.0, 0.0, 0.0]])

# DESIGN.md, 5: 0.028 m/s^2 and 0.0031 rad/s in 100 Hz are densities of sigma / sqrt(2 * 100 Hz).
ACCEL_DENSITY = 0.028 / np.sqrt(200.0)
GYRO_DENSITY = 0.0031 / np.sqrt(200.0)
MAG_SIGMA_UT = 0.3
ALT_SIGMA_M = 0.17  # 2 Pa
# The white part of a fix's error, as the filter's defaults expect it. Its 3 m are slow: a shift of
# the whole flight, which no option here is about.
GPS_SIGMA_M, GPS_SIGMA_M_S = 0.5, 0.2


def tuned(**changes: Any) -> NavigationConfig:
    """The defaults, but for what is named."""
    config = NavigationConfig()
    for name, value in changes.items():
        if not hasattr(config, name):
            raise AttributeError(name)
        setattr(config, name, value)
    return config


@dataclass(frozen=True)
class Truth:
    """A row an IMU sample; the first is one period after the start."""

    hz: int
    start: Array  # attitude then, at (0, 0, 0)
    position_m: Array  # NED
    velocity_m_s: Array  # NED
    attitude: Array
    force_m_s2: Array  # specific, body
    rate_rad_s: Array  # body

    def rows(self, hz: int) -> NDArray[np.int64]:
        """Rows of a sensor with that rate."""
        step = self.hz // hz
        return np.arange(step - 1, len(self.attitude), step)

    def times(self, hz: int) -> Array:
        """Times of those rows in s."""
        return np.asarray((self.rows(hz) + 1) / self.hz)


def clock(duration_s: float, hz: int = HZ) -> Array:
    """The times of the samples in s, with the start: one more than samples."""
    return np.arange(round(duration_s * hz) + 1) / hz


def fly(velocity_m_s: Array, rate_rad_s: Array, start: Array = LEVEL_NORTH, hz: int = HZ) -> Truth:
    """From velocities at every time of clock() and the rates between them."""
    step_s = 1.0 / hz
    attitude = cumulative_product(np.vstack([start, exponential(step_s * rate_rad_s)]))
    middle = 0.5 * (velocity_m_s[1:] + velocity_m_s[:-1])
    acceleration = np.diff(velocity_m_s, axis=0) / step_s - [0.0, 0.0, GRAVITY]
    return Truth(
        hz=hz,
        start=start,
        position_m=np.cumsum(step_s * middle, axis=0),
        velocity_m_s=velocity_m_s[1:],
        attitude=attitude[1:],
        # Over a step the specific force is turned by the attitude at its beginning.
        force_m_s2=rotated(conjugate(attitude[:-1]), acceleration),
        rate_rad_s=rate_rad_s,
    )


def at_rest(duration_s: float, hz: int = HZ) -> Truth:
    """Level, to the north, without motion."""
    count = round(duration_s * hz)
    return fly(np.zeros((count + 1, 3)), np.zeros((count, 3)), hz=hz)


def waves(time_s: Array, rng: Generator, rms: float, low_hz: float, high_hz: float) -> Array:
    """Three independent sums of sinusoids, a row a time."""
    count = 4
    rate = 2.0 * np.pi * rng.uniform(low_hz, high_hz, (count, 3))
    phase = rng.uniform(0.0, 2.0 * np.pi, (count, 3))
    sines = np.sin(time_s[:, None, None] * rate + phase)
    return np.asarray(rms * np.sqrt(2.0 / count) * sines.sum(axis=1))


def begun(time_s: Array, at_s: float) -> Array:
    """0 until then, 1 from two seconds later on, smoothly; a column."""
    part = np.clip(0.5 * (time_s - at_s), 0.0, 1.0)
    return np.asarray((part * part * (3.0 - 2.0 * part))[:, None])


@dataclass
class Readings:
    """What the sensors say; a scenario changes it. GPS rows are of arrival: delay_s later."""

    accel_m_s2: Array
    gyro_rad_s: Array
    mag_ut: Array
    height_m: Array
    fix: Array  # position and velocity, NED
    use_mag: bool = True
    use_alt: bool = True
    use_gps: bool = True
    silent: dict[str, tuple[float, float]] = field(default_factory=dict)  # sensor: from, to (s)


def measure(
    truth: Truth,
    rng: Generator,
    accel_bias: Array | float = 0.0,
    gyro_bias: Array | float = 0.0,
    gyro_scale: float = 0.0,
    accel_density: float = ACCEL_DENSITY,
    gyro_density: float = GYRO_DENSITY,
    gps_delay_s: float = 0.0,
    alt_delay_s: float = 0.0,
) -> Readings:
    """Every sensor at its rate, with white noise."""

    def noisy(values: Array, sigma: float) -> Array:
        return np.asarray(values + rng.normal(0.0, sigma, values.shape))

    def late(rows: NDArray[np.int64], delay_s: float) -> NDArray[np.int64]:
        return np.maximum(rows - round(delay_s * truth.hz), 0)

    root_hz = np.sqrt(truth.hz)
    mag = rotated(conjugate(truth.attitude[truth.rows(MAG_HZ)]), np.array([MAGNETIC_FIELD_NED_UT]))
    height = -truth.position_m[late(truth.rows(ALT_HZ), alt_delay_s), 2]
    fix = np.hstack([truth.position_m, truth.velocity_m_s])[late(truth.rows(GPS_HZ), gps_delay_s)]
    return Readings(
        accel_m_s2=noisy(truth.force_m_s2 + accel_bias, accel_density * root_hz),
        gyro_rad_s=noisy((1.0 + gyro_scale) * truth.rate_rad_s + gyro_bias, gyro_density * root_hz),
        mag_ut=noisy(mag, MAG_SIGMA_UT),
        height_m=noisy(height, ALT_SIGMA_M),
        fix=fix + rng.normal(size=fix.shape) * np.repeat([GPS_SIGMA_M, GPS_SIGMA_M_S], 3),
    )


def aligned(attitude: Array, accel_bias: Array | float = 0.0) -> Alignment:
    """What a start at rest with this attitude finds, but for noise."""
    vectors = np.array([[0.0, 0.0, -GRAVITY], MAGNETIC_FIELD_NED_UT])
    accel, mag = rotated(conjugate(attitude), vectors)
    return alignStill(_single(accel + accel_bias), _single(mag), MAGNETIC_DECLINATION_RAD)


@dataclass(frozen=True)
class Track:
    """What the navigation made of it, RECORD_HZ times a second; errors are estimate minus truth."""

    time_s: Array
    tilt_deg: Array  # angle between the two verticals
    heading_deg: Array
    position_m: Array  # error
    velocity_m_s: Array  # error
    gyro_bias_rad_s: Array  # estimate
    mag_bias_ut: Array  # estimate
    sigma: Array  # of the error states
    health: NDArray[np.int64]
    navigation: Navigation

    def after(self, time_s: float) -> NDArray[np.bool_]:
        """Records later than that."""
        return self.time_s > time_s


def navigate(
    truth: Truth,
    readings: Readings,
    config: NavigationConfig,
    states: int = 18,
    motors: dict[float, MotorState] | None = None,
    start: Alignment | None = None,
    poison: dict[float, Array] | None = None,
) -> Track:
    """Run the flight code, in the order of its loop.

    `motors` is what they do from a time on; `start` an alignment that is not the truth; `poison`
    replaces one accelerometer reading.
    """
    navigation = NAVIGATIONS[states](config)
    navigation.initialize(start or aligned(truth.start), GRAVITY, 0)
    accel, gyro = _single(readings.accel_m_s2), _single(readings.gyro_rad_s)
    for time_s, value in (poison or {}).items():
        accel[round(time_s * truth.hz)] = value
    mag = _due(truth, readings, MAG_HZ, "mag", readings.use_mag)
    alt = _due(truth, readings, ALT_HZ, "alt", readings.use_alt)
    gps = _due(truth, readings, GPS_HZ, "gps", readings.use_gps)
    mag_ut, fix, height = (
        _single(readings.mag_ut),
        _single(readings.fix),
        readings.height_m.tolist(),
    )
    changes = {round(t * truth.hz): state for t, state in (motors or {}).items()}
    recorded = set(truth.rows(RECORD_HZ).tolist())
    states_seen: list[Array] = []
    health: list[int] = []
    period_us = 1_000_000 // truth.hz
    for row in range(len(accel)):
        now = (row + 1) * period_us
        if row in changes:
            navigation.setMotors(changes[row])
        navigation.predict(accel[row], gyro[row], now)
        navigation.updateTiltMeas(accel[row])
        if row in mag:
            navigation.updateMagMeas(mag_ut[mag[row]], now)
        if row in alt:
            navigation.updateAltMeas(height[alt[row]], now)
        if row in gps:
            navigation.updateGPSMeas(fix[gps[row], :3], fix[gps[row], 3:], now)
        navigation.finishPass(now)
        if row in recorded:
            states_seen.append(_state(navigation))
            health.append(navigation.health())
    return _track(truth, np.array(states_seen), health, navigation)


def _due(truth: Truth, readings: Readings, hz: int, sensor: str, used: bool) -> dict[int, int]:
    """IMU row to index of the reading that comes with it."""
    if not used:
        return {}
    begin, end = readings.silent.get(sensor, (np.inf, np.inf))
    times = truth.times(hz)
    speaks = (times < begin) | (times >= end)
    return {int(row): i for i, row in enumerate(truth.rows(hz)) if speaks[i]}


def _state(n: Navigation) -> Array:
    sigma = np.sqrt(np.maximum(n.covariance().diagonal(), 0.0))
    parts = [n.attitude, n.positionNed, n.velocityNed, n.gyroBias, n.magBias, sigma]
    return np.concatenate(parts).astype(np.float64)


def _track(truth: Truth, seen: Array, health: list[int], navigation: Navigation) -> Track:
    rows = truth.rows(RECORD_HZ)
    heading, tilt = attitude_errors_deg(seen[:, :4], truth.attitude[rows])
    return Track(
        time_s=truth.times(RECORD_HZ),
        tilt_deg=tilt,
        heading_deg=heading,
        position_m=seen[:, 4:7] - truth.position_m[rows],
        velocity_m_s=seen[:, 7:10] - truth.velocity_m_s[rows],
        gyro_bias_rad_s=seen[:, 10:13],
        mag_bias_ut=seen[:, 13:16],
        sigma=seen[:, 16:],
        health=np.array(health),
        navigation=navigation,
    )


def attitude_errors_deg(estimated: Array, true: Array) -> tuple[Array, Array]:
    """Heading, signed, and tilt: the turn in NED about the vertical, and what is left of it."""
    w, x, y, z = multiply(estimated, conjugate(true)).T
    heading = 2.0 * np.arctan2(z, w)
    heading = (heading + np.pi) % (2.0 * np.pi) - np.pi
    tilt = 2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
    return np.degrees(heading), np.degrees(tilt)


def rms(values: Array) -> float:
    """Of the lengths of the rows."""
    return float(np.sqrt(np.mean(np.sum(values.reshape(len(values), -1) ** 2, axis=1))))


def _single(values: Array) -> NDArray[np.float32]:
    return np.ascontiguousarray(values, dtype=np.float32)
