"""What a spectrum needs of a log: samples at even times, and how fast the motors turned."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.signal
from scipy.interpolate import CubicSpline

from strix import _core
from strix.errors import BadInput
from strix.flightlog import Array, FlightLog, read_flight_log
from strix.recording import read_recording

# A time that is wrong by d turns a line at f into noise of 2 pi f d of its amplitude: at Nyquist
# and 1 % of the period that is 3 %, 30 dB below the line.
MOST_JITTER = 0.01  # of the period, RMS


@dataclass(frozen=True)
class Unit:
    name: str  # of the values
    full_scale: float  # as src/board sets the IMU up
    scale_name: str  # of full_scale
    factor: float  # from there to the values' unit


UNITS = {
    "gyro": Unit("rad/s", 2000.0, "deg/s", float(np.radians(1.0))),
    "accel": Unit("m/s^2", 30.0, "g", 9.80665),
}


@dataclass(frozen=True)
class Turns:
    """Of the motors, as their commands and their lag say; rev/s."""

    time_s: Array
    hz: Array  # (N, 4), 0: off
    control_hz: float
    time_constant_s: float
    idle_hz: float  # the least while armed

    def flying(self, mean_hz: Array) -> Array:
        """Idling on the ground does not count."""
        return np.asarray(mean_hz > 1.1 * self.idle_hz)


@dataclass(frozen=True)
class Samples:
    where: str
    time_s: Array  # of the measurement
    values: Array  # (N, 3)
    turns: Turns | None  # None: not known

    def cut(self, from_s: float | None, to_s: float | None) -> tuple[Samples, bool]:
        """The part asked for, or from where the motors pull to where they stop; and whether it
        is all.
        """
        if from_s is None and to_s is None and self.turns is not None:
            on_s = self.turns.time_s[self.turns.flying(self.turns.hz.mean(axis=1))]
            if on_s.size:
                from_s, to_s = float(on_s[0]), float(on_s[-1])
        begin_s = self.time_s[0] if from_s is None else from_s
        end_s = self.time_s[-1] if to_s is None else to_s
        inside = (self.time_s >= begin_s) & (self.time_s <= end_s)
        if np.count_nonzero(inside) < 2:
            raise BadInput(
                f"{self.where}: expected samples from {begin_s:.3f} to {end_s:.3f} s, "
                f"found those from {self.time_s[0]:.3f} to {self.time_s[-1]:.3f} s"
            )
        part = Samples(self.where, self.time_s[inside], self.values[inside], self.turns)
        return part, bool(inside.all())


@dataclass(frozen=True)
class Even:
    """Samples at one rate."""

    begin_s: float
    rate_hz: float
    values: Array
    jitter_us: float
    missing: int
    resampled: bool


def read_samples(path: Path, topic: str) -> Samples:
    """Of a flight log, or of the IMU of a recording's folder."""
    if topic not in UNITS:
        raise BadInput(f"--topic: expected {' or '.join(UNITS)}, found {topic!r}")
    if path.is_dir():
        imu = read_recording(path).imu
        first = 4 if topic == "gyro" else 1
        return _checked(f"{path}: imu", imu[:, 0], imu[:, first : first + 3], None)
    log = read_flight_log(path)
    combined = log.topic("sensor_combined")
    values = combined["gyro_rad" if topic == "gyro" else "accelerometer_m_s2"]
    return _checked(combined.where, combined["timestamp_sample"] * 1e-6, values, _read_turns(log))


def _checked(where: str, time_s: Array, values: Array, turns: Turns | None) -> Samples:
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        raise BadInput(
            f"{where}, record {row + 1}: expected finite numbers, found {values[row].tolist()}"
        )
    late = np.diff(time_s) <= 0.0
    if late.any():
        row = int(np.argmax(late))
        raise BadInput(
            f"{where}, record {row + 2}: expected a sample time after {time_s[row]:.6f} s "
            f"(that of the record before), found {time_s[row + 1]:.6f} s"
        )
    return Samples(where, time_s, values, turns)


