"""A flight in eleven numbers."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from strix.attitude import tilt
from strix.comparison import Comparison
from strix.flightlog import Array, FlightLog
from strix.track import TruthTrack


@dataclass(frozen=True)
class Summary:
    """Keys and units of summary.json. None: there was nothing to measure it on.

    'Flown' is the truth of a simulation; for a real flight it is the estimate, and the two errors
    of the estimate are None.
    """

    landed: bool
    """The last flight ended by touch-down: the controller was on, then the state machine turned
    the motors off without a critical error (only its row LAND to IDLE does), and the truth is on
    the ground at the end."""
    disarmed: bool
    """The motors are off at the end."""
    duration_s: float
    """From the log's first record to its last."""
    wall_s: float
    """Time the simulation took."""
    landing_error_m: float | None
    """Horizontal distance from the start position at the end, as flown."""
    max_tilt_deg: float | None
    """Largest angle from the vertical in flight, as flown. In flight is off the ground once the
    motors were on; for a real flight, while the controller is on."""
    rms_attitude_deg: float | None
    """Total angle between estimate and truth, while the motors are on."""
    rms_position_m: float | None
    """Distance in space between estimate and truth, in flight."""
    rms_tracking_m: float | None
    """Distance in space between flown and reference, in flight with the controller on."""
    log_drops: int
    """Records that the log lost."""
    loop_overruns: int
    """Periods that the flight software's tasks missed."""

    def to_dict(self) -> dict[str, bool | int | float | None]:
        """As in summary.json, which has no word for a number that is not finite."""
        return {
            key: None if isinstance(value, float) and not math.isfinite(value) else value
            for key, value in asdict(self).items()
        }


@dataclass(frozen=True)
class Row:
    """How a number of the summary is shown to a person."""

    key: str
    name: str
    unit: str
    digits: int
    meaning: str


ROWS = (
    Row("landed", "landed", "", 0, "ended by touch-down"),
    Row("disarmed", "disarmed", "", 0, "motors off at the end"),
    Row("duration_s", "duration", "s", 1, "power-up to end of log"),
    Row("wall_s", "wall time", "s", 1, "what the simulation took"),
    Row("landing_error_m", "landing error", "m", 2, "horizontally from the start"),
    Row("max_tilt_deg", "largest tilt", "deg", 1, "from level, in flight"),
    Row("rms_attitude_deg", "attitude error", "deg", 2, "RMS, estimate - truth, motors on"),
    Row("rms_position_m", "position error", "m", 2, "RMS, estimate - truth, in flight"),
    Row("rms_tracking_m", "tracking error", "m", 2, "RMS, flown - reference, in flight"),
    Row("log_drops", "log drops", "", 0, "records lost"),
    Row("loop_overruns", "loop overruns", "", 0, "task periods missed"),
)


def summarise(log: FlightLog, truth: TruthTrack | None, wall_s: float) -> Summary:
    """Measure a flight; BadInput when a topic that this needs is not in the log."""
    flight = Comparison(log, truth)
    motors_on = bool(flight.states["motors_on"][-1])
    on_ground = truth is None or bool(truth.on_ground[-1])
    end_ned_m = flight.flown.position_ned_m[-1:]
    tilts = tilt(flight.flown.attitude)[flight.in_flight(flight.flown.time_s)]
    attitude = position = None
    if flight.errors is not None:
        time_s = flight.errors.time_s
        attitude = rms(flight.errors.attitude_rad[flight.flag("motors_on", time_s)])
        position = rms(flight.errors.position_ned_m[flight.in_flight(time_s)])
    return Summary(
        landed=touched_down(flight) and on_ground,
        disarmed=not motors_on,
        duration_s=log.duration_s,
        wall_s=wall_s,
        landing_error_m=rms(end_ned_m[:, :2]),
        max_tilt_deg=float(np.degrees(tilts.max())) if len(tilts) else None,
        rms_attitude_deg=None if attitude is None else math.degrees(attitude),
        rms_position_m=position,
        rms_tracking_m=rms(flight.tracking_error_ned_m),
        log_drops=int(log.topic("log_status")["dropped"][-1]),
        loop_overruns=int(log.topic("control_tick")["overruns"][-1]),
    )


def touched_down(flight: Comparison) -> bool:
    """True when the last controlled flight in the log ended as a landing does (Summary.landed)."""
    controlled = np.flatnonzero(flight.states["controller_on"])
    if not len(controlled) or controlled[-1] + 1 == len(flight.states.time_s):
        return False
    after = controlled[-1] + 1
    return not flight.states["motors_on"][after] and not flight.states["critical"][after]


def rms(vectors: Array) -> float | None:
    """Root of the mean squared length of the rows."""
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1)))) if len(vectors) else None


def verdict(summary: Summary) -> str:
    """The flight in one sentence."""
    motors = "disarmed" if summary.disarmed else "motors still on"
    if summary.landed:
        distance = summary.landing_error_m
        where = "" if distance is None else f" {distance:.2f} m from the start"
        return f"Landed{where}, {motors}"
    return f"Did not land; {motors} at the end"


def shown(row: Row, summary: Summary) -> tuple[str, str]:
    """The number and its unit as texts."""
    value = getattr(summary, row.key)
    if value is None:
        return "-", ""
    if isinstance(value, bool):
        return "yes" if value else "no", ""
    return f"{value:.{row.digits}f}", row.unit


def rating(row: Row, summary: Summary) -> str:
    """'good' or 'bad' for what is right or wrong, 'warn' for losses, '' for plain numbers."""
    value = getattr(summary, row.key)
    if isinstance(value, bool):
        return "good" if value else "bad"
    return "warn" if row.key in ("log_drops", "loop_overruns") and value else ""


def print_summary(summary: Summary, console: Console | None = None) -> None:
    """A table for eyes and for pipes: no frame, a row a line, colour only on a terminal."""
    styles = {"good": "green", "bad": "bold red", "warn": "yellow", "": ""}
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True, justify="right")
    table.add_column(no_wrap=True)
    table.add_column(style="dim")
    for row in ROWS:
        value, unit = shown(row, summary)
        style = styles[rating(row, summary)]
        table.add_row(row.name, Text(value, style), unit, row.meaning)
    (console or Console()).print(table)
