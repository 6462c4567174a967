"""Missions: those of the flight code by name, or a text file.

A mission file has one word and its numbers a line; '#' starts a comment:

    takeoff HEIGHT_M HOLD_S
    leg NORTH_M EAST_M HEIGHT_M TURN_DEG HOLD_S

Legs are relative to the start; TURN is to the right of the heading at take-off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from strix import _core
from strix.errors import BadInput

Leg = tuple[float, float, float, float, float]  # north m, east m, height m, turn rad, hold s

_TAKEOFF = ("HEIGHT_M", "HOLD_S")
_LEG = ("NORTH_M", "EAST_M", "HEIGHT_M", "TURN_DEG", "HOLD_S")
_LONGEST_HOLD_S = 3600.0  # the flight code counts it in 32 bits of microseconds
MAX_LEGS = 16


@dataclass(frozen=True)
class Mission:
    """What the flight code is told to fly."""

    name: str
    takeoff_height_m: float
    takeoff_hold_s: float
    legs: tuple[Leg, ...]


def find_mission(name_or_file: str) -> Mission:
    """A mission by its name in the flight code, else read from a file."""
    built_in = {m["name"]: m for m in _core.missions()}
    if name_or_file in built_in:
        m = built_in[name_or_file]
        return Mission(m["name"], m["takeoff_height_m"], m["takeoff_hold_s"], tuple(m["legs"]))
    path = Path(name_or_file)
    if path.is_file():
        return read_mission(path)
    raise BadInput(
        f"--mission: expected a file or one of {', '.join(built_in)}, found '{name_or_file}'"
    )


def read_mission(path: Path) -> Mission:
    """A mission from its text file."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: cannot be read as text: {error}") from None
    takeoff: tuple[float, ...] | None = None
    legs: list[Leg] = []
    for row, line in enumerate(text.splitlines(), start=1):
        words = line.split("#")[0].split()
        if not words:
            continue
        place = f"{path}, line {row}"
        if words[0] == "takeoff":
            if takeoff is not None or legs:
                raise BadInput(f"{place}: expected one takeoff, before all legs")
            takeoff = _numbers(place, words, _TAKEOFF)
        elif words[0] == "leg":
            north, east, height, turn, hold = _numbers(place, words, _LEG)
            legs.append((north, east, height, math.radians(turn), hold))
        else:
            raise BadInput(f"{place}: expected 'takeoff' or 'leg', found '{words[0]}'")
    if takeoff is None:
        raise BadInput(f"{path}: expected a line 'takeoff {' '.join(_TAKEOFF)}', found none")
    if len(legs) > MAX_LEGS:
        raise BadInput(f"{path}: expected at most {MAX_LEGS} legs, found {len(legs)}")
    return Mission(path.stem, takeoff[0], takeoff[1], tuple(legs))


def _numbers(place: str, words: list[str], names: tuple[str, ...]) -> tuple[float, ...]:
    if len(words) != len(names) + 1:
        raise BadInput(
            f"{place}: expected '{words[0]} {' '.join(names)}', found {len(words) - 1} numbers"
        )
    numbers = []
    for name, word in zip(names, words[1:], strict=True):
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise BadInput(f"{place}, {name}: expected a number, found '{word}'")
        if name == "HOLD_S" and not 0.0 <= number <= _LONGEST_HOLD_S:
            raise BadInput(f"{place}, {name}: expected 0 to {_LONGEST_HOLD_S:g} s, found '{word}'")
        numbers.append(number)
    return tuple(numbers)
