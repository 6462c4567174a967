"""The flights that are measured: missions of steps, and what is taken from each flight.

Attitude is measured on the truth: how the aircraft moved, whatever it thought. Place is measured
on the estimate, which is all that a controller can hold: what the estimate misses is said apart.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from strix import _core
from strix.attitude import roll_pitch_yaw, tilt
from strix.flightlog import Array, FlightLog, read_flight_log
from strix.missions import Mission, parse_mission
from strix.plant import AS_BUILT, Variation
from strix.plant.sensors import DEFAULT_CONSTANTS
from strix.scenarios import Outcome, find_scenario, judge
from strix.simulation import ARM_AT_S, FlightPlan, fly
from strix.summary import summarise
from strix.track import TruthTrack

STEP_DEG = 30.0
TILT_S, YAW_S = 1.0, 2.0  # held so long
STEP_M = 1.0
PLACE_S = 10.0
HOVER_S = 60.0
# Left out of a hover: what the take-off leaves, and the wind's arrival, die out in about 5 s, as
# `strix gains` says of the integrals.
HOVER_FROM_S = 10.0
BEFORE_S = 0.2  # the attitude that a step starts from is the mean over so long
GRID_S = 0.01  # of responses: as often as truth and estimate are kept


class Kind(StrEnum):
    """What a flight is flown for."""

    ATTITUDE = "attitude"
    PLACE = "place"
    HOVER = "hover"
    WIND = "wind"
    ROBUST = "robust"


# The longer the aircraft waits, the better it knows its start: of GPS's 3 m, 20 s of fixes leave
# 0.22 m north and east, 90 s 0.10 m, and that is in every place it flies to. The other flights are
# not about the place; half of the usual time is enough for the start-up calibration.
ARM_AFTER_S = {
    Kind.ATTITUDE: ARM_AT_S,
    Kind.PLACE: ARM_AT_S,
    Kind.HOVER: 4.5 * ARM_AT_S,
    Kind.WIND: 4.5 * ARM_AT_S,
    Kind.ROBUST: 0.5 * ARM_AT_S,
}


@dataclass(frozen=True)
class Move:
    """One line of a mission, and what is measured on it."""

    text: str
    measures: str = ""  # "roll", "pitch", "yaw", "forward", "up"; "": it only leads on
    start: float = 0.0  # deg or m
    end: float = 0.0
    duration_s: float = 0.0


@dataclass(frozen=True)
class Job:
    """One flight to be made and measured."""

    kind: Kind
    vehicle: str
    heading_deg: float
    seed: int
    variation: Variation = AS_BUILT
    # GPS's noise lies in NED and does not turn with the aircraft. Without it the same seed is the
    # same noise at every heading, as seen from the aircraft.
    quiet_gps: bool = False


@dataclass(frozen=True)
class Hover:
    """Of a hold, without its first seconds; m."""

    offset_ned_m: tuple[float, float, float]  # mean of estimate minus reference
    rms_to_estimate_m: float  # in space
    rms_to_truth_m: tuple[float, float]  # horizontal, vertical


@dataclass(frozen=True)
class Measured:
    """One flight's numbers. Responses go from 0 to 1 and begin with their step."""

    job: Job
    outcome: Outcome
    cut: bool  # it went to SAFE
    largest_tilt_deg: float
    largest_rate_rad_s: float
    responses: dict[str, list[Array]]
    hover: Hover | None


def tilt_steps(axis: str, sign: int, height_m: float) -> list[Move]:
    """There, as far to the other side, where the speed is gone, and back to the place."""
    column = ("roll", "pitch").index(axis)
    there, other = ([0.0, 0.0], [0.0, 0.0])
    there[column], other[column] = sign * STEP_DEG, -sign * STEP_DEG
    return [
        Move(f"attitude {there[0]:g} {there[1]:g} 0 {TILT_S:g}", axis, 0.0, there[column], TILT_S),
        Move(f"attitude {other[0]:g} {other[1]:g} 0 {TILT_S:g}"),
        Move(f"leg 0 0 {height_m:g} 0 2"),
    ]


def yaw_steps(sign: int, height_m: float) -> list[Move]:
    return [
        Move(f"attitude 0 0 {sign * STEP_DEG:g} {YAW_S:g}", "yaw", 0.0, sign * STEP_DEG, YAW_S),
        Move(f"leg 0 0 {height_m:g} 0 2"),
    ]


def place_steps(heading_deg: float, height_m: float, hold_s: float, up: bool) -> list[Move]:
    """Forward and back; and up and back."""
    north = STEP_M * math.cos(math.radians(heading_deg))
    east = STEP_M * math.sin(math.radians(heading_deg))
    forward = f"leg {north:.6f} {east:.6f} {height_m:g} 0 {hold_s:g}"
    back = f"leg 0 0 {height_m:g} 0 {hold_s:g}"
    moves = [
        Move(forward, "forward", 0.0, STEP_M, hold_s),
        Move(back, "forward", STEP_M, 0.0, hold_s),
    ]
    if up:
        high = height_m + STEP_M
        moves += [
            Move(f"leg 0 0 {high:g} 0 {hold_s:g}", "up", height_m, high, hold_s),
            Move(back, "up", high, height_m, hold_s),
        ]
    return moves


