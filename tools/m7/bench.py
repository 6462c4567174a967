"""`make bench`: instructions per call on the emulated Cortex-M7, beside their budgets.

Prints a table, writes build/bench/results.csv, and ends with status 1 if a function is more than
5 % past its line in bench/budget.csv, 2 if the cross compiler or the emulator is missing. A line's
budget is what was asked for; where that is out of reach, its ceiling is what was reached.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from m7 import HERE, ROOT, BuildError, MissingToolError, build, calls_outside, object_of, run

PROGRAM = HERE / "bench_navigation.cpp"
BUDGET = ROOT / "bench" / "budget.csv"
OTHERS = ROOT / "bench" / "others.csv"
RESULTS = ROOT / "build" / "bench"
TOLERANCE = 1.05  # of a budget: another release of the compiler may move a count by a few percent

# All that the measured code and the program around it may take from a library: no heap, no libm.
# (sqrtf sets errno for a negative number; the root itself is the processor's, IEEE 754 exact.)
ALLOWED = {"memcmp", "memcpy", "memmove", "memset", "printf", "putchar", "puts", "sqrtf"}

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
    states: int
    scalars: int
    calls: int
    median: int
    min: int
    max: int

    @property
    def key(self) -> Key:
        return self.function, self.states


def main() -> int:
    try:
        elf = build([PROGRAM], RESULTS)
        done = run(elf)
    except MissingToolError as missing:
        print(f"bench: {missing}", file=sys.stderr)
        return 2
    except BuildError as refused:
        print(f"bench: does not build\n{refused}", file=sys.stderr)
        return 1
    if done.status != 0:
        print(f"bench: the program ended with status {done.status}\n{done.output}", file=sys.stderr)
        return 1

    counts = parse_counts(done.output)
    budget = read_budget(BUDGET)
    write_results(RESULTS / "results.csv", counts, budget)
    print("Instructions per call on an emulated Cortex-M7 (not cycles: no cache, no pipeline)\n")
    print(table(counts, budget))
    print(f"\nOther filters on the same rig ({OTHERS.relative_to(ROOT)})\n")
    print(comparison(counts, OTHERS))
    print()
    return report(complaints(counts, budget, calls_outside(object_of(PROGRAM, RESULTS))))


def parse_counts(text: str) -> list[Count]:
    """The CSV that bench_navigation.cpp prints."""
    rows = csv.DictReader(text.splitlines())
    numbers = [field.name for field in fields(Count)][1:]
    return [Count(row["function"], *(int(row[name]) for name in numbers)) for row in rows]


def read_budget(path: Path) -> dict[Key, Limit]:
    """Instructions per call that each function may take."""
    with path.open(newline="", encoding="utf-8") as file:
        return {
            (row["function"], int(row["states"])): Limit(
                int(row["budget"]), int(row["ceiling"] or row["budget"])
            )
            for row in csv.DictReader(file)
        }


def complaints(
    counts: Iterable[Count], budget: Mapping[Key, Limit], outside: Iterable[str]
) -> list[str]:
    """What fails the build, one sentence each."""
    found = {count.key: count for count in counts}
    said = []
    for (function, states), limit in budget.items():
        count = found.get((function, states))
        if count is None:
            said.append(f"{function}, {states} states: has a budget but was not counted")
        elif count.max > TOLERANCE * limit.ceiling:
            past = 100 * (count.max / limit.ceiling - 1)
            said.append(
                f"{function}, {states} states: {count.max} instructions, "
                f"{past:.1f} % past its limit of {limit.ceiling}"
            )
    said += [f"the measured code calls {name}" for name in sorted(set(outside) - ALLOWED)]
    return said


def table(counts: Iterable[Count], budget: Mapping[Key, Limit]) -> str:
    """One row a function; a count that differs between calls shows its range."""
    rows = [("function", "states", "per call", "per scalar", "budget", "used", "same every call")]
    for count in counts:
        limit = budget.get(count.key)
        rows.append(
            (
                count.function,
                str(count.states),
                str(count.median),
                f"{count.median / count.scalars:.0f}" if count.scalars else "-",
                str(limit.budget) if limit else "-",
                f"{100 * count.max / limit.budget:.0f} %" if limit else "-",
                "yes" if count.min == count.max else f"no, {count.min} to {count.max}",
            )
        )
    return aligned(rows)


def comparison(counts: Sequence[Count], others: Path) -> str:
    """Ours among the other filters, by what one prediction and one height or row costs."""
    found = {count.key: count for count in counts}
    rows: list[tuple[str, ...]] = [("filter", "states", "predict", "one scalar", "note")]
    for states in sorted({count.states for count in counts}):
        predict = found["predict", states].median
        scalar = found["updateAltMeas", states].median
        rows.append(
            ("Strix", str(states), str(predict), str(scalar), "measured now; scalar: height")
        )
    with others.open(newline="", encoding="utf-8") as file:
        columns = ("filter", "states", "predict", "scalar", "note")
        rows += [tuple(row[name] for name in columns) for row in csv.DictReader(file)]
    return aligned(rows)


def aligned(rows: Sequence[tuple[str, ...]]) -> str:
    """Columns: numbers to the right, the first and the last column to the left."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    last = len(widths) - 1
    lines = []
    for row in rows:
        cells = [
            cell.ljust(width) if i in (0, last) else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def write_results(path: Path, counts: Iterable[Count], budget: Mapping[Key, Limit]) -> None:
    columns = [*(field.name for field in fields(Count)), "budget", "ceiling"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        for count in counts:
            limit = budget.get(count.key)
            writer.writerow({**asdict(count), **(asdict(limit) if limit else {})})


def report(said: Sequence[str]) -> int:
    for sentence in said:
        print(f"FAILED  {sentence}")
    if not said:
        print("no function is past its limit; no heap, no libm")
    return 1 if said else 0


if __name__ == "__main__":
    raise SystemExit(main())
