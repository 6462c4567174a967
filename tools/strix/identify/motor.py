"""Time constant of the motors, from a log of ESCs that answer or from a table of a stand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from strix.calibrate.outcome import Incomplete
from strix.errors import BadInput
from strix.flightlog import Array, read_flight_log, refuse_backwards
from strix.identify.lag import HIGH, LOW, MotorLag, Record, fit_lag
from strix.identify.tables import read_columns

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class MotorResult:
    where: str
    motors: tuple[MotorLag, ...]
    silent: tuple[str, ...]  # motors that tell nothing, and why
    window_s: float

    @property
    def mean_s(self) -> float:
        return float(np.mean([lag.tau_s for lag in self.motors]))

    @property
    def sigma_s(self) -> float:
        """Of the mean: from the motors' own sigmas, or from their scatter when that is larger."""
        own = np.array([lag.sigma_s for lag in self.motors])
        count = len(own)
        stated = float(np.sqrt((own**2).sum())) / count
        if count < 2:
            return stated
        return max(stated, float(np.std([lag.tau_s for lag in self.motors], ddof=1) / count**0.5))

    def sentences(self) -> list[str]:
        kind = (
            f"each speed the mean of {1e3 * self.window_s:.0f} ms"
            if self.window_s > 0.0
            else "each speed of an instant"
        )
        lines = [
            f"first-order lag, least squares on {LOW:.0%} to {HIGH:.0%} of each step, {kind}",
        ]
        for lag in self.motors:
            behind = (
                "" if lag.dead_time_s is None else f", dead time {1e3 * lag.dead_time_s:.1f} ms"
            )
            lines.append(
                f"  M{lag.motor}  {1e3 * lag.tau_s:6.1f} +- {1e3 * lag.sigma_s:.1f} ms{behind}, "
                f"{lag.steps} steps, {lag.rising} readings in the range, "
                f"residual {lag.residual:.2g} {lag.speed_unit}"
                + ("" if lag.of_curve is None else f", {lag.of_curve:.1%} of the command curve")
            )
        lines += [f"  {reason}" for reason in self.silent]
        lines.append(f"mean {1e3 * self.mean_s:.1f} +- {1e3 * self.sigma_s:.1f} ms")
        if any(lag.dead_time_s is None for lag in self.motors):
            lines.append("readings are too sparse to tell a dead time apart: it is part of these")
        lines += ["for include/vehicles/NAME.h, Vehicle::motorTimeConstant:", *self.header_lines()]
        return lines

    def header_lines(self) -> list[str]:
        source = f"strix identify motor {self.where}"
        return [f"    {self.mean_s:.3g}F,  // s, +- {self.sigma_s:.2g}, {source}"]

    def to_dict(self) -> dict[str, Any]:
        return {
            "source": self.where,
            "window_s": self.window_s,
            "motor_time_constant_s": self.mean_s,
            "sigma_s": self.sigma_s,
            "motors": [
                {
                    "motor": lag.motor,
                    "time_constant_s": lag.tau_s,
                    "sigma_s": lag.sigma_s,
                    "dead_time_s": lag.dead_time_s,
                    "steps": lag.steps,
                    "readings": lag.rising,
                    "residual": lag.residual,
                    "of_curve": lag.of_curve,
                }
                for lag in self.motors
            ],
            "not_told": list(self.silent),
        }

    def draw(self, figure: Figure) -> None:
        from strix.identify.figures import draw_motors

        draw_motors(figure, self)


def read_records(path: Path, window_s: float | None) -> list[Record]:
    """Of a flight log (.ulg) or a table. `window_s` None: what the source usually has."""
    if path.suffix.lower() == ".ulg":
        return _records_of_log(path, window_s)
    columns = read_columns(path, ("time_s", "command", "speed"), ("motor",))
    motors = columns.get("motor", np.ones(len(columns["time_s"])))
    records = []
    for motor in np.unique(motors):
        chosen = motors == motor
        time_s, command, speed = (columns[name][chosen] for name in ("time_s", "command", "speed"))
        refuse_backwards(str(path), "column time_s", time_s)
        records.append(
            Record(
                str(path), int(motor), time_s, command, time_s, speed, window_s or 0.0, "(speed)"
            )
        )
    return records


def _records_of_log(path: Path, window_s: float | None) -> list[Record]:
    log = read_flight_log(path)
    status, outputs = log.topic("esc_status"), log.topic("actuator_outputs")
    sampled_s = status["timestamp_sample"] * 1e-6
    refuse_backwards(status.where, "sample time", sampled_s)
    if len(sampled_s) < 2:
        raise Incomplete(f"{status.where}: expected readings of the ESCs, found {len(sampled_s)}")
    period_s = float(np.median(np.diff(sampled_s)))
    return [
        Record(
            str(path),
            motor + 1,
            outputs.time_s,
            outputs["output"][:, motor],
            sampled_s,
            status["revolutions"][:, motor],
            period_s if window_s is None else window_s,
            "rev/s",
            _curve_speed(log.info.get("vehicle", ""), outputs["output"][:, motor]),
        )
        for motor in range(status["revolutions"].shape[1])
    ]


def _curve_speed(vehicle: str, command: Array) -> Array | None:
    """rev/s that a vehicle's command curve gives to commands; None for a vehicle we do not know."""
    from strix import _core

    if vehicle not in _core.vehicle_names():
        return None
    numbers = _core.vehicle(vehicle)
    c = numbers["command"]
    above = np.maximum(command - c["offset"], 0.0)
    # As Motors::speedOf: the root that also holds when either coefficient is zero.
    root = np.sqrt(c["linear"] ** 2 + 4.0 * c["quadratic"] * above)
    speed = np.where(above > 0.0, 2.0 * above / np.maximum(c["linear"] + root, 1e-12), 0.0)
    return np.asarray(speed / (2.0 * np.pi) if numbers["speed_unit"] == "rad/s" else speed)


def identify_motor(records: list[Record]) -> MotorResult:
    """Every motor that can be told; Incomplete when none can."""
    if not records:
        raise BadInput("expected at least one motor's record, found none")
    told: list[MotorLag] = []
    silent: list[str] = []
    for record in records:
        try:
            told.append(fit_lag(record))
        except Incomplete as reason:
            silent.append(str(reason))
    where = Path(records[0].where)
    if not told:
        raise Incomplete(f"{where}: " + "; ".join(silent))
    return MotorResult(where.name, tuple(told), tuple(silent), records[0].window_s)
