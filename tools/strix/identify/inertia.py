"""Mass, centre of mass and inertia: from a list of simple bodies, and from a bifilar pendulum.

Parts: each body's own tensor, turned into body axes, and moved by the parallel-axis theorem:

    c = sum m r / sum m,   J = sum [R J_own R^T + m (|s|^2 I - s s^T)],   s = r - c

Pendulum: hung by two parallel threads of length L at distance d, the axis of interest upright and
the centre of mass midway, a body that is turned a little swings back with period T and

    J = m g d^2 T^2 / (16 pi^2 L)

(M. R. Jardin and E. R. Mueller, "Optimized Measurements of UAV Mass Moment of Inertia with a
Bifilar Pendulum", AIAA 2007-6822.) Small angles: at 15 deg T is 0.4 % too long (theta^2 / 16).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from strix.calibrate.outcome import GRAVITY_M_S2, Incomplete
from strix.errors import BadInput
from strix.flightlog import Array
from strix.identify.tables import number_of, read_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Numbers of each shape's `size`, m. A cylinder's and a tube's axis is their own z.
SIZES: Mapping[str, tuple[str, ...]] = {
    "box": ("x", "y", "z"),
    "cylinder": ("diameter", "length"),
    "tube": ("outer diameter", "inner diameter", "length"),
    "sphere": ("diameter",),
    "point": (),
}
AXES = ("x", "y", "z")
LEAST_TIMINGS = 3  # of an axis, for a scatter
RULER_M = 0.0005  # one sigma of a distance measured with a ruler; ours: half its smallest division


@dataclass(frozen=True)
class Part:
    name: str
    shape: str
    size_m: tuple[float, ...]
    mass_kg: float
    position_m: Array  # FRD, of its centre
    to_body: Array  # rotation, its own axes to the body's

    def inertia_kg_m2(self) -> Array:
        """About its own centre, in body axes. Uniform density."""
        m, s = self.mass_kg, self.size_m
        if self.shape == "box":
            x, y, z = (value**2 for value in s)
            own = np.array([y + z, x + z, x + y]) * m / 12.0
        elif self.shape == "sphere":
            own = np.full(3, 0.4 * m * (s[0] / 2.0) ** 2)
        elif self.shape == "point":
            own = np.zeros(3)
        else:
            outer, inner, length = s if self.shape == "tube" else (s[0], 0.0, s[1])
            radii = (outer / 2.0) ** 2 + (inner / 2.0) ** 2
            across = m * (3.0 * radii + length**2) / 12.0
            own = np.array([across, across, 0.5 * m * radii])
        return np.asarray(self.to_body @ np.diag(own) @ self.to_body.T)


@dataclass(frozen=True)
class Body:
    """All parts together."""

    where: str
    parts: tuple[Part, ...]
    mass_kg: float
    centre_m: Array  # from the origin of the list, FRD
    inertia_kg_m2: Array  # (3, 3), about the centre of mass

    def share_off_axis(self) -> float:
        """Largest product of inertia, over the smallest moment: the flight code has none."""
        products = np.abs(self.inertia_kg_m2 - np.diag(np.diag(self.inertia_kg_m2)))
        moments = np.diag(self.inertia_kg_m2)
        return float(products.max() / moments.min()) if moments.min() > 0.0 else 0.0


@dataclass(frozen=True)
class Swing:
    """One axis on the pendulum."""

    axis: int
    timings: int
    period_s: float
    inertia_kg_m2: float
    sigma_kg_m2: float  # of the mean: scatter of the timings, and the ruler


@dataclass(frozen=True)
class InertiaResult:
    body: Body | None
    swings: tuple[Swing, ...]

    def sentences(self) -> list[str]:
        lines = []
        if self.body is not None:
            body = self.body
            lines += [
                f"{len(body.parts)} parts, {body.mass_kg:.4f} kg",
                "centre of mass  "
                + " ".join(f"{1e3 * value:+.2f}" for value in body.centre_m)
                + " mm from the list's origin (forward, right, down)",
                "inertia about it, kg m^2",
                *("  " + " ".join(f"{v:+.6f}" for v in row) for row in body.inertia_kg_m2),
                f"largest product of inertia: {body.share_off_axis():.1%} of the smallest moment, "
                "which the flight code takes for none",
            ]
        for swing in self.swings:
            lines.append(
                f"pendulum, J{2 * AXES[swing.axis]}  {swing.inertia_kg_m2:.6f} +- "
                f"{swing.sigma_kg_m2:.6f} kg m^2, {swing.timings} timings, "
                f"T = {swing.period_s:.3f} s" + self._compared(swing)
            )
        return [*lines, "for include/vehicles/NAME.h:", *self.header_lines()]

    def _compared(self, swing: Swing) -> str:
        if self.body is None:
            return ""
        listed = float(self.body.inertia_kg_m2[swing.axis, swing.axis])
        off = swing.inertia_kg_m2 - listed
        sigmas = abs(off) / swing.sigma_kg_m2 if swing.sigma_kg_m2 > 0.0 else np.inf
        return f"; {off / listed:+.1%} of the parts list, {sigmas:.1f} sigma"

    def moments(self) -> list[float | None]:
        """The pendulum's where there is one, otherwise the list's."""
        found: list[float | None] = [None, None, None]
        if self.body is not None:
            found = [float(value) for value in np.diag(self.body.inertia_kg_m2)]
        for swing in self.swings:
            found[swing.axis] = swing.inertia_kg_m2
        return found

    def header_lines(self) -> list[str]:
        lines = []
        if self.body is not None:
            lines.append(
                f"    {self.body.mass_kg:.4g}F,  // kg, strix identify inertia {self.body.where}"
            )
        moments = self.moments()
        values = [f"{value:.4g}F" for value in moments if value is not None]
        if len(values) == 3:
            swung = ", ".join(f"J{2 * AXES[s.axis]}" for s in self.swings)
            lines.append(
                f"    {{{', '.join(values)}}},  // kg m^2, "
                + (f"pendulum: {swung}" if swung else "parts list")
            )
        return lines

    def to_dict(self) -> dict[str, Any]:
        body = self.body
        return {
            "source": None if body is None else body.where,
            "mass_kg": None if body is None else body.mass_kg,
            "centre_m": None if body is None else body.centre_m.tolist(),
            "inertia_kg_m2": None if body is None else body.inertia_kg_m2.tolist(),
            "pendulum": [
                {
                    "axis": AXES[swing.axis],
                    "timings": swing.timings,
                    "period_s": swing.period_s,
                    "inertia_kg_m2": swing.inertia_kg_m2,
                    "sigma_kg_m2": swing.sigma_kg_m2,
                }
                for swing in self.swings
            ],
            "moments_kg_m2": self.moments(),
        }

    def draw(self, figure: Figure) -> None:
        from strix.identify.figures import draw_inertia

        draw_inertia(figure, self)


def read_parts(path: Path) -> list[Part]:
    """A CSV (name, shape, size, mass, position, perhaps orientation: several numbers in a cell
    are parted by spaces) or TOML ([[part]] with the same keys) list.
    """
    if path.suffix.lower() != ".toml":
        rows = read_rows(path, ("name", "shape", "size", "mass", "position"))
        return [_part(f"{path}: line {number}", row) for number, row in rows]
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: expected a readable parts list, found: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise BadInput(f"{path}: expected TOML, found: {error}") from None
    parts = content.get("part")
    if not isinstance(parts, list) or not parts or not all(isinstance(p, dict) for p in parts):
        raise BadInput(f"{path}: expected tables [[part]], found {', '.join(content) or 'none'}")
    return [_part(f"{path}: part {i}", part) for i, part in enumerate(parts, start=1)]


def _part(where: str, row: Mapping[str, Any]) -> Part:
    known = ("name", "shape", "size", "mass", "position", "orientation")
    for key in row:
        if key not in known:
            raise BadInput(f"{where}: expected {', '.join(known)}, found {key!r}")
    name, shape = str(row.get("name", "")), str(row.get("shape", ""))
    if shape not in SIZES:
        raise BadInput(f"{where}, shape: expected one of {', '.join(SIZES)}, found {shape!r}")
    size = _numbers(where, "size", row.get("size", ""), SIZES[shape])
    if any(value < 0.0 for value in size) or (size and max(size) == 0.0):
        raise BadInput(f"{where}, size: expected lengths in m, found {size}")
    if shape == "tube" and size[1] > size[0]:
        raise BadInput(
            f"{where}, size: expected the inner diameter below the outer, found {size[1]:g} m "
            f"and {size[0]:g} m"
        )
    (mass_kg,) = _numbers(where, "mass", row.get("mass", ""), ("kg",))
    if mass_kg <= 0.0:
        raise BadInput(f"{where}, mass: expected more than 0 kg, found {mass_kg:g}")
    position = _numbers(where, "position", row.get("position", ""), ("forward", "right", "down"))
    angles = _numbers(
        where, "orientation", row.get("orientation") or "0 0 0", ("roll", "pitch", "yaw")
    )
    return Part(name, shape, size, mass_kg, np.array(position), _to_body(*np.radians(angles)))


def _numbers(where: str, field: str, value: Any, names: Sequence[str]) -> tuple[float, ...]:
    """So many finite numbers, of a TOML array or a cell."""
    items = value if isinstance(value, list) else str(value).split()
    try:
        found = tuple(float(item) for item in items)
    except (TypeError, ValueError):
        found = (np.nan,)
    if len(found) != len(names) or not np.isfinite(found).all():
        wanted = f"{len(names)} numbers ({', '.join(names)})" if names else "nothing"
        raise BadInput(f"{where}, {field}: expected {wanted}, found {value!r}")
    return found


def _to_body(roll: float, pitch: float, yaw: float) -> Array:
    """Own axes to body axes: yaw about down, then pitch, then roll, as an aircraft's attitude."""
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    X = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    Y = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    Z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(Z @ Y @ X)


