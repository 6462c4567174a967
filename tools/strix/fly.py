"""`strix fly`: fly, then leave log, report and summary in a folder."""

from __future__ import annotations

import json
import math
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from strix.errors import BadInput
from strix.flightlog import read_flight_log
from strix.missions import find_mission
from strix.report import write_report
from strix.scenarios import Outcome, find_scenario, judge
from strix.simulation import FlightPlan
from strix.simulation import fly as simulate
from strix.summary import Summary, summarise
from strix.vehicles import vehicle_name

USUAL_FLIGHT_S = 60.0  # the first flight's; the bar stays full when one takes longer


@dataclass(frozen=True)
class Flown(Summary):
    """The summary of a simulated flight, and whether it ended as its scenario has to."""

    scenario: str
    expected: Outcome
    outcome: Outcome

    @property
    def as_expected(self) -> bool:
        return self.outcome is self.expected

    def sentence(self) -> str:
        """What the exit code says."""
        found = "as expected" if self.as_expected else f"expected: {self.expected}"
        return f"{self.scenario}: {self.outcome}, {found}"


def make_plan(
    vehicle: str, mission: str | None, scenario: str, heading_deg: float, seed: int
) -> FlightPlan:
    """Checks what the user asked for; without a mission the scenario's own is flown."""
    if not math.isfinite(heading_deg):
        raise BadInput(f"--heading: expected degrees, found {heading_deg}")
    found = find_scenario(scenario)
    name = mission or found.mission
    return FlightPlan(vehicle_name(vehicle), find_mission(name), found, heading_deg, seed)


def fly_and_report(plan: FlightPlan, out: Path) -> Flown:
    """Flies the plan; leaves flight.ulg, report.html and summary.json in `out`."""
    make_writable(out)
    begin = time.monotonic()
    log_path = out / "flight.ulg"
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description:9}"),
        BarColumn(),
        TextColumn("{task.completed:3.0f} s flown,"),
        TimeRemainingColumn(),
        TextColumn("to go"),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("BOOT", total=USUAL_FLIGHT_S)
        state_before = ""

        def show(time_s: float, state: str) -> None:
            nonlocal state_before
            if state != state_before:
                bar.console.print(f"{time_s:6.1f} s  {state}", highlight=False)
                state_before = state
            bar.update(task, completed=time_s, description=state)

        track = simulate(plan, log_path, show)
    log = read_flight_log(log_path)
    numbers = summarise(log, track, time.monotonic() - begin)
    summary = Flown(
        **asdict(numbers),
        scenario=plan.scenario.name,
        expected=plan.scenario.expected,
        outcome=judge(log, track, numbers),
    )
    write_report(out / "report.html", log, track, summary)
    text = json.dumps(summary.to_dict(), indent=2) + "\n"
    (out / "summary.json").write_text(text, encoding="utf-8")
    return summary


def make_writable(out: Path) -> None:
    """Makes the folder, and says so when it cannot be written."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        probe = out / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise BadInput(f"--out {out}: expected a folder that can be written: {error}") from None
