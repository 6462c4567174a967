"""`make bench`: instructions per call on the emulated Cortex-M7, beside their budgets.

Flies a simulated flight for the whole loop's share, prints a table, writes bench/results.csv, and
ends with status 1 if a function is more than 5 % past its line in bench/budget.csv, 2 if the cross
compiler or the emulator is missing. A line's budget is what was asked for; where that is out of
reach, its ceiling is what was reached.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path

from counts import Count, Key, Limit, complaints, in_order, parse_counts, read_budget
from mca import Estimate, EstimateError, estimates

from m7 import HERE, ROOT, BuildError, MissingToolError, build, require_tools, run
from strix.fly import make_plan
from strix.simulation import fly

FOLDER = ROOT / "build" / "bench"
BUDGET = ROOT / "bench" / "budget.csv"
OTHERS = ROOT / "bench" / "others.csv"
RESULTS = ROOT / "bench" / "results.csv"


class ProgramError(Exception):
    """A benchmark program did not do what it should; the text says what it said."""


@dataclass(frozen=True)
class Program:
    """One benchmark program, and the compiler flags that it needs besides the aircraft's."""

    source: Path
    flags: tuple[str, ...] = ()
    last: tuple[str, ...] = ()
    takes_log: bool = False


PROGRAMS = (
    Program(  # the reader of the log throws; the flight code does not
        HERE / "bench_loop.cpp",
        (f"-I{ROOT / 'tools' / 'strix' / 'core'}",),
        ("-fexceptions", "-frtti"),
        takes_log=True,
    ),
    Program(HERE / "bench_navigation.cpp"),
    Program(HERE / "bench_flight.cpp"),
)


@dataclass
class Measured:
    """What the programs counted, and what llvm-mca makes of the median calls."""

    counts: list[Count] = field(default_factory=list)
    estimates: dict[Key, Estimate] = field(default_factory=dict)
    no_estimates: str = ""  # why there are none


def main() -> int:
    try:
        require_tools()
        measured = measure(FOLDER)
    except MissingToolError as missing:
        print(f"bench: {missing}", file=sys.stderr)
        return 2
    except BuildError as refused:
        print(f"bench: does not build\n{refused}", file=sys.stderr)
        return 1
    except ProgramError as failed:
        print(f"bench: {failed}", file=sys.stderr)
        return 1

    budget = read_budget(BUDGET)
    measured.counts = in_order(measured.counts, budget)
    write_results(RESULTS, measured, budget)
    print("Instructions per call on an emulated Cortex-M7 (not cycles: no cache, no pipeline)\n")
    print(table(measured, budget))
    print(f"\n* {legend(measured)}")
    print(f"\nOther filters on the same rig ({OTHERS.relative_to(ROOT)})\n")
    print(comparison(measured.counts, OTHERS))
    print()
    return report(complaints(measured.counts, budget))


def measure(folder: Path) -> Measured:
    """Build and run all programs, each in its own folder."""
    log = folder / "flight.ulg"
    folder.mkdir(parents=True, exist_ok=True)
    fly(make_plan("Quad5in", "first-flight", "calm", 0.0, 1), log, lambda *_: None)
    with ThreadPoolExecutor(2) as workers:
        parts = list(workers.map(lambda program: measure_one(program, folder, log), PROGRAMS))
    return Measured(
        [count for part in parts for count in part.counts],
        {key: estimate for part in parts for key, estimate in part.estimates.items()},
        next((part.no_estimates for part in parts if part.no_estimates), ""),
    )


def measure_one(program: Program, folder: Path, log: Path) -> Measured:
    own = folder / program.source.stem
    elf = build([program.source], own, program.flags, program.last)
    arguments = [str(log)] if program.takes_log else []
    done = run(elf, arguments)
    if done.status != 0:
        raise ProgramError(f"{elf.stem} ended with status {done.status}\n{done.output}")
    measured = Measured(parse_counts(done.output))
    calls = {c.median_call: c.median for c in measured.counts}
    try:
        found = estimates(elf, arguments, calls, own)
    except EstimateError as error:
        measured.no_estimates = str(error)
    else:
        measured.estimates = {c.key: found[c.median_call] for c in measured.counts}
    return measured


def write_results(path: Path, measured: Measured, budget: Mapping[Key, Limit]) -> None:
    columns = [column.name for column in fields(Count) if column.name != "median_call"]
    columns += ["budget", "ceiling", "cycles"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        for count in measured.counts:
            row = asdict(count)
            if count.key in budget:
                row |= asdict(budget[count.key])
            if count.key in measured.estimates:
                row["cycles"] = measured.estimates[count.key].cycles
            writer.writerow(row)


def table(measured: Measured, budget: Mapping[Key, Limit]) -> str:
    """One row a function; `used` is what its worst call takes of the budget."""
    head = ("function", "states", "calls", "median", "mean", "min", "worst", "budget", "used")
    rows: list[tuple[str, ...]] = [(*head, "per scalar", "cycles*")]
    for count in measured.counts:
        limit = budget.get(count.key)
        estimate = measured.estimates.get(count.key)
        numbers = (count.calls, count.median, count.mean, count.min, count.max)
        rows.append(
            (
                count.function,
                str(count.states or "-"),
                *(str(number) for number in numbers),
                str(limit.budget) if limit else "-",
                f"{100 * count.max / limit.budget:.0f} %" if limit else "-",
                f"{count.median / count.scalars:.0f}" if count.scalars else "-",
                str(estimate.cycles) if estimate else "-",
            )
        )
    return aligned(rows)


def legend(measured: Measured) -> str:
    """What the last column means, and what it had to leave out."""
    said = "estimated cycles (llvm-mca, no cache, no branch misses) of the median call"
    if measured.no_estimates:
        return f"{said}: none, {measured.no_estimates}"
    unknown = {name for estimate in measured.estimates.values() for name in estimate.left_out}
    if not unknown:
        return said
    count = sum(len(estimate.left_out) for estimate in measured.estimates.values())
    return (
        f"{said}; {count} instructions left out, unknown to llvm-mca: {', '.join(sorted(unknown))}"
    )


def comparison(counts: Sequence[Count], others: Path) -> str:
    """Ours among the other filters, by what one prediction and one height or row costs."""
    found = {count.key: count for count in counts}
    rows: list[tuple[str, ...]] = [("filter", "states", "predict", "one scalar", "note")]
    for states in (9, 18):
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
    """Columns: the first and the last to the left, the others, numbers, to the right."""
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


def report(said: Sequence[str]) -> int:
    for sentence in said:
        print(f"FAILED  {sentence}")
    if not said:
        print("no function is past its limit")
    return 1 if said else 0


if __name__ == "__main__":
    raise SystemExit(main())
