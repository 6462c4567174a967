"""A made-up bench for the calibration's tests: sensors with known errors on an aircraft that is put
down, turned and put down again. Written from the definitions; it shares nothing with the code.

    raw = inverse(A) R^T f_body + b + noise          R: sensor to body
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from ulog_writer import ULogWriter

from strix.calibrate.readings import Imu

Array = NDArray[np.float64]

G = 9.80665
RATE_HZ = 500.0
ACCEL_NOISE = 0.028  # one sigma of a sample: DESIGN.md
GYRO_NOISE = 0.0031
MAG_NOISE = 0.3
TURN_S = 1.0  # between two positions
UP = {
    "level": (0.0, 0.0, -1.0),
    "upside down": (0.0, 0.0, 1.0),
    "nose up": (1.0, 0.0, 0.0),
    "nose down": (-1.0, 0.0, 0.0),
    "on its left side": (0.0, 1.0, 0.0),
    "on its right side": (0.0, -1.0, 0.0),
}
EDGES = [(x, y, z) for x, y, z in np.ndindex(3, 3, 3) if abs(x - 1) + abs(y - 1) + abs(z - 1) == 2]


@dataclass(frozen=True)
class Errors:
    """Of one IMU. `scale` is A."""

    bias: Array = field(default_factory=lambda: np.array([0.25, -0.4, 0.3]))
    scale: Array = field(
        default_factory=lambda: np.array(
            [[1.012, 0.008, -0.005], [0.008, 0.991, 0.011], [-0.005, 0.011, 1.007]]
        )
    )
    gyro_bias: Array = field(default_factory=lambda: np.array([0.02, -0.03, 0.01]))
    mounting: Array = field(default_factory=lambda: np.eye(3))


def edges() -> list[Array]:
    """The twelve directions half way between two faces, as up in body axes."""
    return [np.array(edge, dtype=float) - 1.0 for edge in EDGES]


def bench_imu(
    ups: Sequence[Array],
    errors: Errors,
    seed: int = 1,
    still_s: float = 4.0,
    tremble: float = 1.0,
) -> Imu:
    """Readings while the aircraft rests with `ups` up, one after the other, and is turned between
    them. `tremble` is the noise, times the sensors' own.
    """
    random = np.random.default_rng(seed)
    force, rate = [], []
    for i, up in enumerate(ups):
        if i:
            turn = round(TURN_S * RATE_HZ)
            part = np.linspace(0.0, 1.0, turn)[:, None]
            # Lifted, shaken, put down: no straight way, never still.
            way = (1.0 - part) * unit(ups[i - 1]) + part * unit(up)
            shake = 4.0 * np.sin(2.0 * np.pi * 3.0 * part * TURN_S + np.arange(3))
            force.append(G * way + shake)
            rate.append(2.0 * np.sin(2.0 * np.pi * 2.0 * part * TURN_S + np.arange(3)))
        count = round(still_s * RATE_HZ)
        force.append(np.tile(G * unit(up), (count, 1)))
        rate.append(np.zeros((count, 3)))
    f_body, w_body = np.concatenate(force), np.concatenate(rate)
    sensed = f_body @ errors.mounting @ np.linalg.inv(errors.scale).T
    accel = sensed + errors.bias + tremble * ACCEL_NOISE * random.standard_normal(sensed.shape)
    gyro = w_body @ errors.mounting + errors.gyro_bias
    gyro = gyro + tremble * GYRO_NOISE * random.standard_normal(gyro.shape)
    time_s = 2.0 + np.arange(len(accel)) / RATE_HZ
    return Imu("bench", time_s, accel, gyro, np.full(len(accel), 30.0))


def unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


def random_rotation(random: np.random.Generator) -> Array:
    """Every rotation alike (QR of a normal matrix)."""
    Q, R = np.linalg.qr(random.standard_normal((3, 3)))
    Q = Q * np.sign(np.diag(R))
    return np.asarray(Q * np.sign(np.linalg.det(Q)))


def tilted(up: Array, degrees: float, random: np.random.Generator) -> Array:
    """Off by that much, whichever way."""
    across = np.cross(up, random.standard_normal(3))
    return np.asarray(unit(up) + np.tan(np.radians(degrees)) * unit(across))


def directions(count: int, random: np.random.Generator) -> Array:
    """Evenly over the sphere."""
    vectors = random.standard_normal((count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def write_imu(log: ULogWriter, imu: Imu) -> None:
    fields = {
        "timestamp_sample": np.rint(imu.time_s * 1e6),
        "accelerometer_m_s2": imu.accel_m_s2,
        "gyro_rad": imu.gyro_rad_s,
        "temperature": imu.temperature_degc,
    }
    log.topic("sensor_combined", imu.time_s, fields)


def write_mag(log: ULogWriter, time_s: Array, field_ut: Array) -> None:
    fields = {"timestamp_sample": np.rint(time_s * 1e6), "field_ut": field_ut}
    log.topic("sensor_mag", time_s, fields)


def imu_log(path: Path, imu: Imu) -> Path:
    log = ULogWriter()
    log.info("vehicle", "Quad5in")
    write_imu(log, imu)
    return log.write(path)
