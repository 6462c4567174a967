"""Missions: text files, those of missions/ by name, and those of the flight code.

What a mission file may say stands in lib/FlightSoftware/MissionText.h, which reads it here too.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from strix import _core
from strix.errors import BadInput

FOLDER = Path(__file__).resolve().parents[2] / "missions"


@dataclass(frozen=True)
class Item:
    """One item of a mission: a place to go to, or an attitude to fly."""

    kind: str  # leg, attitude
    north_m: float
    east_m: float
    height_m: float
    turn_rad: float  # right of the heading at take-off; attitude: at its start
    hold_s: float
    radius_m: float  # 0: as guidance is configured
    speed_m_s: float  # 0: as guidance is configured
    roll_rad: float
    pitch_rad: float


@dataclass(frozen=True)
class Mission:
    """What the flight code is told to fly: a text, and what that says."""

    name: str
    text: str
    takeoff_height_m: float
    takeoff_hold_s: float
    items: tuple[Item, ...]
    end: str  # land, home
    stand_angle_rad: float  # above 0: no flight but the attitude stand

    @property
    def legs(self) -> tuple[tuple[float, float, float, float, float], ...]:
        """North m, east m, height m, turn rad, hold s of each item."""
        return tuple((i.north_m, i.east_m, i.height_m, i.turn_rad, i.hold_s) for i in self.items)


def parse_mission(name: str, text: str, place: str) -> Mission:
    """A mission from its text; BadInput begins with `place`."""
    try:
        said: dict[str, Any] = _core.parse_mission(text)
    except ValueError as error:
        separator = ", " if str(error).startswith("line ") else ": "
        raise BadInput(f"{place}{separator}{error}") from None
    items = tuple(Item(**item) for item in said.pop("legs"))
    return Mission(name, text, items=items, **said)


def find_mission(name_or_file: str) -> Mission:
    """A mission by its name in the flight code or in missions/, else read from a file."""
    built_in = _core.mission_texts()
    if name_or_file in built_in:
        return parse_mission(name_or_file, built_in[name_or_file], name_or_file)
    examples = {path.stem: path for path in sorted(FOLDER.glob("*.txt"))}
    path = examples.get(name_or_file, Path(name_or_file))
    if path.is_file():
        return read_mission(path)
    names = ", ".join((*built_in, *examples))
    raise BadInput(f"--mission: expected a file or one of {names}, found '{name_or_file}'")


def read_mission(path: Path) -> Mission:
    """A mission from its text file."""
    try:
        text = path.read_bytes().decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: cannot be read as text: {error}") from None
    return parse_mission(path.stem, text, str(path))
