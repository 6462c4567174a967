"""A simulated flight of UgglanQ450 with its own pipeline: a simulated pilot flies by the sticks.

The pilot is the only one who knows height and place: he sees the aircraft (the plant's truth, ten
times a second and 0.15 s late) and moves the sticks; the flight software keeps the attitude.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from strix import _core
from strix.plant import Plant, SensorConstants, SensorSuite, Surroundings, Truth
from strix.plant.earth import MAGNETIC_DECLINATION_RAD
from strix.plant.samples import Samples
from strix.plant.sensors import DEFAULT_CONSTANTS
from strix.simulation import MAG_MOUNTING, STEP_US, TRUTH_EVERY
from strix.track import TruthRecorder, TruthTrack
from strix.vehicles import plant_numbers

VEHICLE = "UgglanQ450"
FULL_TILT_RAD = math.pi / 8.0  # at full stick (lib/Control/StickMapping.h)
FULL_YAW_RATE_RAD_S = math.pi
FULL_THRUST_N = 20.0

LOOK_US = 100_000  # how often the pilot looks
REACTION_US = 150_000  # and how old what he acts on is; ours: of a practised pilot who watches
ARM_AT_S = 5.0  # the aircraft stands still until then, for its start-up calibration
GIVE_UP_S = 90.0
_NOT_TOLD = (math.nan,) * 4


class Phase(StrEnum):
    """What the pilot is about."""

    WAITS = "waits"
    ARMS = "arms"
    LIFTS = "lifts"  # raises the throttle until the aircraft leaves the ground
    HOVERS = "hovers"
    ROLLS = "rolls"
    AFTER_ROLL = "after roll"
    PITCHES = "pitches"
    AFTER_PITCH = "after pitch"
    LANDS = "lands"
    DOWN = "down"
    DONE = "done"


@dataclass(frozen=True)
class Programme:
    """What the pilot wants to fly."""

    height_m: float = 2.0
    climb_m_s: float = 0.5
    hover_s: float = 20.0
    tilt_rad: float = math.radians(10.0)
    tilt_s: float = 1.0
    recover_s: float = 8.0  # back to the place after each
    sink_m_s: float = 0.4


@dataclass(frozen=True)
class Sticks:
    """As strix._core's UgglanFlight takes them."""

    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    throttle: float = 0.0