def combine(parts: Sequence[Part], where: str = "") -> Body:
    """Mass, centre and inertia of all."""
    masses = np.array([part.mass_kg for part in parts])
    positions = np.array([part.position_m for part in parts])
    centre = masses @ positions / masses.sum()
    inertia = np.zeros((3, 3))
    for part in parts:
        s = part.position_m - centre
        inertia += part.inertia_kg_m2() + part.mass_kg * (s @ s * np.eye(3) - np.outer(s, s))
    return Body(where, tuple(parts), float(masses.sum()), centre, inertia)


def bifilar(mass_kg: float, distance_m: float, length_m: float, period_s: float) -> float:
    """J about the upright axis, kg m^2."""
    return mass_kg * GRAVITY_M_S2 * (distance_m * period_s) ** 2 / (16.0 * np.pi**2 * length_m)


def read_swings(path: Path, mass_kg: float, ruler_m: float = RULER_M) -> list[Swing]:
    """A table with axis, distance (m), length (m), swings (whole periods) and time (s), a row a
    timing; one or several axes.
    """
    names = ("distance", "length", "swings", "time")
    by_axis: dict[int, list[list[float]]] = {}
    for line, row in read_rows(path, ("axis", *names)):
        axis = row["axis"].lower()
        if axis not in AXES:
            raise BadInput(f"{path}: line {line}, column axis: expected x, y or z, found {axis!r}")
        values = [number_of(path, line, name, row[name]) for name in names]
        for name, value in zip(names, values, strict=True):
            if value <= 0.0:
                raise BadInput(
                    f"{path}: line {line}, column {name}: expected more than 0, found {value:g}"
                )
        by_axis.setdefault(AXES.index(axis), []).append(values)
    return [
        _swing(path, axis, np.array(rows), mass_kg, ruler_m)
        for axis, rows in sorted(by_axis.items())
    ]


def _swing(path: Path, axis: int, rows: Array, mass_kg: float, ruler_m: float) -> Swing:
    count = len(rows)
    if count < LEAST_TIMINGS:
        raise Incomplete(
            f"{path}: axis {AXES[axis]}: expected {LEAST_TIMINGS} timings, to know their scatter, "
            f"found {count}"
        )
    distance_m, length_m, swings, time_s = rows.T
    periods_s = time_s / swings
    found = np.array(
        [
            bifilar(mass_kg, d, length, period)
            for d, length, period in zip(distance_m, length_m, periods_s, strict=True)
        ]
    )
    mean = float(found.mean())
    scatter = float(found.std(ddof=1)) / count**0.5
    # The ruler errs alike in every row: d enters twice, L once.
    ruler = mean * float(np.hypot(2.0 * ruler_m / distance_m.mean(), ruler_m / length_m.mean()))
    return Swing(axis, count, float(periods_s.mean()), mean, float(np.hypot(scatter, ruler)))
