"""`strix diagrams`: the pages of docs/ that are made from the source: state machine, signals and
parameters.

The state machine comes from the compiled table. For the signals this file says what flows between
the functions of FlightSoftware::controlTick; that these are all the functions which it calls, and
in its order, is read from its source.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from strix.errors import BadInput
from strix.parameters import parameter_page, parameters
from strix.state_page import MADE_BY, state_page
from strix.state_table import rows

SOURCE = Path(__file__).resolve().parents[2] / "lib/FlightSoftware/FlightSoftware.h"


@dataclass(frozen=True)
class Node:
    """A box of the signal diagram: functions of one library that work on the same signal."""

    name: str
    does: str
    calls: tuple[str, ...]  # of controlTick; none: it lies outside


@dataclass(frozen=True)
class Signal:
    """An arrow: what one function's result is to another."""

    source: str
    target: str
    what: str


NODES = (
    Node("sensors", "readings since the last tick, in loop()", ()),
    Node("watchdog", "lets the processor go on", ("board_.feedWatchdog",)),
    Node(
        "estimate",
        "where the aircraft is; GPS's corrections given back slowly, at once on the ground",
        ("estimation_.estimate", "motors_.armed"),
    ),
    Node("blind", "the model's word instead, without an IMU", ("flyBlind",)),
    Node("power", "battery and ESCs", ("readPower",)),
    Node("radio", "a frame of the receiver", ("readRadio",)),
    Node("states", "at most one transition; arms, disarms", ("updateStateMachine",)),
    Node("pilot", "the sticks, and what helps them", ("guidance_.setPilot", "pilot_.input", "has")),
    Node("guidance", "where it should be", ("guidance_.update",)),
    Node(
        "gate",
        "whether the controller flies it",
        ("fsm_.getControlFlag", "guidance_.idles", "Wrench::none"),
    ),
    Node(
        "controller",
        "what it takes",
        ("controller_.setGrounded", "controller_.updateControl", "controller_.getControl"),
    ),
    Node(
        "allocation",
        "what each motor gives of it; one alone in a motor test",
        ("fsm_.state", "motors_.commandOne", "motors_.commandControl"),
    ),
    Node("escs", "four pulses", ("motors_.writeESC",)),
    Node("achieved", "what the motors make of it", ("motors_.achieved",)),
    Node("memory", "anti-windup, the motors' lag", ("controller_.setAchieved",)),
    Node("motors", "what motors do to sensors", ("estimation_.setMotors", "motorState")),
    Node(
        "log",
        "records, and the tick's hash",
        (
            "tick",
            "logger_.logGNC",
            "toRecords",
            "recorder_.logNavigation",
            "navigation",
            "recorder_.logControl",
            "recorder_.logPilot",
            "guidance_.effectiveMode",
            "recorder_.logFaults",
            "board_.countFaults",
            "sensors",
            "clipped",
            "invalid",
            "recorder_.watchSaving",
        ),
    ),
)
SIGNALS = (
    Signal("watchdog", "escs", "without it no pulses"),
    Signal("sensors", "estimate", "Navigation's filter; rates by the gyro filter"),
    Signal("estimate", "blind", "VehicleState"),
    Signal("blind", "states", "VehicleState"),
    Signal("blind", "controller", "VehicleState"),
    Signal("power", "allocation", "V"),
    Signal("power", "states", "V a cell"),
    Signal("radio", "states", "switches, mode, or that it is lost"),
    Signal("radio", "pilot", "sticks"),
    Signal("states", "guidance", "entered state"),
    Signal("states", "gate", "state"),
    Signal("states", "pilot", "GPS, altimeter lost"),
    Signal("pilot", "guidance", "PilotInput"),
    Signal("guidance", "gate", "idles"),
    Signal("guidance", "controller", "Reference"),
    Signal("gate", "controller", "grounded"),
    Signal("gate", "allocation", "no wrench, or the controller's"),
    Signal("controller", "allocation", "Wrench wanted: N, N m"),
    Signal("allocation", "escs", "command units"),
    Signal("allocation", "achieved", "squares of speeds"),
    Signal("achieved", "memory", "Wrench achieved"),
    Signal("memory", "controller", "next tick"),
    Signal("memory", "blind", "its lagged wrench, next tick"),
    Signal("achieved", "motors", "thrust, rev/s"),
    Signal("motors", "estimate", "stopped, disturbed, hover; the notch's centre"),
    Signal("controller", "log", "reference, error, wrench"),
    Signal("escs", "log", "commands"),
)


def write_diagrams(out: Path) -> list[Path]:
    """state-machine.md, signals.md and parameters.md in the folder `out`."""
    pages = {
        "state-machine.md": state_page(rows()),
        "signals.md": signal_page(SOURCE),
        "parameters.md": parameter_page(parameters()),
    }
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, text in pages.items():
            (out / name).write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadInput(
            f"--out {out}: expected a folder that can be written, found: {error.strerror}"
        ) from None
    return [out / name for name in pages]


def calls_of(source: Path, function: str) -> list[str]:
    """Every function that the body of `function` calls, once, in the order of the text."""
    try:
        text = source.read_text(encoding="utf-8")
    except OSError as error:
        raise BadInput(f"{source}: expected a readable file: {error.strerror}") from None
    found = re.search(rf"^  void {function}\(.*?^  }}$", text, re.MULTILINE | re.DOTALL)
    if found is None:
        raise BadInput(f"{source}: expected a function {function}, found none")
    body = re.sub(r"//.*", "", found.group(0)).partition("{")[2]
    names = re.findall(r"\b(\w+(?:(?:\.|::)\w+)*)\(", body)
    return list(dict.fromkeys(name for name in names if name not in ("if", "for", "while")))


def signal_page(source: Path) -> str:
    """BadInput when the diagram's functions are not those of the source."""
    called = calls_of(source, "controlTick")
    drawn = [call for node in NODES for call in node.calls]
    missing, extra = sorted(set(called) - set(drawn)), sorted(set(drawn) - set(called))
    if missing or extra:
        raise BadInput(
            f"{source}, controlTick: expected the calls that strix/diagrams.py draws, found "
            f"{', '.join(missing) or 'none'} besides, and not {', '.join(extra) or 'any other'}"
        )
    order = {call: i for i, call in enumerate(called, 1)}
    boxes = [
        f'  {node.name}["{"<br/>".join([*node.calls, f"<i>{node.does}</i>"])}"]'
        if node.calls
        else f'  {node.name}(["{node.does}"])'
        for node in NODES
    ]
    arrows = [f'  {s.source} -->|"{s.what}"| {s.target}' for s in SIGNALS]
    listed = [
        f"| {', '.join(str(order[call]) for call in node.calls)} | "
        f"{', '.join(f'`{call}`' for call in node.calls)} | {node.does} |"
        for node in sorted(NODES, key=lambda n: min((order[c] for c in n.calls), default=0))
        if node.calls
    ]
    return "\n".join(
        [
            MADE_BY,
            "# One control tick",
            "",
            "What flows between the functions that `FlightSoftware::controlTick` calls every 2 ms "
            "(`lib/FlightSoftware/FlightSoftware.h`). A test compares the functions with the "
            "source.",
            "",
            "```mermaid",
            "flowchart TB",
            *boxes,
            *arrows,
            "```",
            "",
            "| called as number | function | what it gives |",
            "| --- | --- | --- |",
            *listed,
            "",
        ]
    )