def _read_turns(log: FlightLog) -> Turns | None:
    """None when the log has no commands, or of a vehicle whose curve nobody knows."""
    name = log.info.get("vehicle", "")
    if name not in _core.vehicle_names() or not log.has("actuator_outputs"):
        return None
    outputs = log.topic("actuator_outputs")
    if len(outputs.time_s) < 2:
        return None
    vehicle: dict[str, Any] = _core.vehicle(name)
    control_hz = (len(outputs.time_s) - 1) / float(outputs.time_s[-1] - outputs.time_s[0])
    turns = commanded_turns(vehicle, outputs["output"])
    gain = 1.0 / (1.0 + vehicle["motor_time_constant"] * control_hz)  # as in GyroFilter.h
    lagged = scipy.signal.lfilter([gain], [1.0, gain - 1.0], turns, axis=0)
    lagged[turns <= 0.0] = 0.0  # running down, nobody knows how fast
    return Turns(
        outputs.time_s,
        lagged,
        control_hz,
        vehicle["motor_time_constant"],
        vehicle["speed_flight_min"] / _per_rev(vehicle),
    )


def _per_rev(vehicle: dict[str, Any]) -> float:
    """The vehicle's unit of speed over rev/s."""
    return {"rev/s": 1.0, "rad/s": 2.0 * np.pi}[vehicle["speed_unit"]]


def commanded_turns(vehicle: dict[str, Any], commands: Array) -> Array:
    """rev/s of ESC commands: the inverse of the vehicle's curve, as Motors::speedOf."""
    curve = vehicle["command"]
    above = np.maximum(commands - curve["offset"], 0.0)
    root = np.sqrt(curve["linear"] ** 2 + 4.0 * curve["quadratic"] * above)
    speed = np.zeros_like(above)
    np.divide(2.0 * above, curve["linear"] + root, out=speed, where=above > 0.0)
    speed[commands <= vehicle["command_off"]] = 0.0
    return np.asarray(speed / _per_rev(vehicle))


def even_samples(part: Samples) -> Even:
    """At even times. Uneven ones are resampled; a gap of more than one sample is refused."""
    steps_s = np.diff(part.time_s)
    usual_s = float(np.median(steps_s))
    periods = np.maximum(np.rint(steps_s / usual_s), 1.0)
    gaps = np.flatnonzero(periods > 2.0)
    if gaps.size:
        edges = np.concatenate([[-1], gaps, [len(steps_s)]])
        longest = int(np.argmax(np.diff(edges)))
        begin_s, end_s = part.time_s[edges[longest] + 1], part.time_s[edges[longest + 1]]
        raise BadInput(
            f"{part.where}: expected a sample every {1e3 * usual_s:.3f} ms, found none for "
            f"{1e3 * steps_s[gaps[0]]:.1f} ms from {part.time_s[gaps[0]]:.3f} s and "
            f"{gaps.size - 1} more such gaps; the longest part without one: "
            f"--from {np.ceil(1e3 * begin_s) / 1e3:.3f} --to {np.floor(1e3 * end_s) / 1e3:.3f}"
        )
    period_s = float(steps_s.sum() / periods.sum())
    jitter_s = float(np.sqrt(np.mean((steps_s - periods * period_s) ** 2)))
    missing = int(np.count_nonzero(periods > 1.0))
    values = part.values
    resampled = bool(missing or jitter_s > MOST_JITTER * period_s)
    if resampled:
        count = int((part.time_s[-1] - part.time_s[0]) / period_s * (1.0 + 1e-12)) + 1
        at_s = part.time_s[0] + period_s * np.arange(count)
        values = CubicSpline(part.time_s, part.values)(np.minimum(at_s, part.time_s[-1]))
    return Even(float(part.time_s[0]), 1.0 / period_s, values, 1e6 * jitter_s, missing, resampled)
