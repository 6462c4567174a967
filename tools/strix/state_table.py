"""The state machine as it is compiled: its rows, and all sets of conditions as cubes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from strix import _core

# Conditions of rows that end a flight, which are no hazards: they can be waited for, or are the
# pilot's.
NOT_HAZARDS = frozenset({"Disarm", "BlindOver", "TouchDown", "OnGround", "ImuBack"})


@dataclass(frozen=True)
class Row:
    """One row of the table. It applies to the sets that hold all of `when` and none of `unless`."""

    from_states: tuple[str, ...]
    when: tuple[str, ...]
    unless: tuple[str, ...]
    to: str
    failsafe: bool
    said: str

    def applies(self, state: str, conditions: frozenset[str]) -> bool:
        return (
            state in self.from_states
            and conditions.issuperset(self.when)
            and conditions.isdisjoint(self.unless)
        )


@dataclass(frozen=True)
class State:
    """What is on in a state, and what kind it is."""

    name: str
    motors: bool
    controller: bool
    flying: bool
    under_way: bool  # those that a lesser hazard sends home
    keeps_failsafe: bool  # a flight that a hazard ends is or ends here


@dataclass(frozen=True)
class Cube:
    """All sets that hold `all_of` and nothing of `none_of`; and their first row, if one fits."""

    all_of: frozenset[str]
    none_of: frozenset[str]
    row: int | None


def rows() -> list[Row]:
    """The table that flies; the first row that fits is taken."""
    return [
        Row(
            tuple(row["from_states"]),
            tuple(row["when"]),
            tuple(row["unless"]),
            row["to"],
            row["failsafe"],
            row["said"],
        )
        for row in _core.transitions()
    ]


def states() -> list[State]:
    """In the order of their numbers in the log."""
    return [State(**state) for state in _core.states()]


def meanings() -> dict[str, str]:
    """Every condition with what it means, in the order of their places in the log."""
    return {condition["name"]: condition["meaning"] for condition in _core.conditions()}


def hazards_of(table: Sequence[Row]) -> list[str]:
    """The conditions that end a flight, in the order of the table."""
    found = [name for row in table if row.failsafe for name in row.when]
    return [name for name in dict.fromkeys(found) if name not in NOT_HAZARDS]


def first_row(table: Sequence[Row], state: str, conditions: frozenset[str]) -> Row | None:
    return next((row for row in table if row.applies(state, conditions)), None)


def cubes(table: Sequence[Row], state: str) -> Iterator[Cube]:
    """Disjoint cubes that are all sets of conditions of this state."""
    yield from _split(table, state, frozenset(), frozenset(), 0)


def _split(
    table: Sequence[Row], state: str, all_of: frozenset[str], none_of: frozenset[str], first: int
) -> Iterator[Cube]:
    for number in range(first, len(table)):
        row = table[number]
        if state not in row.from_states or none_of & {*row.when} or all_of & {*row.unless}:
            continue
        # The sets that fail here, by the first condition that they fail.
        for name in row.when:
            if name not in all_of:
                yield from _split(table, state, all_of, none_of | {name}, number + 1)
                all_of |= {name}
        for name in row.unless:
            if name not in none_of:
                yield from _split(table, state, all_of | {name}, none_of, number + 1)
                none_of |= {name}
        yield Cube(all_of, none_of, number)
        return
    yield Cube(all_of, none_of, None)
