"""`strix accuracy`: runs it with a progress bar and shows the results as tables."""

from __future__ import annotations

from itertools import count
from pathlib import Path

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
from rich.table import Table

from strix.accuracy import BROAD, Accuracy, measure, sources, write_json
from strix.errors import BadInput
from strix.fly import make_writable


def run_accuracy(data: Path, out: Path) -> Accuracy:
    """Measure on every recording in `data`; leaves accuracy.json in `out`."""
    make_writable(out)
    wanted = sources(data)
    columns = (TextColumn("{task.description:12}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=len(wanted))
        done = count()
        found = measure(
            data,
            wanted,
            progress=lambda name: bar.update(task, completed=next(done), description=name),
        )
    if not found.results:
        raise BadInput(
            f"{data}: expected folders of recordings as in docs/recordings.md, found none"
        )
    write_json(out / "accuracy.json", found)
    return found


def print_accuracy(accuracy: Accuracy, console: Console | None = None) -> None:
    """The trials of BROAD, the flights, the targets, and what was not there."""
    console = console or Console()
    console.print(_broad(accuracy))
    console.print(_flights(accuracy))
    console.print(_targets(accuracy))
    if accuracy.skipped:
        console.print(f"skipped, as not there: {', '.join(accuracy.skipped)}")


def _broad(accuracy: Accuracy) -> Table:
    filters = accuracy.filters()
    table = _table("BROAD: total / inclination, deg RMS")
    table.add_column("trial")
    for name in filters:
        table.add_column(name, justify="right")
    names = dict.fromkeys(r.recording for r in accuracy.results if r.recording.startswith(BROAD))
    for trial in names:
        row = [accuracy.of(trial, name) for name in filters]
        table.add_row(
            trial,
            *(_pair(r.score.total_deg, r.score.inclination_deg) if r else "" for r in row),
        )
    table.add_section()
    means = [accuracy.broad_mean(name) for name in filters]
    table.add_row("mean", *(_pair(*mean) if mean else "" for mean in means))
    return table


def _flights(accuracy: Accuracy) -> Table:
    table = _table("Flights: deg RMS; GPS innovations RMS; error after 10 s without GPS, median")
    for column in ("recording", "filter"):
        table.add_column(column, no_wrap=True)
    for column in ("roll", "pitch", "yaw", "GPS m", "m/s", "10 s, m"):
        table.add_column(column, justify="right")
    last = ""
    for r in accuracy.results:
        if r.recording.startswith(BROAD):
            continue
        if last and r.recording != last:
            table.add_section()
        row = [_number(x, 2) for x in (r.score.roll_deg, r.score.pitch_deg, r.score.heading_deg)]
        if r.gps is not None:
            row += [_number(r.gps.position_rms_m, 2), _number(r.gps.velocity_rms_m_s, 3)]
            row += [_number(r.gps.outage_median_m, 2)]
        table.add_row("" if r.recording == last else r.recording, r.filter, *row)
        last = r.recording
    return table


def _targets(accuracy: Accuracy) -> Table:
    table = _table("Targets")
    table.add_column("what")
    for column in ("found", "at most"):
        table.add_column(column, justify="right")
    table.add_column("")
    for target in accuracy.targets():
        digits = 3 if target.limit < 1.0 else 2
        table.add_row(
            target.what,
            _number(target.found, digits),
            f"{target.limit:g} {target.unit}",
            "met" if target.met else "MISSED",
        )
    return table


def _table(title: str) -> Table:
    return Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)


def _pair(total_deg: float, inclination_deg: float) -> str:
    return f"{total_deg:5.2f} / {inclination_deg:5.2f}"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
