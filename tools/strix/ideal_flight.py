"""Flights simulated to the flight filter's own model, for strix/consistency.py.

Truth is integrated in double by the discrete equations of DESIGN.md, 4, so the step is no source of
error; noise is white and exactly as configured, the first errors are drawn from P0. Whatever error
the filter makes beyond its own claim is then its own: linearisation, rounding, or a mistake.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from strix import _core
from strix.plant.earth import MAGNETIC_FIELD_NED_UT
from strix.score import conjugate, multiply

Array = NDArray[np.float64]

STEP_US = 1000
STEP_S = 1e-6 * STEP_US
# Samples from one measurement to the next: the rates of DESIGN.md, 3.
MAG_EVERY, ALT_EVERY, GPS_EVERY = 10, 20, 100
SECOND = 1000  # samples

RATE_RMS_RAD_S = 1.5  # each axis
FORCE_RMS_M_S2 = 2.0  # each axis, of the acceleration
WAVES = 4  # sinusoids an axis


class Kind(Enum):
    """What is flown; always in all attitudes and at several rad/s."""

    MANOEUVRING = "manoeuvring"  # at several m/s^2, with the process noise of a shaking aircraft
    QUIET = "quiet"  # the same, with no more process noise than the sensors'
    TURNING = "turning"  # as manoeuvring, but at constant velocity, and with the tilt update


def configuration(kind: Kind) -> _core.NavigationConfig:
    """Noise and first errors, both of the filter and of the simulated flights.

    Sensors as in DESIGN.md, 5. White noise of sigma in a bandwidth B has the density
    sigma / sqrt(2 B): 0.028 m/s^2 and 0.0031 rad/s in 100 Hz. 2 Pa are 0.17 m. First errors and
    walks as after a start-up calibration, none zero: a state that is known exactly has no NEES.
    The gates are open: they would refuse 1 % of good measurements, and the rest look too good.
    """
    quiet = kind is Kind.QUIET
    config = _core.NavigationConfig()
    config.accelNoise = 0.028 / math.sqrt(200.0) if quiet else 0.05
    config.gyroNoise = 0.0031 / math.sqrt(200.0) if quiet else 0.004
    config.accelBiasWalk = 1e-3
    config.gyroBiasWalk = 1e-4
    config.magBiasWalk = 1e-2
    config.tilt = _core.MeasurementNoise(0.05, 0.0)
    config.tiltGate = math.inf
    config.mag = _core.MeasurementNoise(0.3, 0.0)
    config.magFusion = _core.MagFusion.ThreeAxis
    config.alt = _core.MeasurementNoise(0.17, 0.0)
    config.gpsPositionSigma = 3.0
    config.gpsVelocitySigma = 0.3
    config.nisGate = math.inf
    config.positionSigma0 = 0.5
    config.velocitySigma0 = 0.1
    config.tiltSigma0 = 0.03
    config.headingSigma0 = 0.1
    config.accelBiasSigma0 = 0.1
    config.gyroBiasSigma0 = 0.003
    config.magBiasSigma0 = 1.0
    return config


class Waves:
    """Three independent sums of sinusoids of 0.05 to 1 Hz; their integrals begin with zero."""

    def __init__(self, rng: Generator, rms: float) -> None:
        self.rate = 2.0 * np.pi * rng.uniform(0.05, 1.0, (WAVES, 3))
        self.phase = rng.choice([-0.5, 0.5], (WAVES, 3)) * np.pi
        self.amplitude = rms * np.sqrt(2.0 / WAVES)

    def at(self, time_s: Array) -> Array:
        """A row a time."""
        return self._sum(time_s, self.amplitude, 0.0)

    def integral(self, time_s: Array) -> Array:
        """From zero to each time."""
        return self._sum(time_s, self.amplitude / self.rate, -0.5 * np.pi)

    def _sum(self, time_s: Array, amplitude: Array | float, lag: float) -> Array:
        angle = time_s[:, None, None] * self.rate + self.phase + lag
        return np.asarray((amplitude * np.sin(angle)).sum(axis=1))


@dataclass(frozen=True)
class Readings:
    """What the sensors said, and the truth beside it, as _core.FilterRun takes them."""

    accel: NDArray[np.float32]
    gyro: NDArray[np.float32]
    tilt: NDArray[np.float32]
    mag: NDArray[np.float32]
    alt: NDArray[np.float32]
    gps: NDArray[np.float32]
    truth: Array


class Flight:
    """One simulated flight; it goes on as long as it is asked to."""

    def __init__(
        self, states: int, kind: Kind, rng: Generator, config: _core.NavigationConfig | None = None
    ) -> None:
        self.config = config = config or configuration(kind)
        self.states, self.kind, self.rng = states, kind, rng
        self.turns = Waves(rng, RATE_RMS_RAD_S)
        self.pushes = Waves(rng, 0.0 if kind is Kind.TURNING else FORCE_RMS_M_S2)
        self.estimate = _unit(rng.normal(size=(1, 4)))  # what the filter begins with
        self.attitude = _unit(multiply(self.estimate, self._first_error()))
        self.position = rng.normal(0.0, config.positionSigma0, 3)
        self.drift = rng.normal(0.0, config.velocitySigma0, 3)  # the pushes begin with no velocity
        biases = states == 18
        self.walks = biases * np.repeat(
            [config.accelBiasWalk, config.gyroBiasWalk, config.magBiasWalk], 3
        )
        first = [config.accelBiasSigma0, config.gyroBiasSigma0, config.magBiasSigma0]
        self.biases = biases * rng.normal(0.0, np.repeat(first, 3))
        self.samples = 0

    def _first_error(self) -> Array:
        """[1, alpha/2] with alpha from P0: the heading's share is about the vertical."""
        down = rotated(conjugate(self.estimate), np.array([[0.0, 0.0, 1.0]]))[0]
        alpha = self.rng.normal(0.0, self.config.tiltSigma0, 3)
        alpha += (self.rng.normal(0.0, self.config.headingSigma0) - alpha @ down) * down
        return np.array([[1.0, *(0.5 * alpha)]])

    def fly(self, count: int) -> Readings:
        """The next `count` samples."""
        config, rng = self.config, self.rng
        time_s: Array = STEP_S * (self.samples + np.arange(count + 1, dtype=np.float64))
        self.samples += count
        velocity = self.pushes.integral(time_s) + self.drift
        rate = self.turns.at(time_s[1:])
        attitude = cumulative_product(np.vstack([self.attitude, exponential(STEP_S * rate)]))
        position = self.position + _summed(0.5 * STEP_S * (velocity[1:] + velocity[:-1]))
        biases = self.biases + _summed(rng.normal(size=(count, 9)) * self.walks * np.sqrt(STEP_S))
        acceleration = np.diff(velocity, axis=0) / STEP_S - [0.0, 0.0, config.gravity]
        # Over a step the specific force is turned by the attitude at its beginning.
        force = rotated(conjugate(attitude[:-1]), acceleration)
        self.attitude, self.position, self.biases = _unit(attitude[-1:]), position[-1], biases[-1]

        attitude, velocity = attitude[1:], velocity[1:]

        def noisy(values: Array, sigma: float | Array) -> NDArray[np.float32]:
            return (values + rng.normal(0.0, sigma, values.shape)).astype(np.float32)

        def every(step: int, values: Array) -> Array:
            return values[step - 1 :: step]

        vertical = np.array([[0.0, 0.0, -config.gravity]])
        field = np.array([MAGNETIC_FIELD_NED_UT])
        in_body = conjugate(attitude)
        seen = every(MAG_EVERY, in_body)
        fix = every(GPS_EVERY, np.hstack([position[:, :2], velocity[:, :2]]))
        fix_sigma = np.repeat([config.gpsPositionSigma, config.gpsVelocitySigma], 2)
        return Readings(
            accel=noisy(force + biases[:, 0:3], config.accelNoise / np.sqrt(STEP_S)),
            gyro=noisy(rate + biases[:, 3:6], config.gyroNoise / np.sqrt(STEP_S)),
            tilt=noisy(rotated(in_body, vertical) + biases[:, 0:3], config.tilt.sigma)
            if self.kind is Kind.TURNING
            else np.empty((0, 3), np.float32),
            mag=noisy(rotated(seen, field) + every(MAG_EVERY, biases[:, 6:9]), config.mag.sigma),
            alt=noisy(-every(ALT_EVERY, position[:, 2]), config.alt.sigma),
            gps=noisy(fix, fix_sigma),
            truth=every(SECOND, np.hstack([position, velocity, attitude, biases])),
        )


def exponential(vectors: Array) -> Array:
    """Rotation vectors in rad to quaternions, a row each."""
    angle = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.hstack([np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * vectors])


def cumulative_product(q: Array) -> Array:
    """Row k is q_0 (x) q_1 (x) ... (x) q_k, found by doubling the number of factors."""
    q = q.copy()
    factors = 1
    while factors < len(q):
        q[factors:] = multiply(q[:-factors], q[factors:])
        factors *= 2
    return q


def rotated(q: Array, vectors: Array) -> Array:
    """The vectors q v q*, row by row."""
    w, axis = q[:, :1], q[:, 1:]
    twice = 2.0 * np.cross(axis, vectors)
    return np.asarray(vectors + w * twice + np.cross(axis, twice))


def _summed(steps: Array) -> Array:
    return np.asarray(np.cumsum(steps, axis=0))


def _unit(q: Array) -> Array:
    return np.asarray(q / np.linalg.norm(q))