class Pilot:
    """Steers by what he sees. The gains are ours: what a loop with 0.2 s of eye and hand and half
    a second of aircraft allows. Positions in m, NED; the place is where the aircraft stood.
    """

    _PLACE_PER_S2 = 0.25
    _SPEED_PER_S = 0.9
    _PLACE_TRIM_PER_S3 = 0.03
    _HEIGHT_PER_S2 = 1.2
    _SINK_PER_S = 1.8
    _THROTTLE_TRIM_PER_S3 = 0.15
    _HEADING_PER_S = 0.8
    _MOST_TILT_RAD = math.radians(12.0)
    _LIFT_PER_S = 0.1  # of the throttle's way
    _LIFT_LATE_S = 0.4  # by when he sees it lift: eye, hand, motors and the first 3 cm

    def __init__(self, programme: Programme, heading_rad: float, mass_kg: float) -> None:
        self._programme = programme
        self._heading_rad = heading_rad
        self._throttle_per_m_s2 = mass_kg / FULL_THRUST_N  # how it answers: he knows his aircraft
        self._since_s = 0.0
        self._height_m = 0.0  # where he wants it now
        self._hover_throttle = 0.0  # he finds it when it lifts
        self._trim = np.zeros(2)  # m/s^2, heading frame
        self._reached_s: float | None = None
        self.phase = Phase.WAITS

    def look(self, seen: Truth, now_s: float, armed: bool) -> Sticks:
        """Sticks for the next tenth of a second."""
        self._advance(seen, now_s, armed)
        dt = LOOK_US * 1e-6
        p = self._programme
        if self.phase == Phase.LIFTS:
            self._hover_throttle += self._LIFT_PER_S * dt
            return Sticks(throttle=self._hover_throttle)
        if self.phase in (Phase.WAITS, Phase.ARMS, Phase.DOWN, Phase.DONE):
            return Sticks()
        if self.phase == Phase.LANDS:
            self._height_m -= p.sink_m_s * dt
            sink_m_s = p.sink_m_s
        else:
            sink_m_s = -p.climb_m_s if self._height_m < p.height_m else 0.0
            self._height_m = min(p.height_m, self._height_m + p.climb_m_s * dt)

        up_m = -seen.position_ned_m[2]
        error_m = self._height_m - up_m
        self._hover_throttle += self._THROTTLE_TRIM_PER_S3 * error_m * dt * self._throttle_per_m_s2
        up_m_s2 = self._HEIGHT_PER_S2 * error_m + self._SINK_PER_S * (
            seen.velocity_ned_m_s[2] - sink_m_s
        )
        throttle = self._hover_throttle + self._throttle_per_m_s2 * up_m_s2

        yaw_rad = _heading(seen)
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        to_heading = np.array([[c, s], [-s, c]])  # forward, right
        away_m = to_heading @ np.array(seen.position_ned_m[:2])
        speed_m_s = to_heading @ np.array(seen.velocity_ned_m_s[:2])
        wanted_m_s2 = -self._PLACE_PER_S2 * away_m - self._SPEED_PER_S * speed_m_s
        if self.phase not in (Phase.ROLLS, Phase.PITCHES):
            self._trim = np.clip(self._trim - self._PLACE_TRIM_PER_S3 * away_m * dt, -1.0, 1.0)
        forward, right = (wanted_m_s2 + self._trim) / 9.80665
        limit = self._MOST_TILT_RAD
        roll_rad = p.tilt_rad if self.phase == Phase.ROLLS else float(np.clip(right, -limit, limit))
        pitch_rad = (
            p.tilt_rad if self.phase == Phase.PITCHES else float(np.clip(-forward, -limit, limit))
        )
        turn_rad = math.remainder(self._heading_rad - yaw_rad, 2.0 * math.pi)
        return Sticks(
            roll=roll_rad / FULL_TILT_RAD,
            pitch=pitch_rad / FULL_TILT_RAD,
            yaw=min(1.0, max(-1.0, self._HEADING_PER_S * turn_rad / FULL_YAW_RATE_RAD_S)),
            throttle=min(1.0, max(0.0, throttle)),
        )

    def _advance(self, seen: Truth, now_s: float, armed: bool) -> None:
        p, waited_s = self._programme, now_s - self._since_s
        up_m = -seen.position_ned_m[2]
        if self.phase == Phase.HOVERS and self._reached_s is None and up_m > 0.9 * p.height_m:
            self._reached_s = now_s
        hovered_s = 0.0 if self._reached_s is None else now_s - self._reached_s
        steps: dict[Phase, tuple[bool, Phase]] = {
            Phase.WAITS: (now_s >= ARM_AT_S, Phase.ARMS),
            Phase.ARMS: (armed and waited_s > 1.0, Phase.LIFTS),
            Phase.LIFTS: (up_m > 0.03, Phase.HOVERS),
            Phase.HOVERS: (hovered_s > p.hover_s, Phase.ROLLS),
            Phase.ROLLS: (waited_s > p.tilt_s, Phase.AFTER_ROLL),
            Phase.AFTER_ROLL: (waited_s > p.recover_s, Phase.PITCHES),
            Phase.PITCHES: (waited_s > p.tilt_s, Phase.AFTER_PITCH),
            Phase.AFTER_PITCH: (waited_s > p.recover_s, Phase.LANDS),
            Phase.LANDS: (seen.on_ground, Phase.DOWN),
            Phase.DOWN: (waited_s > 1.0, Phase.DONE),
        }
        done, after = steps.get(self.phase, (False, self.phase))
        if done:
            self.phase, self._since_s = after, now_s
            if after == Phase.HOVERS:
                self._hover_throttle -= self._LIFT_PER_S * self._LIFT_LATE_S
                self._height_m = up_m

    @property
    def arm_switch(self) -> bool:
        return self.phase not in (Phase.WAITS, Phase.DONE)


