"""Logs of a Quad5in that shakes in a known way, for the tests of `strix log spectrum`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from ulog_writer import ULogWriter

Array = NDArray[np.float64]

RATE_HZ = 1125.0
NOISE = 0.003  # rad/s, white: 9e-6 / 562 Hz a Hz
LAG_S = 0.04  # Quad5in's motors


def hover(time_s: Array) -> Array:
    """rev/s: a flight that climbs and sinks, 150 to 200."""
    return 175.0 + 25.0 * np.sin(0.7 * time_s)


def wave(speed: Callable[[Array], Array], order: float, amplitude: float, time_s: Array) -> Array:
    """At `order` times the motors' turns, sampled as a sensor without any low-pass does."""
    fine_s = np.arange(0.0, time_s[-1] + 1e-3, 1e-3)
    turns = np.cumsum(speed(fine_s)) * 1e-3
    return amplitude * np.sin(2.0 * np.pi * order * np.interp(time_s, fine_s, turns))


def write(
    path: Path,
    signal: Callable[[Array], Array],
    speed: Callable[[Array], Array] | None = None,
    *,
    rate_hz: float = RATE_HZ,
    seconds: float = 20.0,
    keep: Callable[[int], NDArray[np.bool_]] = lambda n: np.ones(n, dtype=bool),
    jitter_us: float = 0.0,
) -> Path:
    """A log of Quad5in with `signal` on x, a third of it on y, nothing but noise on z."""
    rng = np.random.default_rng(7)
    even_s = 1.0 + np.arange(0.0, seconds, 1.0 / rate_hz)
    time_s = even_s + 1e-6 * jitter_us * rng.uniform(-1.0, 1.0, len(even_s))
    gyro = NOISE * rng.standard_normal((len(time_s), 3))
    x = signal(time_s)
    gyro += np.stack([x, x / 3.0, 0.0 * x], axis=1)
    gyro = np.clip(gyro, -np.radians(2000.0), np.radians(2000.0))
    kept = keep(len(time_s))
    log = ULogWriter()
    log.info("vehicle", "Quad5in")
    fields = {
        "timestamp_sample": np.rint(1e6 * time_s[kept]),
        "gyro_rad": gyro[kept],
        "accelerometer_m_s2": gyro[kept] * 100.0 - [0.0, 0.0, 9.81],
    }
    log.topic("sensor_combined", time_s[kept] + 5e-4, fields)
    if speed is not None:
        control_s = np.arange(0.5, 1.5 + seconds, 0.002)
        # Motors::command: us = 1195 + n^2 / 160000 x 755; the command is ahead of the motor.
        commanded = speed(control_s) + LAG_S * np.gradient(speed(control_s), control_s)
        pulses = 1195.0 + commanded**2 / 160_000.0 * 755.0
        log.topic("actuator_outputs", control_s, {"output": np.tile(pulses[:, None], (1, 4))})
    return log.write(path)
