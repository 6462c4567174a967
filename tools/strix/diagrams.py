"""`strix diagrams`: the pages docs/state-machine.md and docs/signals.md, made from the source.

The state machine comes from the compiled table. For the signals this file says what flows between
the functions of FlightSoftware::controlTick; that these are all the functions which it calls, and
in its order, is read from its source.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from strix import _core
from strix.errors import BadInput

SOURCE = Path(__file__).resolve().parents[2] / "lib/FlightSoftware/FlightSoftware.h"
MADE_BY = "<!-- Made by `strix diagrams --out docs`: do not edit. -->"


@dataclass(frozen=True)
class Row:
    """One row of the state machine's table."""

    from_states: tuple[str, ...]
    when: tuple[str, ...]  # all of these
    unless: tuple[str, ...]  # none of these
    to: str
    said: str

    @property
    def condition(self) -> str:
        return ", ".join([" and ".join(self.when), *(f"not {name}" for name in self.unless)])


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
    Node("pilot", "the pilot's switches", ()),
    Node("power", "battery and ESCs", ("readPower",)),
    Node("estimate", "where the aircraft is", ("navigation_.state",)),
    Node(
        "smooth",
        "GPS's corrections given back slowly; none on the ground",
        ("smoother_.advance", "motors_.armed", "smoother_.clear", "smoother_.apply"),
    ),
    Node("states", "at most one transition; arms, disarms", ("updateStateMachine",)),
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
    Node("allocation", "what each motor gives of it", ("motors_.commandControl",)),
    Node("escs", "four pulses", ("motors_.writeESC",)),
    Node("achieved", "what the motors make of it", ("motors_.achieved", "motors_.meanRevolutions")),
    Node("memory", "anti-windup, the motors' lag", ("controller_.setAchieved",)),
    Node(
        "motors",
        "what motors do to sensors",
        ("motorState", "navigation_.setMotors"),
    ),
    Node("notch", "its centre", ("gyroFilter_.active", "gyroFilter_.setMotorSpeed")),
    Node(
        "log",
        "records, and the tick's hash",
        (
            "tick",
            "toRecords",
            "logger_.logGNC",
            "logNavigation",
            "controlLog_.run",
            "toRecord",
            "logger_.log",
            "faultLog_.run",
            "logFaults",
        ),
    ),
)
SIGNALS = (
    Signal("sensors", "estimate", "Navigation's filter; rates by the gyro filter"),
    Signal("pilot", "states", "arm, start, kill"),
    Signal("estimate", "smooth", "VehicleState"),
    Signal("smooth", "states", "VehicleState"),
    Signal("smooth", "controller", "VehicleState"),
    Signal("power", "allocation", "V"),
    Signal("states", "guidance", "entered state"),
    Signal("states", "gate", "state"),
    Signal("guidance", "gate", "idles"),
    Signal("guidance", "controller", "Reference"),
    Signal("gate", "controller", "grounded"),
    Signal("gate", "allocation", "no wrench, or the controller's"),
    Signal("controller", "allocation", "Wrench wanted: N, N m"),
    Signal("allocation", "escs", "command units"),
    Signal("allocation", "achieved", "squares of speeds"),
    Signal("achieved", "memory", "Wrench achieved"),
    Signal("memory", "controller", "next tick"),
    Signal("achieved", "motors", "thrust"),
    Signal("motors", "estimate", "stopped, disturbed, hover"),
    Signal("achieved", "notch", "rev/s"),
    Signal("notch", "estimate", "rates"),
    Signal("controller", "log", "reference, error, wrench"),
    Signal("escs", "log", "commands"),
)


def write_diagrams(out: Path) -> list[Path]:
    """state-machine.md and signals.md in the folder `out`."""
    pages = {"state-machine.md": state_page(rows()), "signals.md": signal_page(SOURCE)}
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, text in pages.items():
            (out / name).write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadInput(
            f"--out {out}: expected a folder that can be written, found: {error.strerror}"
        ) from None
    return [out / name for name in pages]


def rows() -> list[Row]:
    """The table that flies."""
    return [
        Row(
            tuple(row["from_states"]),
            tuple(row["when"]),
            tuple(row["unless"]),
            row["to"],
            row["said"],
        )
        for row in _core.transitions()
    ]


def state_page(table: Sequence[Row]) -> str:
    states: list[dict[str, Any]] = _core.states()
    properties = [
        f"| {s['name']} | {'may turn' if s['motors'] else 'off'} | "
        f"{'on' if s['controller'] else 'off'} |"
        for s in states
    ]
    listed = [
        f"| {i} | {', '.join(row.from_states)} | {' and '.join(row.when)} | "
        f"{', '.join(row.unless) or '-'} | {row.to} | {row.said} |"
        for i, row in enumerate(table, 1)
    ]
    return "\n".join(
        [
            MADE_BY,
            "# The state machine",
            "",
            "One table, `kTransitions` in `lib/FiniteStateMachine/FiniteStateMachine.h`, read from "
            "top to bottom in every control tick; the first row that fits is taken. What the "
            "conditions mean stands in `Conditions.h` beside them.",
            "",
            "An arrow from the frame is one from every state in it. Rows that only refuse (arming) "
            "and stay are in the table alone.",
            "",
            "```mermaid",
            *state_diagram(table),
            "```",
            "",
            "| state | motors | controller |",
            "| --- | --- | --- |",
            *properties,
            "",
            "| row | from | when all of | unless any of | to | said |",
            "| --- | --- | --- | --- | --- | --- |",
            *listed,
            "",
        ]
    )


def state_diagram(table: Sequence[Row]) -> Iterator[str]:
    """Mermaid's stateDiagram-v2. The states in flight, which share many rows, are in a frame."""
    flight = min((frozenset(r.from_states) for r in table if len(r.from_states) > 2), key=len)
    moves = [row for row in table if row.from_states != (row.to,)]
    yield "stateDiagram-v2"
    yield f"  [*] --> {_core.states()[0]['name']}"
    yield '  state "in flight" as FLYING {'
    # An arrow drawn in a frame pulls its ends into it.
    for line in _arrows([r for r in moves if {*r.from_states, r.to} <= flight], flight):
        yield "  " + line
    yield "  }"
    yield from _arrows([r for r in moves if not {*r.from_states, r.to} <= flight], flight)


def _arrows(table: Iterable[Row], flight: frozenset[str]) -> Iterator[str]:
    """Rows between the same two ends share an arrow; rows of all states in flight their frame's."""
    found: dict[tuple[str, str], list[str]] = {}
    for row in table:
        sources = list(row.from_states)
        if flight <= set(sources):
            sources = ["FLYING", *(state for state in sources if state not in flight)]
        for source in sources:
            found.setdefault((source, row.to), []).append(row.condition)
    for (source, target), conditions in found.items():
        yield f"  {source} --> {target} : {'<br/>'.join(dict.fromkeys(conditions))}"


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
