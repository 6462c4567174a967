"""`strix fly`: fly, then leave log, report and summary in a folder."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from strix.errors import BadInput
from strix.flightlog import read_flight_log
from strix.ground import Ground
from strix.missions import find_mission
from strix.report import write_report
from strix.scenarios import Outcome, find_scenario, judge
from strix.simulation import FlightPlan
from strix.simulation import fly as simulate
from strix.summary import Summary, summarise
from strix.track import TruthTrack
from strix.ugglan_flight import VEHICLE as STICKS_VEHICLE
from strix.ugglan_flight import fly_ugglan
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


class Controller(StrEnum):
    """What flies the aircraft."""

    LQR = "lqr"  # positions and attitude, FlightSoftware.h
    UGGLAN = "ugglan"  # the LQR's positions, and under them Ugglan's law for the attitude
    STICKS = "sticks"  # Ugglan's own pipeline, UgglanFlight.h, and a pilot who sees the aircraft


# Under Ugglan's law, which integrates attitude errors itself and knows the motors' lag: the
# positions of the design with integral action that leaves the lag to the attitude law.
_UGGLAN_LAW = (("reduced_observer", True), ("design", 2))


def make_plan(
    vehicle: str,
    mission: str | None,
    scenario: str,
    heading_deg: float,
    seed: int,
    controller: str = Controller.LQR,
    parameters: tuple[tuple[str, float], ...] = (),
) -> FlightPlan:
    """Checks what the user asked for; without a mission the scenario's own is flown."""
    if not math.isfinite(heading_deg):
        raise BadInput(f"--heading: expected degrees, found {heading_deg}")
    found = find_scenario(scenario)
    name = vehicle_name(vehicle)
    if controller not in tuple(Controller):
        raise BadInput(
            f"--controller: expected one of {', '.join(Controller)}, found '{controller}'"
        )
    if controller != Controller.LQR and name != STICKS_VEHICLE:
        raise BadInput(
            f"--controller {controller}: expected --vehicle {STICKS_VEHICLE}, of whose "
            f"motors the law knows, found {name}"
        )
    if controller == Controller.STICKS and parameters:
        raise BadInput("--param: expected another --controller than sticks, which has none of them")
    if controller == Controller.STICKS and (mission is not None or not found.of_the_air):
        raise BadInput(
            "--controller sticks: expected no mission, and a scenario of the air alone such as "
            "calm or wind: the pilot flies a programme of his own"
        )
    if controller == Controller.UGGLAN:
        found = replace(found, settings=(*found.settings, *_UGGLAN_LAW))
    return FlightPlan(
        name,
        find_mission(mission or found.mission),
        found,
        heading_deg,
        seed,
        parameters=parameters,
    )


def fly_and_report(plan: FlightPlan, out: Path, ground: Ground | None = None) -> Flown:
    """Flies the plan; leaves flight.ulg, report.html and summary.json in `out`.

    @param ground  flies it instead of the pilot, by telemetry or at a terminal
    """
    return _report(plan, out, lambda log_path, show: simulate(plan, log_path, show, ground=ground))


def fly_sticks_and_report(plan: FlightPlan, out: Path) -> Flown:
    """The same with Ugglan's own pipeline; the pilot has a programme of his own, no mission."""

    def by_sticks(log_path: Path, show: Callable[[float, str], None]) -> TruthTrack:
        return fly_ugglan(
            plan.heading_deg, plan.seed, log_path, plan.scenario.surroundings, progress=show
        ).track

    return _report(plan, out, by_sticks)


def _report(
    plan: FlightPlan,
    out: Path,
    fly: Callable[[Path, Callable[[float, str], None]], TruthTrack],
) -> Flown:
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

        track = fly(log_path, show)
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
