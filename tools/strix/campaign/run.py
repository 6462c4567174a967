"""Flies a campaign on all cores or on a cluster, and keeps every flight as soon as it is flown."""

from __future__ import annotations

import hashlib
import importlib
import json
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

import strix
from strix import _core
from strix.campaign.flight import Result, fly_one
from strix.campaign.plan import draw, kinds_of
from strix.errors import BadInput
from strix.fly import make_writable

FLIGHTS, SETTINGS = "flights.jsonl", "campaign.json"


@dataclass(frozen=True)
class Settings:
    """What a flight's line depends on, besides its number."""

    seed: int
    faults: tuple[str, ...]
    software: str  # software()


@dataclass(frozen=True)
class Campaign:
    """The flights that were flown, in the order of their numbers."""

    settings: Settings
    wanted: int
    flights: list[Result]

    @property
    def complete(self) -> bool:
        return len(self.flights) == self.wanted

    @property
    def passes(self) -> bool:
        return self.complete and all(flight.passes for flight in self.flights)


@cache
def software() -> str:
    """What flies here, by its bytes: the flight software, and the world and the plan around it."""
    package = Path(strix.__file__).parent
    sources = [path for name in ("plant", "campaign") for path in (package / name).glob("*.py")]
    digest = hashlib.sha256()
    for path in [Path(_core.__file__), *sorted(sources)]:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def flown(settings: Settings, index: int) -> Result:
    """One flight, determined by its arguments alone; runs in another process or on a cluster."""
    if software() != settings.software:
        raise RuntimeError(f"this worker has other software: {software()}, not {settings.software}")
    return fly_one(draw(settings.seed, index, settings.faults))[0]


def fly_campaign(
    faults: str,
    count: int,
    seed: int,
    out: Path,
    processes: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
) -> Campaign:
    """Leaves campaign.json, flights.jsonl, campaign.csv and campaign.html in `out`.

    An interrupt leaves what was flown, to be resumed.
    """
    from strix.campaign.page import write_page
    from strix.campaign.table import write_csv

    settings = Settings(seed, tuple(kinds_of(faults)), software())
    make_writable(out)
    done = _begun(out, settings) if resume else _begin(out, settings)
    done = {index: result for index, result in done.items() if index < count}
    missing = [index for index in range(count) if index not in done]
    try:
        with (out / FLIGHTS).open("a", encoding="utf-8") as lines, _bar(count, len(done)) as tick:
            for result in _fly_all(settings, missing, processes, scheduler):
                lines.write(json.dumps(result.to_dict()) + "\n")
                lines.flush()
                done[result.index] = result
                tick()
    finally:
        campaign = Campaign(settings, count, [done[index] for index in sorted(done)])
        write_csv(out / "campaign.csv", campaign)
        write_page(out / "campaign.html", campaign)
    return campaign


def fly_again(faults: str, index: int, seed: int, out: Path) -> Result:
    """One flight of a campaign; leaves its log and report in `out`."""
    from strix.flightlog import read_flight_log
    from strix.report import write_report
    from strix.summary import summarise

    make_writable(out)
    log_path = out / "flight.ulg"
    result, track = fly_one(draw(seed, index, kinds_of(faults)), log_path)
    log = read_flight_log(log_path)
    write_report(out / "report.html", log, track, summarise(log, track, 0.0))
    return result


def _begin(out: Path, settings: Settings) -> dict[int, Result]:
    if (out / FLIGHTS).exists():
        raise BadInput(
            f"--out {out}: expected a folder without a campaign, found {FLIGHTS}; go on with it by "
            "--resume, or name another folder"
        )
    text = json.dumps(asdict(settings), indent=2) + "\n"
    (out / SETTINGS).write_text(text, encoding="utf-8")
    return {}


def _begun(out: Path, settings: Settings) -> dict[int, Result]:
    """What was flown; refuses a campaign with other settings. A line that was cut off is flown
    again.
    """
    before = _read_settings(out / SETTINGS)
    for name, now in asdict(settings).items():
        was = before.get(name)
        if was != (list(now) if isinstance(now, tuple) else now):
            option = {"seed": "--seed", "faults": "--faults", "software": "software"}[name]
            raise BadInput(
                f"--resume: {out / SETTINGS}: expected the same {option}, found {was}, now {now}"
            )
    path = out / FLIGHTS
    if not path.exists():
        return {}
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        path.write_text(whole, encoding="utf-8")
    found: dict[int, Result] = {}
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            result = Result(**json.loads(line))
        except (ValueError, TypeError) as error:
            raise BadInput(f"{path}, line {number}: expected a flight, found: {error}") from None
        found[result.index] = result
    return found


def _read_settings(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadInput(f"--resume: {path}: expected a campaign's settings: {error}") from None
    if not isinstance(found, dict):
        raise BadInput(f"--resume: {path}: expected an object, found {type(found).__name__}")
    return found


def _fly_all(
    settings: Settings, indices: list[int], processes: int | None, scheduler: str | None
) -> Iterator[Result]:
    """In any order."""
    if not indices:
        return
    job = partial(flown, settings)
    if scheduler is not None:
        yield from _on_cluster(job, indices, scheduler)
        return
    # Spawned, not forked: each process loads its own compiled core.
    spawn = multiprocessing.get_context("spawn")
    workers = min(processes or os.cpu_count() or 1, len(indices))
    with ProcessPoolExecutor(workers, spawn, initializer=_ignore_interrupts) as pool:
        flights = [pool.submit(job, index) for index in indices]
        try:
            for flight in as_completed(flights):
                yield flight.result()
        except BrokenProcessPool:
            raise BadInput(
                "a process was ended from outside while it flew; what was flown is kept: go on by "
                "--resume"
            ) from None
        finally:
            pool.shutdown(cancel_futures=True)


def _ignore_interrupts() -> None:
    """Ctrl-C is the parent's to answer: it lets those in the air land, and starts no other."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _on_cluster(
    job: Callable[[int], Result], indices: Iterable[int], scheduler: str
) -> Iterator[Result]:
    try:
        dask: Any = importlib.import_module("dask.distributed")
    except ImportError:
        raise BadInput(
            "--scheduler: expected Dask to be installed; install it by: pip install 'strix[dask]'"
        ) from None
    try:
        client = dask.Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        raise BadInput(
            f"--scheduler: expected a Dask scheduler such as tcp://127.0.0.1:8786 that answers, "
            f"found '{scheduler}': {error}"
        ) from None
    with client:
        # A flight of the same settings is the same flight; it must not come from a cache all the
        # same: pure=False.
        futures = client.map(job, list(indices), pure=False)
        for future in dask.as_completed(futures):
            yield future.result()
            future.release()


@contextmanager
def _bar(count: int, done: int) -> Iterator[Callable[[], None]]:
    columns = (TextColumn("campaign"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("", total=count, completed=done)
        yield lambda: bar.advance(task)
