"""Thrust, torque and command of a rotor against its speed, from a thrust stand.

    T = kT n^2,   Q = kM n^2,   command = offset + linear n + quadratic n^2

Blade-element theory at fixed pitch and no inflow: both go with n^2, through the origin (Leishman,
"Principles of Helicopter Aerodynamics", 2.2 to 2.6). What a scale shows at rest is an offset of
the scale and no thrust: it is fitted beside, told, and taken out when it is more than chance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

from strix.calibrate.outcome import Incomplete
from strix.errors import BadInput
from strix.flightlog import Array
from strix.identify.tables import read_columns

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST_ROWS = 5  # with a turning rotor: three of the curve and two to judge it by
LEAST_SPREAD = 2.0  # fastest over slowest: n^2 and n look alike over less
CHANCE = 0.01  # below it an offset, or a third term, is no accident
VOLTAGE_SPREAD = 0.03  # of the mean: the command curve moves with it


@dataclass(frozen=True)
class SquareLaw:
    """y = constant n^2 (+ offset)."""

    constant: float
    sigma: float
    offset: float  # 0 where it may be chance
    offset_seen: float  # fitted anyway
    offset_sigma: float
    residual: float  # RMS
    explained: float  # R^2

    @property
    def has_offset(self) -> bool:
        return self.offset != 0.0


@dataclass(frozen=True)
class Curve:
    """Vehicle.h's CommandCurve."""

    name: str
    offset: float
    linear: float
    quadratic: float
    residual: float  # RMS
    residuals: Mapping[str, float]  # of every form tried

    def at(self, n: Array) -> Array:
        return np.asarray(self.offset + (self.linear + self.quadratic * n) * n)


@dataclass(frozen=True)
class ThrustResult:
    where: str
    vehicle: Mapping[str, Any]
    rate: Array
    command: Array
    thrust_measured: Array
    torque_measured: Array | None
    thrust: SquareLaw
    torque: SquareLaw | None
    curve: Curve
    voltage: Array | None

    @property
    def unit(self) -> str:
        return str(self.vehicle["speed_unit"])

    def sentences(self) -> list[str]:
        unit, command = self.unit, self.vehicle["command_unit"]
        lines = [
            f"{len(self.rate)} rows, {self.rate.min():.4g} to {self.rate.max():.4g} {unit}",
            *_law("thrust", "N", unit, self.thrust, self.vehicle["thrust_constant"]),
        ]
        if self.torque is not None:
            lines += _law("torque", "N m", unit, self.torque, self.vehicle["torque_constant"])
        others = "; ".join(f"{n} {r:.3g}" for n, r in self.curve.residuals.items())
        lines.append(
            f"command = {self.curve.offset:.5g} + {self.curve.linear:.5g} n + "
            f"{self.curve.quadratic:.5g} n^2 {command}: {self.curve.name}"
        )
        lines.append(f"  RMS left over, {command}: {others}")
        if self.voltage is not None:
            mean, spread = float(self.voltage.mean()), float(np.ptp(self.voltage))
            lines.append(f"at {mean:.2f} V, {spread:.2f} V from lowest to highest")
            if spread > VOLTAGE_SPREAD * mean:
                lines.append(
                    "  the battery sagged on the way: the curve is bent by it; use a supply, or "
                    "rest between rows"
                )
        return [*lines, "for include/vehicles/NAME.h:", *self.header_lines()]

    def header_lines(self) -> list[str]:
        source = f"strix identify thrust {self.where}"
        unit = self.unit
        lines = [f"    {self.thrust.constant:.4g}F,  // N/({unit})^2, {source}"]
        if self.torque is not None:
            lines.append(f"    {self.torque.constant:.4g}F,  // N m/({unit})^2, {source}")
        c = self.curve
        values = ", ".join(_literal(value) for value in (c.offset, c.linear, c.quadratic))
        lines.append(f"    {{{values}}},  // {self.vehicle['command_unit']}, {source}")
        if self.voltage is not None:
            lines.append(f"    {self.voltage.mean():.4g}F,  // curveVoltage, V, {source}")
        return lines

    def to_dict(self) -> dict[str, Any]:
        voltage = None if self.voltage is None else float(self.voltage.mean())
        return {
            "source": self.where,
            "speed_unit": self.unit,
            "command_unit": self.vehicle["command_unit"],
            "rows": len(self.rate),
            "thrust": vars(self.thrust),
            "torque": None if self.torque is None else vars(self.torque),
            "command": {**vars(self.curve), "residuals": dict(self.curve.residuals)},
            "voltage_v": voltage,
        }

    def draw(self, figure: Figure) -> None:
        from strix.identify.figures import draw_thrust

        draw_thrust(figure, self)


def _literal(value: float) -> str:
    text = f"{value:.6g}"
    return text + ("F" if "." in text or "e" in text else ".0F")


def _law(name: str, unit: str, speed: str, law: SquareLaw, header: float) -> list[str]:
    verdict = (
        "no chance: the scale was not at zero; taken out"
        if law.has_offset
        else "may be chance: left out"
    )
    return [
        f"{name} = {law.constant:.4g} +- {law.sigma:.2g} n^2 {unit} (n in {speed}), "
        f"{law.constant / header - 1.0:+.1%} of the header's {header:.4g}",
        f"  RMS left over {law.residual:.2g} {unit}; offset {law.offset_seen:+.3g} +- "
        f"{law.offset_sigma:.2g} {unit}: {verdict}",
    ]