def moves_of(job: Job) -> tuple[str, list[Move]]:
    """The take-off, and what follows."""
    if job.kind is Kind.ATTITUDE:
        signs = (1, -1)
        moves = [m for axis in ("roll", "pitch") for s in signs for m in tilt_steps(axis, s, 4.0)]
        return "takeoff 4 2", moves + [m for s in signs for m in yaw_steps(s, 4.0)]
    if job.kind is Kind.PLACE:
        return "takeoff 2 5", place_steps(job.heading_deg, 2.0, PLACE_S, up=True)
    if job.kind is Kind.ROBUST:
        return "takeoff 3 1", [
            *tilt_steps("roll", 1, 3.0),
            *tilt_steps("pitch", -1, 3.0),
            *yaw_steps(1, 3.0),
            *place_steps(job.heading_deg, 3.0, 6.0, up=False)[:1],
        ]
    return f"takeoff 2 {HOVER_S:g}", []


def mission_of(takeoff: str, moves: Sequence[Move]) -> Mission:
    text = "\n".join([takeoff, *(move.text for move in moves), "land\n"])
    return parse_mission("handling", text, "handling")


def fly_and_measure(job: Job) -> Measured:
    with tempfile.TemporaryDirectory() as folder:
        return fly_into(job, Path(folder) / "flight.ulg")[0]


def fly_into(job: Job, path: Path) -> tuple[Measured, FlightLog, TruthTrack]:
    """Leaves the log there."""
    takeoff, moves = moves_of(job)
    scenario = find_scenario("hover-wind" if job.kind is Kind.WIND else "calm")
    sensors = DEFAULT_CONSTANTS
    if job.quiet_gps:
        sensors = replace(sensors, gps_position_sigma_m=0.0, gps_velocity_sigma_m_s=0.0)
    plan = FlightPlan(
        job.vehicle,
        mission_of(takeoff, moves),
        replace(scenario, variation=job.variation),
        job.heading_deg,
        job.seed,
        sensors,
        ARM_AFTER_S[job.kind],
    )
    track = fly(plan, path, lambda *_: None)
    log = read_flight_log(path)
    return measure(job, moves, log, track), log, track


def measure(job: Job, moves: Sequence[Move], log: FlightLog, track: TruthTrack) -> Measured:
    states = log.topic("flight_state")
    begun_s = entries(log, "WAYPOINT")
    responses: dict[str, list[Array]] = {}
    for move, begin_s in zip(moves, begun_s, strict=False):  # a flight that was cut has fewer
        if move.measures:
            found = response(job, move, begin_s, log, track)
            responses.setdefault(move.measures, []).append(found)
    flying = ~track.on_ground
    return Measured(
        job=job,
        outcome=judge(log, track, summarise(log, track, 0.0)),
        cut=bool(states["critical"].any()),
        largest_tilt_deg=math.degrees(tilt(track.attitude)[flying].max(initial=0.0)),
        largest_rate_rad_s=float(
            np.linalg.norm(track.rate_body_rad_s[flying], axis=1).max(initial=0.0)
        ),
        responses=responses,
        hover=None if moves else hover(log, track),
    )


def entries(log: FlightLog, state: str) -> Array:
    """When the state was entered."""
    states = log.topic("flight_state")
    there = states["state"] == _core.state_names().index(state)
    return np.asarray(states.time_s[1:][there[1:] & ~there[:-1]])


def grid(duration_s: float) -> Array:
    return np.asarray(np.arange(round(duration_s / GRID_S)) * GRID_S, dtype=np.float64)


def response(job: Job, move: Move, begin_s: float, log: FlightLog, track: TruthTrack) -> Array:
    at_s = begin_s + grid(move.duration_s)
    if move.measures in ("roll", "pitch", "yaw"):
        column = ("roll", "pitch", "yaw").index(move.measures)
        angle = np.degrees(np.unwrap(roll_pitch_yaw(track.attitude)[:, column]))
        before = (track.time_s > begin_s - BEFORE_S) & (track.time_s <= begin_s)
        start = float(angle[before].mean())
        # Roll and pitch are wanted from level, whatever they were; yaw from what it was.
        end = start + move.end if move.measures == "yaw" else move.end
        value = np.interp(at_s, track.time_s, angle)
    else:
        place = log.topic("vehicle_local_position")
        heading = math.radians(job.heading_deg)
        along = (
            math.cos(heading) * place["x"] + math.sin(heading) * place["y"]
            if move.measures == "forward"
            else -place["z"]
        )
        start, end = move.start, move.end
        value = np.interp(at_s, place.time_s, along)
    return np.asarray((value - start) / (end - start))


def hover(log: FlightLog, track: TruthTrack) -> Hover | None:
    """None when the aircraft did not hold long enough."""
    begin_s = entries(log, "HOLD")
    end_s = entries(log, "LAND")
    place = log.topic("vehicle_local_position")
    if not len(begin_s) or not len(end_s):
        return None
    at = (place.time_s >= begin_s[0] + HOVER_FROM_S) & (place.time_s < end_s[0])
    time_s = place.time_s[at]
    wanted = log.topic("trajectory_setpoint")
    reference = np.column_stack(
        [np.interp(time_s, wanted.time_s, wanted["position"][:, i]) for i in range(3)]
    )
    error = np.column_stack([place[f][at] for f in "xyz"]) - reference
    missed = track.at(time_s, track.position_ned_m) - reference
    north, east, down = error.mean(axis=0)
    return Hover(
        (float(north), float(east), float(down)),
        float(np.sqrt(np.mean(np.sum(error**2, axis=1)))),
        (
            float(np.sqrt(np.mean(np.sum(missed[:, :2] ** 2, axis=1)))),
            float(np.sqrt(np.mean(missed[:, 2] ** 2))),
        ),
    )
