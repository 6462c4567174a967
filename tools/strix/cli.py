"""The command `strix`: one thin function a verb, over a library call."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from strix.calibrate.cli import calibrate_app
from strix.campaign.cli import campaign
from strix.command import says_what_is_wrong
from strix.errors import BadInput
from strix.identify.cli import identify_app
from strix.log import cli_view
from strix.log.cli import log_app

app = typer.Typer(
    name="strix",
    help="Fly, replay and measure the Strix flight software on a laptop.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
)

app.add_typer(log_app, name="log")
app.add_typer(calibrate_app, name="calibrate")
app.add_typer(identify_app, name="identify")
app.command(epilog="Example: strix campaign --n 500 --seed 1 --out out/campaign")(campaign)
app.command(epilog="Example: strix convert out/flight.ulg -o flight.mcap")(cli_view.convert)


@app.callback()
def main() -> None:
    """Fly, replay and measure the Strix flight software on a laptop."""


@app.command(epilog="Example: strix fly --heading 90 --seed 7 --out out")
@says_what_is_wrong
def fly(
    vehicle: Annotated[str, typer.Option(help="Airframe, of include/vehicles/")] = "Quad5in",
    mission: Annotated[
        str | None,
        typer.Option(help="Of missions/ or include/missions/, or a file; else the scenario's own"),
    ] = None,
    scenario: Annotated[
        str, typer.Option(help="What surrounds the flight: calm, wind, hover-wind, stand-4, …")
    ] = "calm",
    controller: Annotated[
        str,
        typer.Option(
            help="lqr; ugglan: its attitude law under the LQR's positions; sticks: Ugglan's own "
            "pipeline and a pilot"
        ),
    ] = "lqr",
    heading: Annotated[float, typer.Option(help="Start heading, deg clockwise from north")] = 0.0,
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1, help="Of all noise and gusts")] = 1,
    changes: Annotated[
        list[str] | None, typer.Option("--param", help="NAME=VALUE, repeatable: docs/parameters.md")
    ] = None,
    telemetry: Annotated[
        str | None,
        typer.Option(help="A ground station flies it, as udp:127.0.0.1:14550, in real time"),
    ] = None,
    console: Annotated[
        bool, typer.Option("--console", help="Somebody at a terminal flies it, in real time")
    ] = False,
    speed: Annotated[
        float, typer.Option(min=0.0, help="Of these two, against real time; 0: none")
    ] = 1.0,
    duration: Annotated[
        float | None, typer.Option("--for", min=1.0, help="Of these two, s; else until Ctrl-C")
    ] = None,
    out: Annotated[
        Path, typer.Option(help="Folder for flight.ulg, report.html and summary.json")
    ] = Path("out"),
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON")] = False,
) -> None:
    """Fly a mission in simulation: the flight software itself against a simulated aircraft.

    Exits with 0 when the flight ended as its scenario has to, with 1 when it did not. One that is
    flown by telemetry or at a terminal ends as who flies it likes: 0.
    """
    from strix.fly import fly_and_report, fly_sticks_and_report, make_plan
    from strix.ground import end_by_signals, make_ground, read_parameters
    from strix.summary import print_summary

    parameters = read_parameters(changes or [])
    plan = make_plan(vehicle, mission, scenario, heading, seed, controller, parameters)
    ground = make_ground(telemetry, console, speed, duration)
    if ground is not None and controller == "sticks":
        raise BadInput("--controller sticks: expected neither --telemetry nor --console")
    if ground is not None:
        end_by_signals()
    if ground is not None and ground.terminal is not None:
        print(f"console: {ground.terminal.path}", file=sys.stderr)
    if controller == "sticks":
        summary = fly_sticks_and_report(plan, out)
    else:
        summary = fly_and_report(plan, out, ground)
    if ground is not None:
        ground.close()
    if as_json:
        print(json.dumps(summary.to_dict()))
    else:
        print_summary(summary)
        print(summary.sentence())
        print(f"{out}/flight.ulg, {out}/report.html, {out}/summary.json")
    if ground is None and not summary.as_expected:
        raise typer.Exit(1)


@app.command(
    epilog="Example: strix replay out/flight.ulg --set nav.gpsPositionSigma=2 -o what-if.ulg"
)
@says_what_is_wrong
def replay(
    log: Annotated[Path, typer.Argument(help="Flight log, .ulg")],
    check: Annotated[
        bool, typer.Option("--check", help="Stop at the first control tick that differs")
    ] = False,
    changes: Annotated[
        list[str] | None, typer.Option("--set", help="Another tuning: nav.NAME=VALUE, repeatable")
    ] = None,
    states: Annotated[int, typer.Option(help="Of the filter: 18, or 9 without biases")] = 18,
    gains: Annotated[
        Path | None, typer.Option(help="Other gains: a header as strix gains writes it")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="The replay's own log")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON")] = False,
) -> None:
    """Feed a log's inputs to the same flight software and compare every control tick.

    Exits with 1 when a tick differs and nothing was changed.
    """
    from strix import replay as library

    found = library.replay(log, changes or [], states, gains, out, check)
    print(json.dumps(found.to_dict()) if as_json else "\n".join(found.sentences()))
    if not found.same and not found.changed:
        raise typer.Exit(1)


@app.command(epilog="Example: strix estimate recording/ --declination 11.7 --delay gps=0.22")
@says_what_is_wrong
def estimate(
    recording: Annotated[Path, typer.Argument(help="Folder with imu.csv[.gz] and others")],
    out: Annotated[Path, typer.Option(help="The estimate, a CSV file")] = Path("est.csv"),
    declination: Annotated[
        float, typer.Option(help="Of the magnetic field, deg, east positive")
    ] = 0.0,
    delay: Annotated[
        str, typer.Option(help="Age of readings, s: gps=0.22,baro=0.35,mag=0.03")
    ] = "",
    states: Annotated[int, typer.Option(help="Of the filter: 18, or 9 without biases")] = 18,
) -> None:
    """Run the flight navigation on a recording of real sensors."""
    import math

    from strix import estimate as library
    from strix.recording import read_recording

    delays_s = library.parse_delays(delay)
    result = library.estimate(
        read_recording(recording), math.radians(declination), delays_s, states=states
    )
    if result.start.note:
        print(f"strix: {result.start.note}", file=sys.stderr)
    library.write_estimate(out, result)
    print(f"{len(result.table)} rows written to {out}")


@app.command(epilog="Example: strix score est.csv recording/ref_att.csv.gz --after 30")
@says_what_is_wrong
def score(
    estimate: Annotated[Path, typer.Argument(help="From strix estimate")],
    reference: Annotated[Path, typer.Argument(help="ref_att.csv[.gz] of the recording")],
    after: Annotated[float, typer.Option(help="Leave out what came before, s")] = 0.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the scores as JSON")] = False,
) -> None:
    """Compare an estimated attitude with a reference: RMS errors in degrees."""
    from strix import score as library

    result = library.score(
        library.read_attitude(estimate), library.read_reference(reference), after
    )
    print(json.dumps(result.to_dict()) if as_json else result.table())


@app.command(epilog="Example: strix accuracy --data ../shared/data --out out")
@says_what_is_wrong
def accuracy(
    data: Annotated[Path, typer.Option(help="Folder of recordings, a folder each")] = Path(
        "../shared/data"
    ),
    out: Annotated[Path, typer.Option(help="Folder for accuracy.json")] = Path("out"),
) -> None:
    """Score the navigation on recordings of real sensors, beside VQF.

    Exits with 1 when a target of the defaults is missed.
    """
    from strix.accuracy_table import print_accuracy, run_accuracy

    found = run_accuracy(data, out)
    print_accuracy(found)
    print(f"{out}/accuracy.json")
    if not all(target.met for target in found.targets()):
        raise typer.Exit(1)


@app.command(epilog="Example: strix consistency --flights 200 --out out")
@says_what_is_wrong
def consistency(
    flights: Annotated[int, typer.Option(min=2, help="Of each kind, 60 s each")] = 200,
    hours: Annotated[float, typer.Option(min=0.02, help="Of the endurance flight")] = 4.0,
    seed: Annotated[int, typer.Option(min=0, help="Of all flights")] = 1,
    out: Annotated[Path, typer.Option(help="Folder for consistency.json and .html")] = Path("out"),
) -> None:
    """Check the filter against its own claim: NEES, NIS, covariance. Exits with 1 if it fails."""
    from strix import consistency as library

    found = library.check_and_report(flights, hours, seed, out)
    library.print_consistency(found)
    print(f"{out}/consistency.html, {out}/consistency.json")
    if not found.consistent:
        raise typer.Exit(1)


@app.command(epilog="Example: strix options --out docs/figures")
@says_what_is_wrong
def options(
    out: Annotated[Path, typer.Option(help="Folder for the figures")] = Path("docs/figures"),
) -> None:
    """Fly each option of the navigation off and on: its figure, and its numbers (mean, largest)."""
    from strix.options import write_figures

    for table in write_figures(out):
        print(table)


@app.command(epilog="Example: strix wiring --out docs/figures")
@says_what_is_wrong
def wiring(
    board: Annotated[Path, typer.Option(help="Folder with Pins.h and SpiBus.h")] = Path(
        "src/board"
    ),
    vehicle: Annotated[str, typer.Option(help="Airframe, of include/vehicles/")] = "Quad5in",
    out: Annotated[Path, typer.Option(help="Folder for the drawings")] = Path("docs/figures"),
) -> None:
    """Draw the wiring diagram from the pins that the firmware is compiled with."""
    from strix.wiring import write_wiring

    for path in write_wiring(board, vehicle, out):
        print(path)


@app.command(epilog="Example: strix gains --vehicle UgglanQ450 --controller ugglan --check")
@says_what_is_wrong
def gains(
    vehicle: Annotated[str | None, typer.Option(help="One airframe; all when left out")] = None,
    controller: Annotated[
        str, typer.Option(help="lqr, or ugglan: state feedback with a reduced observer")
    ] = "lqr",
    check: Annotated[
        bool, typer.Option("--check", help="Write nothing; exit with 1 if a header is out of date")
    ] = False,
    corners: Annotated[
        bool,
        typer.Option("--corners", help="Also the margins when mass, inertia, thrust, lag differ"),
    ] = False,
    figures: Annotated[
        Path | None, typer.Option(help="Folder for figures of steps and margins")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON")] = False,
) -> None:
    """Design the controller's gains from the vehicle file, into include/gains/."""
    from strix.errors import BadInput
    from strix.gains import run_gains
    from strix.observer_gains import run_observer_gains

    if controller not in ("lqr", "ugglan"):
        raise BadInput(f"--controller: expected lqr or ugglan, found '{controller}'")
    if controller == "lqr":
        current = run_gains(vehicle, check, corners=corners, figures=figures, as_json=as_json)
    else:
        current = run_observer_gains(vehicle, check, figures)
    if not current:
        raise typer.Exit(1)


