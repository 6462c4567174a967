"""`strix consistency`: is the flight filter as good as it says it is?

The filter flies simulated flights (ideal_flight.py) that obey its own model. Then two things are
chi-square distributed: with 9 or 18 degrees of freedom NEES, e^T P^-1 e with e the true error, and
with 1 the NIS of every scalar measured, (z - h)^2 / variance, independent of all others.

Three kinds of flight (ideal_flight.Kind). Tilt is used only where the aircraft does not accelerate:
elsewhere the update takes specific force for gravity, and is wrong by construction. Its samples
have noise of their own; on the aircraft they are those that predict integrates, so that one noise
goes two ways and is counted as if it were two.

For each of these series the mean over all flights is formed once a second (of NIS: of all scalars
of that second) and compared with its two-sided 95 % chi-square interval. A series is consistent if

1. as many seconds lie inside as a consistent filter reaches 999 times in 1000 (binomial),
2. the mean over flights and seconds lies inside its 99.9 % interval, and
3. no second lies outside an interval that a consistent filter leaves once in 1000 runs,

where NIS has no memory but NEES has: a position error of now is one of ten seconds from now. Only
flights are independent. So the interval of 2 is Student's, of the mean of the flights' means, and
in 1 as many seconds count as would scatter those means as much if they were independent.
With other seeds, a consistent filter fails in one of the 26 series in at most 26 x 0.3 % = 7.8 %
of all runs.

Endurance: one quiet flight, whose P is the smallest, for hours. P is symmetric because only one
triangle is stored; it is positive definite when it has a Cholesky factor in double precision, and
the smallest eigenvalue of its correlation matrix says how far from failing it is.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from scipy.stats import binom, chi2
from scipy.stats import t as student

from strix import _core
from strix.errors import BadInput
from strix.ideal_flight import SECOND, STEP_US, Array, Flight, Kind
from strix.plant.earth import MAGNETIC_FIELD_NED_UT

SHARE_INSIDE = 0.95
FALSE_ALARM = 0.001
FLIGHT_S = 60
ENDURANCE_PIECE_S = 60  # flown in one call
SENSORS = ("tilt", "mag", "alt", "gps")

Ticks = Callable[[int], None]  # seconds flown


@dataclass(frozen=True)
class Case:
    """A filter and a kind of flight."""

    states: int
    kind: Kind

    @property
    def name(self) -> str:
        """For tables and charts."""
        return f"{self.states} states, {self.kind.value}"


CASES = tuple(Case(states, kind) for states in (9, 18) for kind in Kind)


@dataclass(frozen=True)
class Series:
    """What should be chi-square distributed: a row a flight, a column a second."""

    name: str
    dof: int
    values: Array


@dataclass(frozen=True)
class Judgement:
    """A series against its bounds; all values are divided by the degrees of freedom: 1 is right."""

    case: str
    name: str
    dof: int
    mean: float
    mean_95: tuple[float, float]
    mean_limits: tuple[float, float]
    independent_s: float  # so many seconds of a flight are worth independent ones
    inside: float  # share of the seconds inside bounds_95
    inside_needed: float
    bounds_95: tuple[float, float]  # of each second
    limits: tuple[float, float]  # of all seconds
    each_second: list[float]

    @property
    def consistent(self) -> bool:
        """As the module's first words define it."""
        return (
            self.inside >= self.inside_needed
            and self.mean_limits[0] < self.mean < self.mean_limits[1]
            and self.limits[0] < min(self.each_second)
            and max(self.each_second) < self.limits[1]
        )


@dataclass(frozen=True)
class Endurance:
    """P over one long flight, looked at once a second."""

    states: int
    hours: float
    looks: int
    not_positive_definite: int
    smallest_eigenvalue: float  # of the correlation matrix
    mean_nees: float  # divided by the degrees of freedom