@dataclass(frozen=True)
class UgglanResult:
    """What happened; begins are log times of the pilot's phases, s."""

    track: TruthTrack
    begins_s: dict[Phase, float]
    touch_down_m_s: float  # speed just before the first ground after the hover; NaN: none
    motors_off: bool  # at the end
    voltage_v: float  # what the flight software knows of its battery
    end_s: float

    def during(self, begin: Phase, end: Phase) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Samples of the track from the begin of one phase to the begin of another."""
        t = self.track.time_s
        return (t >= self.begins_s[begin]) & (t < self.begins_s[end])


def fly_ugglan(
    heading_deg: float,
    seed: int,
    log_path: Path,
    surroundings: Surroundings | None = None,
    programme: Programme | None = None,
    sensors: SensorConstants = DEFAULT_CONSTANTS,
    progress: Callable[[float, str], None] | None = None,
) -> UgglanResult:
    """Flies the programme, or gives up; the log is what the card would hold."""
    around = surroundings or Surroundings()
    vehicle = plant_numbers(VEHICLE)
    plant = Plant(vehicle, around, math.radians(heading_deg), seed)
    suite = SensorSuite(around, seed, sensors, MAG_MOUNTING, vehicle.escs_answer)
    flight = _core.UgglanFlight(MAGNETIC_DECLINATION_RAD, str(log_path), seed, plant.truth.time_us)
    pilot = Pilot(programme or Programme(), math.radians(heading_deg), vehicle.mass_kg)
    recorder = TruthRecorder()
    recent: deque[Truth] = deque()
    begins_s: dict[Phase, float] = {Phase.WAITS: 0.0}
    touch_down_m_s, speed_m_s = math.nan, 0.0
    flight.set_sticks(0.0, 0.0, 0.0, 0.0, True)
    commands = flight.loop(plant.truth.time_us)
    step = 0
    while True:
        plant.step(commands, STEP_US)
        truth = plant.truth
        _deliver(flight, suite.sample(truth))
        commands = flight.loop(truth.time_us)
        if pilot.phase == Phase.LANDS and truth.on_ground and math.isnan(touch_down_m_s):
            touch_down_m_s = speed_m_s
        speed_m_s = math.hypot(*truth.velocity_ned_m_s)
        step += 1
        if step % TRUTH_EVERY == 0:
            recorder.add(truth)
            recent.append(truth)
        if truth.time_us % LOOK_US == 0:
            while len(recent) > 1 and recent[1].time_us <= truth.time_us - REACTION_US:
                recent.popleft()
            now_s, before = truth.time_us * 1e-6, pilot.phase
            s = pilot.look(recent[0], now_s, flight.motors_on)
            flight.set_sticks(s.roll, s.pitch, s.yaw, s.throttle, True)
            flight.set_switches(pilot.arm_switch, False)
            if pilot.phase != before:
                begins_s[pilot.phase] = now_s
            if progress is not None:
                progress(now_s, pilot.phase.value)
            done_s = begins_s.get(Phase.DONE, math.inf)
            if now_s > GIVE_UP_S or now_s > done_s + 1.0:
                break
    flight.close()
    return UgglanResult(
        track=recorder.track(),
        begins_s=begins_s,
        touch_down_m_s=touch_down_m_s,
        motors_off=not flight.motors_on,
        voltage_v=flight.voltage_v,
        end_s=plant.truth.time_us * 1e-6,
    )


def _heading(truth: Truth) -> float:
    w, x, y, z = truth.q_body_to_ned
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _deliver(flight: _core.UgglanFlight, samples: Samples) -> None:
    """Hands over what became ready since the last step; this aircraft has no use for GPS."""
    if (imu := samples.imu) is not None:
        flight.put_imu(imu.sampled_us, imu.accel_m_s2, imu.gyro_rad_s, 25.0)
    if (mag := samples.mag) is not None:
        flight.put_mag(mag.sampled_us, mag.field_ut)
    if (baro := samples.baro) is not None:
        flight.put_alt(baro.sampled_us, baro.pressure_pa, baro.temperature_degc)
    if (esc := samples.esc) is not None:
        flight.put_esc_status(esc.sampled_us, esc.rev_s, esc.voltage_v, _NOT_TOLD, _NOT_TOLD)
