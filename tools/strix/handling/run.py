"""`strix handling`: flies everything on all cores, prints the table, leaves handling.json."""

from __future__ import annotations

import json
import math
import multiprocessing
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from strix.errors import BadInput
from strix.fly import make_writable
from strix.handling.flights import Job, Measured, fly_and_measure, fly_into
from strix.handling.montecarlo import Robust, by_badness, robust, robust_job
from strix.handling.targets import REPEATS, Line, handling_jobs, table

VEHICLES = {"Quad5in": True, "UgglanQ450": False}  # with targets, or told only
WORST = 10
NOTE = """\
Attitude is the truth; place is the estimate, unless it says truth. Rise is from
10 to 90 %. Hovers are armed after 90 s of GPS fixes. Four headings: the
aircraft's own noise the same at each, GPS without noise; spread of the rise
about its mean, and the largest distance of two responses at any time, in % of
the step.
"""


@dataclass(frozen=True)
class Handling:
    """All that `strix handling` finds."""

    seed: int
    lines: list[Line]
    flights: list[Robust]  # of the Monte Carlo, worst first

    @property
    def passed(self) -> int:
        return sum(flight.passes for flight in self.flights)

    @property
    def met(self) -> bool:
        return all(line.met for line in self.lines) and self.passed == len(self.flights)

    def to_dict(self) -> dict[str, Any]:
        """For handling.json, which has null for what is not a finite number."""
        return {
            "met": self.met,
            "seed": self.seed,
            "lines": [
                {**asdict(line), "measured": finite(line.measured), "met": line.met}
                for line in self.lines
            ],
            "robust": {
                "flights": len(self.flights),
                "passed": self.passed,
                "worst": [told(flight) for flight in self.flights[:WORST]],
            },
        }


def finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def told(flight: Robust) -> dict[str, Any]:
    name, ratio = flight.worst
    return {
        "seed": flight.draw.seed,
        "passes": flight.passes,
        "worst": name,
        "of_limit": finite(ratio),
        "draw": asdict(flight.draw),
        "ratios": {key: finite(value) for key, value in flight.ratios.items()},
    }


def fly_all(
    jobs: Sequence[Job], processes: int, tick: Callable[[], None] = lambda: None
) -> list[Measured]:
    """In the order of the jobs. Every flight is determined by its job alone."""
    # Spawned, not forked: each process loads its own compiled core.
    with multiprocessing.get_context("spawn").Pool(min(processes, len(jobs))) as pool:
        found = []
        for measured in pool.imap(fly_and_measure, jobs):
            found.append(measured)
            tick()
        return found


def all_jobs(flights: int, seed: int, repeats: int = REPEATS) -> list[Job]:
    jobs = [job for vehicle in VEHICLES for job in handling_jobs(vehicle, seed, repeats)]
    return jobs + [robust_job(seed + i) for i in range(flights)]


def summarised(seed: int, flown: Sequence[Measured]) -> Handling:
    lines = [line for v, targets in VEHICLES.items() for line in table(v, flown, targets)]
    return Handling(seed, lines, by_badness(flown))


def run_handling(
    flights: int, seed: int, processes: int | None, out: Path, figures: Path | None = None
) -> Handling:
    """Leaves handling.json in `out`, and the figures there or in their own folder."""
    from strix.handling.figures import write_figures

    make_writable(out)
    jobs = all_jobs(flights, seed)
    columns = (TextColumn("handling"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("", total=len(jobs))
        flown = fly_all(jobs, processes or os.cpu_count() or 1, lambda: bar.advance(task))
    found = summarised(seed, flown)
    text = json.dumps(found.to_dict(), indent=2, allow_nan=False) + "\n"
    try:
        (out / "handling.json").write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadInput(
            f"{out}/handling.json: expected a file that can be written, found: {error.strerror}"
        ) from None
    write_figures(flown, figures or out)
    return found


def replay_robust(seed: int, out: Path) -> Robust:
    """Flies one flight of the Monte Carlo again; leaves flight.ulg and report.html in `out`."""
    from strix.report import write_report
    from strix.summary import summarise

    make_writable(out)
    measured, log, track = fly_into(robust_job(seed), out / "flight.ulg")
    write_report(out / "report.html", log, track, summarise(log, track, 0.0))
    return robust(measured)


def print_handling(found: Handling, console: Console | None = None) -> None:
    """The table, and the worst of the Monte Carlo."""
    console = console or Console(highlight=False)
    lines = Table.grid(padding=(0, 2))
    for justify in ("left", "right", "left", "right", "left", "left"):
        lines.add_column(justify=justify, no_wrap=True)
    vehicle = ""
    for line in found.lines:
        if line.vehicle != vehicle:
            vehicle = line.vehicle
            lines.add_row(f"[bold]{vehicle}[/]", "measured", "", "target", "", "")
        target = "" if line.target is None else f"< {line.target:g}"
        verdict = "" if line.target is None else "met" if line.met else "[bold red]MISSED[/]"
        lines.add_row(line.name, f"{line.measured:.3g}", line.unit, target, verdict, line.of)
    console.print(lines)
    console.print(NOTE, soft_wrap=True)
    if not found.flights:
        return
    console.print(
        f"Monte Carlo: {found.passed} of {len(found.flights)} flights pass "
        f"({found.passed / len(found.flights):.1%}). The worst, in shares of a limit:"
    )
    for flight in found.flights[:WORST]:
        console.print("  " + sentence(flight), soft_wrap=True)


def sentence(flight: Robust) -> str:
    name, ratio = flight.worst
    verdict = "passes" if flight.passes else "FAILS"
    return f"seed {flight.draw.seed}: {verdict}, {name} {ratio:.2f}; {flight.draw.sentence()}"


def print_replay(flight: Robust, console: Console | None = None) -> None:
    console = console or Console(highlight=False)
    console.print(sentence(flight), soft_wrap=True)
    for name, ratio in flight.ratios.items():
        console.print(f"  {name:16} {ratio:.2f} of its limit")