@dataclass(frozen=True)
class Consistency:
    """All that `strix consistency` finds."""

    flights: int
    flight_s: int
    seed: int
    judgements: list[Judgement]
    not_positive_definite: int  # looks at P in the flights
    endurance: list[Endurance]

    @property
    def consistent(self) -> bool:
        """The verdict."""
        definite = self.not_positive_definite == 0 and all(
            run.not_positive_definite == 0 for run in self.endurance
        )
        return definite and all(judgement.consistent for judgement in self.judgements)

    def to_dict(self) -> dict[str, Any]:
        """For consistency.json."""
        found = asdict(self)
        for judgement, row in zip(self.judgements, found["judgements"], strict=True):
            row["consistent"] = judgement.consistent
        return {"consistent": self.consistent, **found}


def check(
    flights: int, flight_s: int, endurance_s: int, seed: int, tick: Ticks = lambda _: None
) -> Consistency:
    """Flies everything."""
    judgements = []
    indefinite = 0
    for case in CASES:
        nees, *nis = series_of(_records(case, flights, flight_s, seed, tick))
        indefinite += int(np.isnan(nees.values).sum())
        judgements += [judge(case.name, series) for series in (nees, *nis)]
    endurance = [endure(states, endurance_s, seed, tick) for states in (9, 18)]
    return Consistency(flights, flight_s, seed, judgements, indefinite, endurance)


def _records(
    case: Case, flights: int, flight_s: int, seed: int, tick: Ticks
) -> Iterator[_core.ConsistencyRecord]:
    for number in range(flights):
        rng = np.random.default_rng([seed, case.states, *case.kind.value.encode(), number])
        flight = Flight(case.states, case.kind, rng)
        yield from fly(flight, flight.config, flight_s, flight_s)
        tick(flight_s)


def fly(
    flight: Flight, claimed: _core.NavigationConfig, seconds: int, piece_s: int
) -> Iterator[_core.ConsistencyRecord]:
    """The filter on a flight, piece by piece. `claimed` is what the filter believes of the noise;
    it is consistent when that is what the flight was made with.
    """
    run = _core.FilterRun9 if flight.states == 9 else _core.FilterRun18
    field = np.array(MAGNETIC_FIELD_NED_UT, np.float32)
    filter_run = run(claimed, flight.estimate[0].astype(np.float32), field, 0)
    for begin_s in range(0, seconds, piece_s):
        said = flight.fly(min(piece_s, seconds - begin_s) * SECOND)
        yield filter_run.run(
            STEP_US, said.accel, said.gyro, said.tilt, said.mag, said.alt, said.gps, said.truth
        )


def series_of(records: Iterable[_core.ConsistencyRecord]) -> list[Series]:
    """NEES first, then the NIS of each sensor that was used; a record a flight."""
    rows: dict[tuple[str, int], list[Array]] = {}
    for record in records:
        seconds, states = record.error.shape
        rows.setdefault(("NEES", states), []).append(record.nees)
        for sensor in SENSORS:
            nis = getattr(record, sensor + "Nis").reshape(seconds, -1)
            if nis.size > 0:
                sums = nis.sum(axis=1, dtype=np.float64)
                rows.setdefault((f"NIS {sensor}", nis.shape[1]), []).append(sums)
    return [Series(name, dof, np.array(values)) for (name, dof), values in rows.items()]


def judge(case: str, series: Series) -> Judgement:
    """Compares with the chi-square distribution."""
    flights, seconds = series.values.shape
    each_second = series.values.mean(axis=0) / series.dof
    low, high = bounds_95 = interval(SHARE_INSIDE, flights * series.dof)
    each_flight = series.values.mean(axis=1) / series.dof
    scatter = float(each_flight.std(ddof=1))
    # The mean of n chi-square variables, each divided by its dof, has the variance 2/(n dof).
    independent = np.nan_to_num(2.0 / (series.dof * scatter**2), nan=1.0)
    independent = float(np.clip(independent, 1.0, seconds))

    def around_one(share: float) -> tuple[float, float]:
        half = float(student.ppf(0.5 + 0.5 * share, flights - 1)) * scatter / math.sqrt(flights)
        return 1.0 - half, 1.0 + half

    return Judgement(
        case=case,
        name=series.name,
        dof=series.dof,
        mean=float(each_second.mean()),
        mean_95=around_one(SHARE_INSIDE),
        mean_limits=around_one(1.0 - FALSE_ALARM),
        independent_s=independent,
        inside=float(np.mean((each_second > low) & (each_second < high))),
        inside_needed=float(binom.ppf(FALSE_ALARM, int(independent), SHARE_INSIDE))
        / int(independent),
        bounds_95=bounds_95,
        limits=interval(1.0 - FALSE_ALARM / seconds, flights * series.dof),
        each_second=each_second.tolist(),
    )