@app.command(epilog="Example: strix handling --flights 200 --out out")
@says_what_is_wrong
def handling(
    flights: Annotated[int, typer.Option(min=0, help="Of the Monte Carlo")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Of the first flight")] = 1,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes; all cores when left out")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for handling.json and figures")] = Path("out"),
    figures: Annotated[Path | None, typer.Option(help="Another folder for the figures")] = None,
    replay: Annotated[
        int | None, typer.Option(help="Fly this seed of the Monte Carlo again, and nothing else")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON")] = False,
) -> None:
    """Measure steps, hover, wind and robustness in simulation, beside their targets.

    Exits with 1 when a target is missed.
    """
    from strix import handling as library

    if replay is not None:
        flight = library.replay_robust(replay, out)
        library.print_replay(flight)
        raise typer.Exit(0 if flight.passes else 1)
    found = library.run_handling(flights, seed, jobs, out, figures)
    if as_json:
        print(json.dumps(found.to_dict()))
    else:
        library.print_handling(found)
    if not found.met:
        raise typer.Exit(1)


@app.command(epilog="Example: strix diagrams --out docs")
@says_what_is_wrong
def diagrams(
    out: Annotated[Path, typer.Option(help="Folder for the pages")] = Path("docs"),
) -> None:
    """Draw the state machine and the signals of a control tick from the source."""
    from strix.diagrams import write_diagrams

    for path in write_diagrams(out):
        print(path)


@app.command(epilog="Example: strix promela --out build/strix.pml")
@says_what_is_wrong
def promela(
    out: Annotated[Path, typer.Option(help="The model's file")] = Path("strix.pml"),
) -> None:
    """Write the state machine as a model for Spin, with what is to be proven of it."""
    from strix.promela import write_model

    print(write_model(out))


if __name__ == "__main__":
    app()
