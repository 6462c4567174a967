"""One flight of a campaign, and what it was worth by the truth."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from strix import _core
from strix.campaign.kinds import KINDS
from strix.campaign.pilot import Pilot
from strix.campaign.plan import ARM_AT_S, MISSIONS, VEHICLE, Draw
from strix.parameters import parameters
from strix.plant import Plant, SensorSuite, Truth
from strix.plant.earth import MAGNETIC_DECLINATION_RAD
from strix.plant.faults import Fault
from strix.plant.samples import Samples
from strix.simulation import MAG_MOUNTING, STEP_US, TRUTH_EVERY, _deliver
from strix.track import TruthRecorder, TruthTrack
from strix.vehicles import plant_numbers

# Criteria (issue: "none leaves the fence by more than 5 m, none hits the ground above 3 m/s").
MOST_BEYOND_M = 5.0
MOST_CONTACT_M_S = 3.0
LATE_S = 60.0  # after the mission should have landed: a return home at 2 m/s and a landing take 40
AIRBORNE_M = 0.3  # ours: higher than a landing bounces, lower than a take-off ends
RESTS_M_S = 0.2
STOPPED = 0.02  # of the hover speed: rotors that turn down
TRACK_S = 0.5
TEXTS = 12  # of what was said, most


@dataclass(frozen=True)
class Result:
    """A line of flights.jsonl. Times are since power-up; None: it did not happen."""

    index: int
    seed: int
    fault: str
    detail: str
    at_s: float
    mission: str
    heading_deg: float
    wind_m_s: float
    by_radio: bool
    flew: bool
    state: str  # at the end
    end_s: float
    contact_m_s: float | None  # the hardest first contact with the ground after being in the air
    beyond_m: float  # furthest beyond the fence
    reaction_s: float | None  # from the fault to what the state machine did about it
    reaction: str | None
    said: list[str]  # since the fault, each text once, with its time
    failures: list[str]  # criteria that were missed
    track: list[list[float]]  # time s, height m, distance m

    @property
    def fence(self) -> str:
        """Where it was at its furthest."""
        side = "beyond" if self.beyond_m > 0.0 else "inside"
        return f"{abs(self.beyond_m):.1f} m {side} the fence"

    @property
    def passes(self) -> bool:
        return not self.failures

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


class _Aircraft:
    """The flight software in the plant, for faults to reach."""

    def __init__(self, draw: Draw, log_path: Path | None) -> None:
        vehicle = draw.variation.applied_to(plant_numbers(VEHICLE))
        heading_rad = math.radians(draw.heading_deg)
        self.plant = Plant(vehicle, draw.surroundings, heading_rad, draw.noise_seed)
        self.sensors = SensorSuite(draw.surroundings, draw.noise_seed, mag_mounting=MAG_MOUNTING)
        self.pilot = Pilot(ARM_AT_S, draw.by_radio, draw.by_sticks)
        self.hover_speed = vehicle.hover_speed
        self._draw = draw
        self._mission = draw.read_mission()
        self._log_path = log_path
        self._epoch_us = 0  # power-up of the flight software that runs, in the plant's time
        self._storage = b""
        self.flight = self._power_up(restarted=False)

    def _power_up(self, restarted: bool) -> _core.Flight:
        path = self._log_path
        if path is not None and restarted:
            path = path.with_name(path.stem + "-restarted" + path.suffix)
        options = _core.FlightOptions(VEHICLE)
        options.motors_were_on = restarted
        if self._draw.by_radio:
            options.set_parameter("RC_PROTOCOL", 1.0)
        return _core.Flight(
            vehicle=VEHICLE,
            mission=self._mission.name,
            mission_text=self._mission.text,
            declination_rad=MAGNETIC_DECLINATION_RAD,
            log_path="" if path is None else str(path),
            boot_id=(self._draw.noise_seed + restarted) % 2**32,
            start_time_us=0,
            options=options,
            storage=self._storage,
        )

    def pass_of(self, samples: Samples, now_us: int) -> list[float]:
        """One pass of the flight software; its commands."""
        if self._epoch_us:
            samples = _since(samples, self._epoch_us)
        _deliver(self.flight, samples)
        return self.flight.loop(now_us - self._epoch_us)

    # What a fault reaches (strix.plant.faults.Aircraft).
    def stall_card(self, stalled: bool) -> None:
        self.flight.set_card(stalled=stalled, dead=False)

    def kill_card(self) -> None:
        self.flight.set_card(stalled=False, dead=True)

    def silence_radio(self, silent: bool, failsafe: bool) -> None:
        self.pilot.radio_silent, self.pilot.radio_failsafe = silent, failsafe

    def restart(self) -> None:
        motors_on = self.flight.motors_on
        self._storage = self.flight.storage()
        self.flight.close()
        self._epoch_us = self.plant.truth.time_us
        self.flight = self._power_up(restarted=motors_on)

    def switch_kill(self) -> None:
        self.pilot.kill = True


def _since(samples: Samples, epoch_us: int) -> Samples:
    """With the time stamps of a clock that started then; what was measured before is lost."""
    found: dict[str, Any] = {}
    for name in ("imu", "mag", "baro", "gps", "battery", "esc"):
        reading = getattr(samples, name)
        if reading is not None and reading.sampled_us >= epoch_us:
            found[name] = replace(reading, sampled_us=reading.sampled_us - epoch_us)
    return Samples(**found)


class _Judge:
    """Watches the truth in every step."""

    def __init__(self) -> None:
        value = {p.name: p.default for p in parameters()}
        self._radius_m, self._height_m = value["FENCE_RADIUS"], value["FENCE_HEIGHT"]
        self._airborne = False
        self._speed_m_s = 0.0
        self.contact_m_s: float | None = None
        self.beyond_m = -math.inf
        self.track: list[list[float]] = []

    def watch(self, truth: Truth) -> None:
        north, east, down = truth.position_ned_m
        if truth.on_ground:
            if self._airborne:
                self.contact_m_s = max(self.contact_m_s or 0.0, self._speed_m_s)
            self._airborne = False
        elif -down > AIRBORNE_M:
            self._airborne = True
        self._speed_m_s = math.hypot(*truth.velocity_ned_m_s)
        distance_m = math.hypot(north, east)
        beyond_m = max(distance_m - self._radius_m, -down - self._height_m)
        self.beyond_m = max(self.beyond_m, beyond_m)
        if truth.time_us % round(TRACK_S * 1e6) == 0:
            time_s = truth.time_us * 1e-6
            self.track.append([time_s, round(-down, 2), round(distance_m, 2)])

    def rests(self, truth: Truth) -> bool:
        return truth.on_ground and self._speed_m_s < RESTS_M_S


def fly_one(
    draw: Draw,
    log_path: Path | None = None,
    progress: Callable[[float, str], None] = lambda *_: None,
) -> tuple[Result, TruthTrack]:
    """Flies until the pilot is done and the aircraft at rest, or gives up."""
    fault, words = draw.fault()
    aircraft = _Aircraft(draw, log_path)
    plant, pilot, judge = aircraft.plant, aircraft.pilot, _Judge()
    recorder = TruthRecorder()
    hazards = {row["said"] for row in _core.transitions() if row["failsafe"]}
    said: list[tuple[float, str]] = []
    give_up_s = ARM_AT_S + MISSIONS[draw.mission] + LATE_S
    state = _State.BEFORE
    commands = aircraft.flight.loop(0)
    step = 0
    while True:
        time_s = plant.truth.time_us * 1e-6
        state = _turn_on_or_off(fault, state, aircraft, time_s)
        plant.step(commands, STEP_US)
        truth = plant.truth
        time_s = truth.time_us * 1e-6
        commands = aircraft.pass_of(
            fault.spoil(aircraft.sensors.sample(truth), time_s), truth.time_us
        )
        judge.watch(truth)
        step += 1
        if step % TRUTH_EVERY:
            continue
        recorder.add(truth)
        pilot.look(aircraft.flight, truth)
        said += [(time_s, text) for text in aircraft.flight.texts()]
        progress(time_s, aircraft.flight.state_name)
        if time_s >= give_up_s or (pilot.done and judge.rests(truth)):
            break
    stopped = max(truth.rotor_speed) < STOPPED * aircraft.hover_speed
    ended = not aircraft.flight.motors_on and stopped and judge.rests(truth)
    since: dict[str, float] = {}  # each text when it was said first
    for t, text in said:
        if t >= draw.at_s:
            since.setdefault(text, t)
    reaction = next(((t, text) for text, t in since.items() if text in hazards), None)
    failures = _failures(draw, judge, ended=ended, rearmed=pilot.rearmed)
    aircraft.flight.close()
    result = Result(
        index=draw.index,
        seed=draw.seed,
        fault=draw.kind,
        detail=words,
        at_s=draw.at_s,
        mission=draw.mission,
        heading_deg=draw.heading_deg,
        wind_m_s=round(math.hypot(*draw.surroundings.wind_mean_ned_m_s), 2),
        by_radio=draw.by_radio,
        flew=pilot.flew,
        state=aircraft.flight.state_name,
        end_s=round(time_s, 2),
        contact_m_s=None if judge.contact_m_s is None else round(judge.contact_m_s, 3),
        beyond_m=round(judge.beyond_m, 2),
        reaction_s=None if reaction is None else round(reaction[0] - draw.at_s, 2),
        reaction=None if reaction is None else reaction[1],
        said=[f"{t:.2f} s: {text}" for text, t in since.items()][:TEXTS],
        failures=failures,
        track=judge.track,
    )
    return result, recorder.track()


class _State:
    BEFORE, DURING, AFTER = range(3)


def _turn_on_or_off(fault: Fault, state: int, aircraft: _Aircraft, time_s: float) -> int:
    if state == _State.BEFORE and time_s >= fault.at_s:
        fault.begin(aircraft)
        return _State.DURING
    if state == _State.DURING and not fault.active(time_s):
        fault.end(aircraft)
        return _State.AFTER
    return state


def _failures(draw: Draw, judge: _Judge, *, ended: bool, rearmed: bool) -> list[str]:
    """Criteria that were missed, in words."""
    found = []
    if not ended:
        found.append("motors not off, or not on the ground, in time")
    if rearmed:
        found.append("armed again by itself")
    if KINDS[draw.kind].cuts_motors:
        return found
    if judge.beyond_m > MOST_BEYOND_M:
        found.append(f"{judge.beyond_m:.1f} m beyond the fence")
    if (judge.contact_m_s or 0.0) > MOST_CONTACT_M_S:
        found.append(f"hit the ground with {judge.contact_m_s:.1f} m/s")
    return found