def interval(share: float, dof: float) -> tuple[float, float]:
    """Two-sided, of a chi-square variable divided by its degrees of freedom."""
    tail = 0.5 * (1.0 - share)
    low, high = chi2.ppf([tail, 1.0 - tail], dof) / dof
    return float(low), float(high)


def endure(states: int, seconds: int, seed: int, tick: Ticks = lambda _: None) -> Endurance:
    """One long flight; the filter's 32-bit microseconds wrap in it every 71.6 min."""
    rng = np.random.default_rng([seed, states])
    flight = Flight(states, Kind.QUIET, rng)
    # A first velocity of 0.1 m/s would carry it 1.4 km. From 2 km on float32 rounds each step of
    # the position to 0.2 mm: noise of some cm/s that no P knows of, and not the question here.
    flight.drift[:] = 0.0
    nees: list[float] = []
    eigenvalue = np.inf
    for record in fly(flight, flight.config, seconds, ENDURANCE_PIECE_S):
        nees += record.nees.tolist()
        eigenvalue = min(eigenvalue, float(record.eigenvalue.min()))
        tick(len(record.nees))
    indefinite = int(np.isnan(nees).sum())
    mean = float(np.mean(nees)) / states
    return Endurance(states, seconds / 3600.0, len(nees), indefinite, eigenvalue, mean)


def check_and_report(flights: int, hours: float, seed: int, out: Path) -> Consistency:
    """Shows how far it is; leaves consistency.json and consistency.html in `out`."""
    endurance_s = round(3600.0 * hours)
    columns = (TextColumn("consistency"), BarColumn(), TimeRemainingColumn(), TextColumn("to go"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=len(CASES) * flights * FLIGHT_S + 2 * endurance_s)
        found = check(flights, FLIGHT_S, endurance_s, seed, lambda s: bar.advance(task, s))
    write(out, found)
    return found


def write(out: Path, found: Consistency) -> None:
    """Leaves consistency.json and consistency.html in `out`."""
    from strix.report.consistency_page import write_page  # which reads this module's types

    try:
        out.mkdir(parents=True, exist_ok=True)
        text = json.dumps(found.to_dict(), indent=1) + "\n"
        (out / "consistency.json").write_text(text, encoding="utf-8")
        write_page(out / "consistency.html", found)
    except OSError as error:
        raise BadInput(
            f"{out}: expected a folder that can be written, found: {error.strerror}"
        ) from None


def print_consistency(found: Consistency) -> None:
    """The tables that `strix consistency` prints."""
    console = Console(highlight=False)
    table = Table(title=f"{found.flights} flights of {found.flight_s} s; 1 is right")
    for name in ("filter and flights", "series"):
        table.add_column(name)
    for name in ("mean", "95 % bounds", "seconds inside", "needed"):
        table.add_column(name, justify="right")
    table.add_column("")
    for row in found.judgements:
        low, high = row.mean_95
        table.add_row(
            *(row.case, row.name, f"{row.mean:.4f}", f"{low:.4f} to {high:.4f}"),
            *(f"{row.inside:.0%}", f"{row.inside_needed:.0%}"),
            "consistent" if row.consistent else "[bold]NOT CONSISTENT[/]",
        )
    console.print(table)
    for run in found.endurance:
        console.print(
            f"{run.states} states, {run.hours:g} h: P positive definite at "
            f"{run.looks - run.not_positive_definite} of {run.looks} looks, smallest eigenvalue of "
            f"its correlation matrix {run.smallest_eigenvalue:.1e}, mean NEES {run.mean_nees:.3f}"
        )
    console.print("consistent" if found.consistent else "NOT CONSISTENT")
