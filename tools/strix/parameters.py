"""The aircraft's parameters, and docs/parameters.md, made from their table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from strix import _core

MADE_BY = "<!-- Made by `strix diagrams --out docs`: do not edit. -->"
CHANGED = {
    "air": "at any time",
    "ground": "with the motors off",
    "start": "with the motors off; acts after the next start",
}


@dataclass(frozen=True)
class Parameter:
    """One row of lib/FlightSoftware/Parameters.def."""

    name: str
    default: float
    lowest: float
    highest: float
    unit: str  # "1": none, whole numbers only
    whole: bool
    lock: str  # a key of CHANGED
    help: str


def parameters() -> list[Parameter]:
    """The table that flies."""
    return [Parameter(**row) for row in _core.parameters()]


def plain(value: float) -> str:
    """As a person writes it; of a float32, so that 0.1 is 0.1."""
    return f"{value:.7g}"


def parameter_page(table: Sequence[Parameter]) -> str:
    rows = [
        f"| `{p.name}` | {plain(p.default)} | {plain(p.lowest)} to {plain(p.highest)} "
        f"| {'' if p.whole else p.unit} | {p.lock} | {p.help} |"
        for p in table
    ]
    return "\n".join(
        [
            MADE_BY,
            "# Parameters",
            "",
            "What can be changed without compiling: on the console (`set NAME VALUE`, "
            "[console.md](console.md)), by telemetry, and for one simulated flight "
            "(`strix fly --param NAME=VALUE`). The table is "
            "`lib/FlightSoftware/Parameters.def`; parameters without a unit are whole numbers.",
            "",
            "A value outside its range is refused, and so is a change at the wrong time:",
            "",
            "| changed | when |",
            "| --- | --- |",
            *(f"| {lock} | {when} |" for lock, when in CHANGED.items()),
            "",
            "A change lasts until the power goes. `save` keeps all of them: in one of two slots of "
            "the Teensy's EEPROM area, by name, with a CRC-32, and read back before it says `ok`. "
            "The slot with the set before stays as it is, and is what a start finds when the save "
            "was cut off. A start that finds a slot torn, or a value that the table does not "
            "allow, says so and is not armed until the parameters were looked at and saved again. "
            "Other firmware finds the values that it knows by their names.",
            "",
            "| name | default | range | unit | changed | what it is |",
            "| --- | --- | --- | --- | --- | --- |",
            *rows,
            "",
        ]
    )