def identify_thrust(path: Path, vehicle: Mapping[str, Any]) -> ThrustResult:
    """From a table with command, rate, thrust and perhaps torque and voltage, a row a reading."""
    table = read_columns(path, ("command", "rate", "thrust"), ("torque", "voltage"))
    for name in ("rate", "thrust"):
        negative = np.flatnonzero(table[name] < 0.0)
        # A scale that reads a little below zero at rest is an offset, not a wrong sign.
        limit = 0.05 * float(np.abs(table[name]).max())
        if negative.size and float(-table[name].min()) > (limit if name == "thrust" else 0.0):
            raise BadInput(
                f"{path}: row {int(negative[0]) + 1}, column {name}: expected no negative value, "
                f"found {table[name][negative[0]]:g}"
            )
    turning = table["rate"] > 0.0
    rate = table["rate"][turning]
    if len(rate) < LEAST_ROWS or rate.max() < LEAST_SPREAD * rate.min():
        span = f", {rate.min():g} to {rate.max():g}" if len(rate) else ""
        raise Incomplete(
            f"{path}: expected {LEAST_ROWS} rows with a turning rotor, the fastest "
            f"{LEAST_SPREAD:g} times the slowest, found {len(rate)}{span}"
        )
    # Rows at rest count for the offset of the scale, not for the curve of the command.
    squares = table["rate"] ** 2
    torque = square_law(squares, table["torque"]) if "torque" in table else None
    command = table["command"][turning]
    return ThrustResult(
        path.name,
        vehicle,
        rate,
        command,
        table["thrust"][turning],
        table["torque"][turning] if "torque" in table else None,
        square_law(squares, table["thrust"]),
        torque,
        command_curve(rate, command),
        table["voltage"][turning] if "voltage" in table else None,
    )


def square_law(squares: Array, y: Array) -> SquareLaw:
    """Least squares with an offset; without it, unless it is more than chance."""
    beta, sigmas, residual = _linear(np.column_stack([squares, np.ones(len(squares))]), y)
    offset, offset_sigma = float(beta[1]), float(sigmas[1])
    freedom = len(y) - 2
    limit = float(stats.t.ppf(1.0 - CHANCE / 2.0, freedom)) * offset_sigma
    # Rounding alone leaves offsets of 1e-16: less than 1e-9 of the largest reading is none.
    keep = abs(offset) > max(limit, 1e-9 * float(np.abs(y).max()))
    constant, sigma = float(beta[0]), float(sigmas[0])
    if not keep:
        beta, sigmas, residual = _linear(squares[:, None], y)
        constant, sigma = float(beta[0]), float(sigmas[0])
    left = y - constant * squares - (offset if keep else 0.0)
    explained = 1.0 - float((left**2).sum() / ((y - y.mean()) ** 2).sum())
    return SquareLaw(
        constant, sigma, offset if keep else 0.0, offset, offset_sigma, residual, explained
    )


LINEAR, SQUARE, BOTH = "linear", "quadratic without a linear term", "linear and quadratic"
EXPONENTS = {LINEAR: (0, 1), SQUARE: (0, 2), BOTH: (0, 1, 2)}


def command_curve(n: Array, command: Array) -> Curve:
    """The form with fewest terms that leaves no more than chance above all three."""
    fits: dict[str, tuple[Array, float]] = {}
    for name, exponents in EXPONENTS.items():
        terms = n[:, None] ** np.array(exponents)
        beta = np.zeros(3)
        beta[list(exponents)] = _linear(terms, command)[0]
        left = command - (n[:, None] ** np.arange(3)) @ beta
        fits[name] = beta, float((left**2).sum())
    two = min((LINEAR, SQUARE), key=lambda name: fits[name][1])
    # F-test of the third term; rounding is not to be taken for a trend.
    freedom = len(n) - 3
    rounding = 1e-18 * float((command**2).sum())
    ratio = (fits[two][1] - fits[BOTH][1]) / ((fits[BOTH][1] + rounding) / freedom)
    chosen = BOTH if float(stats.f.sf(ratio, 1, freedom)) < CHANCE else two
    offset, linear, quadratic = (float(value) for value in fits[chosen][0])
    slope = linear + 2.0 * quadratic * np.array([n.min(), n.max()])
    if (slope <= 0.0).any():
        raise Incomplete(
            "expected a command that rises with the speed, found "
            f"{offset:.5g} + {linear:.5g} n + {quadratic:.5g} n^2, which falls: rows mixed up?"
        )
    residuals = {name: (rss / len(n)) ** 0.5 for name, (_, rss) in fits.items()}
    return Curve(chosen, offset, linear, quadratic, residuals[chosen], residuals)


def _linear(A: Array, y: Array) -> tuple[Array, Array, float]:
    """Least squares: solution, its sigmas, RMS residual. Columns scaled: n^2 is 1e5."""
    scale = np.abs(A).max(axis=0)
    scaled = A / scale
    beta = np.linalg.lstsq(scaled, y, rcond=None)[0]
    left = y - scaled @ beta
    variance = float((left**2).sum()) / max(len(y) - A.shape[1], 1)
    sigmas = np.sqrt(variance * np.diag(np.linalg.inv(scaled.T @ scaled)))
    return beta / scale, sigmas / scale, float(np.sqrt((left**2).mean()))
