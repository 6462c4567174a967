"""include/Calibration.h: read, one calibration's members renewed, all others kept, written."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from strix.errors import BadInput
from strix.flightlog import Array

HEADER = Path(__file__).resolve().parents[3] / "include" / "Calibration.h"
FIRST_LINE = "/// Written by `strix calibrate ... --write`: a part at a time; the others are kept."
NEUTRAL = "neutral"
MOST_SOURCE = 60  # characters of a log's name that are kept


@dataclass(frozen=True)
class Member:
    """An array of the struct."""

    name: str
    default: tuple[float, ...]
    unit: str  # and meaning
    made_by: str  # subcommand

    @property
    def size(self) -> int:
        return len(self.default)


_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_ZERO = (0.0, 0.0, 0.0)

MEMBERS = (
    Member("accelBias", _ZERO, "m/s^2, sensor axes", "accel"),
    Member("accelScale", _IDENTITY, "row by row, symmetric: cross-axis terms, no turn", "accel"),
    Member("hardIron", _ZERO, "uT, sensor axes", "mag"),
    Member("softIron", _IDENTITY, "row by row, symmetric", "mag"),
    Member("magPerThrottle", _ZERO, "uT at full throttle, sensor axes", "throttle"),
    Member(
        "levelRotation",
        _IDENTITY,
        "row by row; turns what the IMU calls body into the body",
        "level",
    ),
)


@dataclass(frozen=True)
class Calibration:
    """Values and where each comes from."""

    values: Mapping[str, Array]
    sources: Mapping[str, str]

    def matrix(self, name: str) -> Array:
        return self.values[name].reshape(3, 3)

    def renewed(self, members: Mapping[str, Array], source: str) -> Calibration:
        values = {
            name: np.asarray(value, dtype=np.float64).ravel() for name, value in members.items()
        }
        return Calibration(
            {**self.values, **values}, {**self.sources, **dict.fromkeys(values, source)}
        )


def neutral() -> Calibration:
    """Changes nothing."""
    return Calibration(
        {m.name: np.array(m.default) for m in MEMBERS},
        dict.fromkeys((m.name for m in MEMBERS), NEUTRAL),
    )


def source_of(command: str, log: Path) -> str:
    """The words beside a value: which command made it of which log. No date: the log has one."""
    name = "".join(c if c.isprintable() and c not in "\\*/" else "?" for c in log.resolve().name)
    return f"strix calibrate {command} {name[:MOST_SOURCE]}"


def text_of(calibration: Calibration) -> str:
    """The whole file."""
    lines = [
        FIRST_LINE,
        "///",
        "///     accelerometer  body = levelRotation * sensorToBody *",
        "///                           accelScale * (raw - accelBias)",
        "///     magnetometer   body = sensorToBody * softIron *",
        "///                           (raw - hardIron - magPerThrottle * throttle)",
        "///",
        "/// throttle: mean motor command between its limits, 0 to 1. docs/calibration.md.",
        "#pragma once",
        "",
        "namespace strix {",
        "",
        "/// Of one aircraft.",
        "struct AircraftCalibration {",
        "  // clang-format off",
    ]
    for member in MEMBERS:
        lines += member_lines(calibration, member)
    lines += [
        "  // clang-format on",
        "};",
        "",
        "constexpr AircraftCalibration kCalibration{};",
        "",
        "}  // namespace strix",
    ]
    return "\n".join(lines) + "\n"


def member_lines(calibration: Calibration, member: Member) -> list[str]:
    """As they stand in the struct."""
    values = [_number(value) for value in calibration.values[member.name]]
    rows = [values[i : i + 3] for i in range(0, member.size, 3)]
    text = (",\n" + 6 * " ").join(", ".join(row) for row in rows)
    return [
        f"  /// {member.unit}. From: {calibration.sources[member.name]}",
        *f"  float {member.name}[{member.size}] = {{\n      {text}}};".split("\n"),
    ]


def _number(value: float) -> str:
    """Shortest text that is the same float."""
    text = np.format_float_positional(np.float32(value), unique=True, trim="0")
    return f"{'0.0' if text == '-0.0' else text}F"


def read_header(path: Path) -> Calibration:
    """A file as `text_of` writes it; values may have been changed by hand."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not text"
        raise BadInput(f"{path}: expected include/Calibration.h, found: {reason}") from None
    values, sources = {}, {}
    for member in MEMBERS:
        found = re.search(
            rf"From: (.*)\n\s*float {member.name}\[{member.size}\] = \{{([^}}]*)\}};", text
        )
        if found is None:
            raise BadInput(
                f"{path}: expected 'float {member.name}[{member.size}] = {{...}};' below a line "
                "with 'From: ', found none"
            )
        try:
            numbers = np.array([float(one.strip().rstrip("fF")) for one in found[2].split(",")])
        except ValueError:
            numbers = np.array([])
        if len(numbers) != member.size or not np.isfinite(numbers).all():
            raise BadInput(
                f"{path}, {member.name}: expected {member.size} numbers, found {found[2].split()}"
            )
        values[member.name], sources[member.name] = numbers, found[1].strip()
    return Calibration(values, sources)


def write_members(path: Path, members: Mapping[str, Array], source: str) -> None:
    """Renews these members of the file, or begins a neutral one with them."""
    before = read_header(path) if path.exists() else neutral()
    text = text_of(before.renewed(members, source))
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadInput(f"{path}: expected a file to write, found: {error.strerror}") from None


def snippet(members: Mapping[str, Array], source: str) -> list[str]:
    """The lines that --write would put there."""
    fresh = neutral().renewed(members, source)
    return [
        line for member in MEMBERS if member.name in members for line in member_lines(fresh, member)
    ]
