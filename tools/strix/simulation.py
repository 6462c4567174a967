"""One simulated flight: the flight software on one side, the plant on the other."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from strix import _core
from strix.ground import Ground
from strix.missions import Mission
from strix.plant.earth import MAGNETIC_DECLINATION_RAD
from strix.plant.frames import Matrix
from strix.plant.plant import Plant
from strix.plant.samples import Samples
from strix.plant.sensors import DEFAULT_CONSTANTS, SensorConstants, SensorSuite
from strix.scenarios import Scenario, configure
from strix.track import TruthRecorder, TruthTrack
from strix.vehicles import plant_numbers

STEP_US = 1000  # one pass of the flight software's loop
TRUTH_EVERY = 10  # steps: the truth is kept at 100 Hz
ARM_AT_S = 20.0  # the aircraft stands still until then
START_AFTER_S = 2.0  # from arming to take-off
RETRY_S = 2.0  # arming was refused: switch off, and on again after this long
AFTER_LANDING_S = 2.0
GIVE_UP_S = 180.0

# How the simulated magnetometer is built in; include/FlightConfig.h must undo it. The rows are its
# axes in the body: forward, left, down. Left-handed, as the LIS2MDL's are.
MAG_MOUNTING: Matrix = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))

_NOT_TOLD = (math.nan,) * 4  # temperature and current: those ESCs do not measure them

Progress = Callable[[float, str], None]  # time s, state name


@dataclass(frozen=True)
class FlightPlan:
    """What is flown, in what, from which heading."""

    vehicle: str
    mission: Mission
    scenario: Scenario
    heading_deg: float
    seed: int
    sensors: SensorConstants = DEFAULT_CONSTANTS
    arm_at_s: float = ARM_AT_S
    parameters: tuple[tuple[str, float], ...] = ()  # other than as configured


class Pilot:
    """Moves the switches: arms after the standstill, starts the mission, lets go after landing."""

    def __init__(self, arm_at_s: float) -> None:
        self._arm_since_s: float | None = None
        self._retry_at_s = arm_at_s
        self._flew = False
        self.done_at_s: float | None = None

    def switches(self, time_s: float, state: str, motors_on: bool) -> tuple[bool, bool]:
        """Arm and start switch at this time."""
        if self._arm_since_s is None:
            if not self._flew and time_s >= self._retry_at_s:
                self._arm_since_s = time_s
            return self._arm_since_s is not None, False
        waited_s = time_s - self._arm_since_s
        if motors_on and state not in ("IDLE", "ARMED"):
            self._flew = True
        if not motors_on and (self._flew or waited_s > 0.5):  # landed or cut off, or refused
            self._arm_since_s = None
            self._retry_at_s = time_s + RETRY_S
            if self._flew:
                self.done_at_s = time_s + AFTER_LANDING_S
            return False, False
        return True, waited_s >= START_AFTER_S


def fly(
    plan: FlightPlan,
    log_path: Path,
    progress: Progress,
    give_up_s: float = GIVE_UP_S,
    ground: Ground | None = None,
) -> TruthTrack:
    """Flies until the aircraft has landed, or gives up; the log is what the card would hold.

    With a ground nobody moves a switch: it flies by telemetry or console until the ground's end, or
    until an interrupt, upon which the log is still written to its end.
    """
    mission = plan.mission
    scenario = plan.scenario
    vehicle = scenario.variation.applied_to(plant_numbers(plan.vehicle))
    plant = Plant(vehicle, scenario.surroundings, math.radians(plan.heading_deg), plan.seed)
    sensors = SensorSuite(
        scenario.surroundings, plan.seed, plan.sensors, MAG_MOUNTING, vehicle.escs_answer
    )
    options = _core.FlightOptions(plan.vehicle)
    configure(options, scenario.settings)
    for name, value in plan.parameters:
        options.set_parameter(name, value)
    flight = _core.Flight(
        vehicle=plan.vehicle,
        mission=mission.name,
        mission_text=mission.text,
        declination_rad=MAGNETIC_DECLINATION_RAD,
        log_path=str(log_path),
        boot_id=plan.seed,
        start_time_us=plant.truth.time_us,
        options=options,
        console=ground is not None and ground.terminal is not None,
        telemetry=ground is not None and ground.link is not None,
    )
    pilot = Pilot(plan.arm_at_s)
    recorder = TruthRecorder()
    try:
        _fly_on(flight, plant, sensors, recorder, pilot, progress, give_up_s, ground)
    except KeyboardInterrupt:
        if ground is None:
            raise
    flight.close()
    return recorder.track()


def _fly_on(
    flight: _core.Flight,
    plant: Plant,
    sensors: SensorSuite,
    recorder: TruthRecorder,
    pilot: Pilot,
    progress: Progress,
    give_up_s: float,
    ground: Ground | None,
) -> None:
    commands = flight.loop(plant.truth.time_us)
    step = 0
    while True:
        plant.step(commands, STEP_US)
        truth = plant.truth
        now_us = truth.time_us
        _deliver(flight, sensors.sample(truth))
        commands = flight.loop(now_us)
        step += 1
        if step % TRUTH_EVERY != 0:
            continue
        recorder.add(truth)
        time_s = now_us * 1e-6
        state = flight.state_name
        progress(time_s, state)
        if ground is not None:
            ground.exchange(flight, time_s)
            if time_s >= ground.end_s or flight.reboot_asked:
                return
            continue
        arm, start = pilot.switches(time_s, state, flight.motors_on)
        flight.set_switches(arm=arm, start=start, kill=False)
        if time_s > give_up_s or (pilot.done_at_s is not None and time_s >= pilot.done_at_s):
            return


def _deliver(flight: _core.Flight, samples: Samples) -> None:
    """Hands the flight software what became ready since the last step."""
    if (imu := samples.imu) is not None:
        flight.put_imu(imu.sampled_us, imu.accel_m_s2, imu.gyro_rad_s, 25.0)
    if (mag := samples.mag) is not None:
        flight.put_mag(mag.sampled_us, mag.field_ut)
    if (baro := samples.baro) is not None:
        flight.put_alt(baro.sampled_us, baro.pressure_pa, baro.temperature_degc)
    if (gps := samples.gps) is not None:
        flight.put_gps(
            gps.sampled_us,
            gps.latitude_1e7deg,
            gps.longitude_1e7deg,
            gps.altitude_mm,
            gps.speed_knots,
            gps.course_deg,
            gps.hdop,
            gps.fix,
            gps.satellites,
        )
    if (battery := samples.battery) is not None:
        flight.put_battery(battery.sampled_us, battery.voltage_v, battery.current_a)
    if (esc := samples.esc) is not None:
        flight.put_esc_status(esc.sampled_us, esc.rev_s, esc.voltage_v, _NOT_TOLD, _NOT_TOLD)
