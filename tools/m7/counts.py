"""What the benchmark programs print (Counts.h), and what bench/budget.csv allows."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

TOLERANCE = 1.05  # of a budget: another release of the compiler may move a count by a few percent

Key = tuple[str, int]  # function and number of states


@dataclass(frozen=True)
class Limit:
    """Instructions of one call: what was asked for, and what no change may exceed."""

    budget: int
    ceiling: int


@dataclass(frozen=True)
class Count:
    """Instructions of one function, over several calls with different numbers."""

    function: str
    states: int  # of the filter; 0: it belongs to none
    scalars: int  # that a measurement update takes in
    calls: int
    median: int
    mean: int
    min: int
    max: int
    median_call: int  # its number among all calls the program counted

    @property
    def key(self) -> Key:
        return self.function, self.states


def parse_counts(text: str) -> list[Count]:
    """The CSV that a benchmark program prints."""
    rows = csv.DictReader(text.splitlines())
    return [
        Count(row.pop("function"), **{name: int(number) for name, number in row.items()})
        for row in rows
    ]


def read_budget(path: Path) -> dict[Key, Limit]:
    """Instructions per call that each function may take."""
    with path.open(newline="", encoding="utf-8") as file:
        return {
            (row["function"], int(row["states"])): Limit(
                int(row["budget"]), int(row["ceiling"] or row["budget"])
            )
            for row in csv.DictReader(file)
        }


def in_order(counts: Iterable[Count], budget: Iterable[Key]) -> list[Count]:
    """As the budget has them; what has none comes last."""
    places = {key: place for place, key in enumerate(budget)}
    return sorted(counts, key=lambda count: places.get(count.key, len(places)))


def complaints(counts: Iterable[Count], budget: Mapping[Key, Limit]) -> list[str]:
    """What fails the build, one sentence each."""
    found = {count.key: count for count in counts}
    said = []
    for key, limit in budget.items():
        count = found.get(key)
        if count is None:
            said.append(f"{named(key)}: has a budget but was not counted")
        elif count.max > TOLERANCE * limit.ceiling:
            past = 100 * (count.max / limit.ceiling - 1)
            said.append(
                f"{named(key)}: {count.max} instructions, "
                f"{past:.1f} % past its limit of {limit.ceiling}"
            )
    said += [f"{named(key)}: has no budget" for key in found if key not in budget]
    return said


def named(key: Key) -> str:
    function, states = key
    return f"{function}, {states} states" if states else function
