"""docs/state-machine.md: the table that flies, as a diagram and as tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from strix.state_table import Row, State, first_row, hazards_of, meanings, states

MADE_BY = "<!-- Made by `strix diagrams --out docs`: do not edit. -->"
MANY = 5  # more conditions than this that forbid a row are told once


def state_page(table: Sequence[Row]) -> str:
    known = states()
    many = grounding(table)
    properties = [
        f"| {s.name} | {'may turn' if s.motors else 'off'} | {'on' if s.controller else 'off'} |"
        for s in known
    ]
    return "\n".join(
        [
            MADE_BY,
            "# The state machine",
            "",
            "One table, `kTransitions` in `lib/FiniteStateMachine/FiniteStateMachine.h`, read from "
            "top to bottom in every control tick; the first row that fits is taken. What is proven "
            "of it stands in [proof.md](proof.md).",
            "",
            "An arrow from a frame is one from every state in it. Arrows that say failsafe are "
            "those of hazards: which, says the table below. Rows that only refuse (arming) and "
            "stay are in the table alone.",
            "",
            "```mermaid",
            *state_diagram(table),
            "```",
            "",
            "| state | motors | controller |",
            "| --- | --- | --- |",
            *properties,
            "",
            "## What a hazard does",
            "",
            "When nothing else is wrong and nobody takes over. `-`: the flight goes on, the hazard "
            "is told and logged. After a landing that a hazard caused comes SAFE, not IDLE.",
            "",
            *hazard_matrix(table, known),
            "",
            "## Conditions",
            "",
            "| condition | meaning | rows that need it | rows that it forbids |",
            "| --- | --- | --- | --- |",
            *conditions(table),
            "",
            "## The table",
            "",
            "| row | from | when all of | unless any of | to | failsafe | said |",
            "| --- | --- | --- | --- | --- | --- | --- |",
            *(
                f"| {i} | {sources(row, known)} | {' and '.join(row.when) or '-'} | "
                f"{forbidden(row, many)} | {row.to} | {'yes' if row.failsafe else '-'} | "
                f"{row.said} |"
                for i, row in enumerate(table, 1)
            ),
            "",
            f"Any hazard: {', '.join(sorted(many, key=[*meanings()].index))}.",
            "",
        ]
    )


def sources(row: Row, known: Sequence[State]) -> str:
    """The states of a row, the many of them by what they have in common."""
    for name, group in (
        ("any with motors on", [s.name for s in known if s.motors]),
        ("any in flight", [s.name for s in known if s.flying]),
        ("any in flight but BLIND", [s.name for s in known if s.flying and s.name != "BLIND"]),
    ):
        if set(row.from_states) == set(group):
            return name
    return ", ".join(row.from_states)


def grounding(table: Sequence[Row]) -> frozenset[str]:
    """What all rows have in common that many conditions forbid: hazards that ground."""
    sets = [frozenset(row.unless) for row in table if len(row.unless) > MANY]
    return frozenset.intersection(*sets, frozenset(hazards_of(table))) if sets else frozenset()


def forbidden(row: Row, many: frozenset[str]) -> str:
    if len(row.unless) <= MANY:
        return ", ".join(row.unless) or "-"
    return ", ".join([*(name for name in row.unless if name not in many), "any hazard"])


def kept_by(table: Sequence[Row], state: str) -> frozenset[str]:
    """Without which a state ends by itself: the pilot's sticks, the positions that are sent."""
    return frozenset(
        name for row in table if state in row.from_states and not row.when for name in row.unless
    )


def hazard_matrix(table: Sequence[Row], known: Sequence[State]) -> Iterator[str]:
    """Where each hazard leads from each state with motors on, in one update."""
    shown = [s.name for s in known if s.flying or s.name in ("ARMED", "ATTITUDE_STAND")]
    yield f"| hazard | {' | '.join(shown)} |"
    yield f"| --- |{' --- |' * len(shown)}"
    for hazard in hazards_of(table):
        cells = []
        for state in shown:
            row = first_row(table, state, kept_by(table, state) | {hazard})
            cells.append("-" if row is None else row.to)
        yield f"| {hazard} | {' | '.join(cells)} |"


def conditions(table: Sequence[Row]) -> Iterator[str]:
    for name, meaning in meanings().items():
        needs = [str(i) for i, row in enumerate(table, 1) if name in row.when]
        forbids = [str(i) for i, row in enumerate(table, 1) if name in row.unless]
        yield f"| {name} | {meaning} | {', '.join(needs) or '-'} | {', '.join(forbids) or '-'} |"


def frames() -> dict[str, frozenset[str]]:
    """The frames of the diagram, the inner one last."""
    known = states()
    return {
        "FLYING": frozenset(s.name for s in known if s.flying and s.name != "BLIND"),
        "UNDER_WAY": frozenset(s.name for s in known if s.under_way),
    }


def state_diagram(table: Sequence[Row]) -> Iterator[str]:
    """Mermaid's stateDiagram-v2."""
    flying, under_way = frames().values()
    found = arrows(table)
    inner = {"FLYING": flying - under_way | {"UNDER_WAY"}, "UNDER_WAY": under_way}
    drawn: dict[str, list[str]] = {"FLYING": [], "UNDER_WAY": [], "": []}
    for (source, target), said in found.items():
        # An arrow drawn in a frame pulls its ends into it.
        frame = next((f for f, names in inner.items() if {source, target} <= names), "")
        if not frame and {source, target} <= flying | {"UNDER_WAY"}:
            frame = "FLYING"
        drawn[frame].append(f"{source} --> {target} : {'<br/>'.join(said)}")
    yield "stateDiagram-v2"
    yield f"  [*] --> {states()[0].name}"
    yield '  state "in flight" as FLYING {'
    yield '    state "under way" as UNDER_WAY {'
    yield from (f"      {arrow}" for arrow in drawn["UNDER_WAY"])
    yield "    }"
    yield from (f"    {arrow}" for arrow in drawn["FLYING"])
    yield "  }"
    yield from (f"  {arrow}" for arrow in drawn[""])


def arrows(table: Sequence[Row]) -> dict[tuple[str, str], list[str]]:
    """What leads from a state or frame to a state; rows of all states of a frame are the frame's,
    those of hazards one word.
    """
    order = [*frames(), *(state.name for state in states())]
    found: dict[tuple[str, str], list[str]] = {}
    for row in table:
        if row.from_states == (row.to,):
            continue
        ends = set(row.from_states)
        for frame, members in frames().items():
            if ends >= members and row.to not in members:
                ends = ends - members | {frame}
        said = label(row, hazards_of(table))
        for source in sorted(ends, key=order.index):
            known = found.setdefault((source, row.to), [])
            if said not in known:
                known.append(said)
    # What the frame's arrow says, those of its states need not.
    for frame, members in frames().items():
        for (source, target), said_there in found.items():
            if source in members:
                known = found.get((frame, target), [])
                said_there[:] = [said for said in said_there if said not in known]
    return {ends: said for ends, said in found.items() if said}


def label(row: Row, hazards: Sequence[str]) -> str:
    """A row's conditions; hazards, and the many that forbid it, are one word."""
    if row.failsafe and not {*row.when}.isdisjoint(hazards):
        return "failsafe"
    parts = [" and ".join(row.when)] if row.when else []
    if len(row.unless) > MANY:
        parts += [f"not {name}" for name in row.unless if name not in hazards] + ["no hazard"]
    else:
        parts += [f"not {name}" for name in row.unless]
    return ", ".join(parts)
