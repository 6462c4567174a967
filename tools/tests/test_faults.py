"""Each fault does to the readings, or to the aircraft, what it is named after, and nothing else."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from strix import _core
from strix.missions import find_mission
from strix.plant import BatteryNumbers, Plant, SensorSuite, Surroundings
from strix.plant.faults import (
    BatterySag,
    BrownOut,
    CardDeath,
    CardStall,
    Delay,
    Drift,
    Dropout,
    Fault,
    Freeze,
    Jump,
    KillSwitch,
    PullAway,
    RadioLoss,
    RotorFault,
    Sensor,
    SensorFault,
    SlowBusDown,
    Spike,
    WindStep,
    displaced,
    garbled,
    magnetised,
    pressed,
    pushed,
    turned,
)
from strix.plant.samples import GpsSample, ImuSample, Samples
from strix.vehicles import plant_numbers

REPOSITORY = Path(__file__).resolve().parents[2]
BEGIN_S, SPAN_S = 1.0, 2.0
SENSORS = list(Sensor)


def resting() -> list[Samples]:
    """What a resting aircraft's sensors give in 4 s, step by step."""
    plant = Plant(plant_numbers("Quad5in"), Surroundings(), 0.4, seed=5)
    suite = SensorSuite(Surroundings(), seed=5)
    found = []
    for _ in range(4000):
        plant.step((1100.0,) * 4, 1000)
        found.append(suite.sample(plant.truth))
    return found


@pytest.fixture(scope="module")
def clean() -> list[Samples]:
    return resting()


def spoilt(fault: Fault, clean: list[Samples]) -> list[Samples]:
    """With the fault; step i ends at (i + 1) ms."""
    return [fault.spoil(samples, (i + 1) * 1e-3) for i, samples in enumerate(clean)]


def of(steps: list[Samples], sensor: Sensor) -> Iterator[tuple[float, object]]:
    """When a sensor's readings came, and what they are."""
    for i, samples in enumerate(steps):
        reading = getattr(samples, sensor)
        if reading is not None:
            yield (i + 1) * 1e-3, reading


def numbers(reading: object) -> tuple[float, ...]:
    """All but the time stamp."""
    assert hasattr(reading, "__slots__")
    values = (getattr(reading, name) for name in reading.__slots__ if name != "sampled_us")
    return tuple(np.concatenate([np.atleast_1d(value) for value in values]).tolist())


ALL = [
    fault
    for sensor in SENSORS
    for fault in (
        Freeze(BEGIN_S, SPAN_S, sensor),
        Dropout(BEGIN_S, SPAN_S, sensor),
        Delay(BEGIN_S, SPAN_S, sensor, 0.05),
    )
]


@pytest.mark.parametrize("fault", ALL, ids=lambda fault: f"{type(fault).__name__}-{fault.sensor}")
def test_a_sensor_fault_leaves_the_other_sensors_and_the_other_times_alone(
    fault: SensorFault, clean: list[Samples]
) -> None:
    steps = spoilt(fault, clean)
    for sensor in SENSORS:
        before = [(t, r) for t, r in of(clean, sensor)]
        after = [(t, r) for t, r in of(steps, sensor)]
        if sensor is fault.sensor:
            before = [(t, r) for t, r in before if not BEGIN_S <= t < BEGIN_S + SPAN_S]
            after = [(t, r) for t, r in after if not BEGIN_S <= t < BEGIN_S + SPAN_S]
        assert after == before


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_frozen_sensor_repeats_itself_with_fresh_time_stamps(
    sensor: Sensor, clean: list[Samples]
) -> None:
    steps = spoilt(Freeze(BEGIN_S, SPAN_S, sensor), clean)
    last = [reading for t, reading in of(clean, sensor) if t < BEGIN_S][-1]
    stuck = [reading for t, reading in of(steps, sensor) if BEGIN_S <= t < BEGIN_S + SPAN_S]
    assert {numbers(reading) for reading in stuck} == {numbers(last)}
    stamps = [reading.sampled_us for reading in stuck]  # type: ignore[attr-defined]
    assert stamps == sorted(set(stamps))


@pytest.mark.parametrize(
    ("sensor", "driver"),
    [
        (Sensor.IMU, "lib/Sensors/ICM20649Samples.h"),
        (Sensor.MAG, "src/board/MagLis2mdl.h"),
        (Sensor.BARO, "src/board/BaroBmp390.h"),
    ],
)
def test_a_driver_gives_as_many_equal_readings_of_a_frozen_sensor_as_it_does_on_the_board(
    sensor: Sensor, driver: str, clean: list[Samples]
) -> None:
    found = re.search(r"kStuckAfter = (\d+);", (REPOSITORY / driver).read_text(encoding="utf-8"))
    assert found is not None
    steps = spoilt(Freeze(BEGIN_S, SPAN_S, sensor), clean)
    stuck = [reading for t, reading in of(steps, sensor) if BEGIN_S <= t < BEGIN_S + SPAN_S]
    assert 1 + len(stuck) == int(found[1])  # the last good one is the first of the run


def test_a_frozen_receiver_goes_on_for_ever(clean: list[Samples]) -> None:
    steps = spoilt(Freeze(BEGIN_S, SPAN_S, Sensor.GPS), clean)
    assert len(list(of(steps, Sensor.GPS))) == len(list(of(clean, Sensor.GPS)))


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_late_sensor_gives_what_it_measured_before_stamped_as_its_driver_does(
    sensor: Sensor, clean: list[Samples]
) -> None:
    steps = spoilt(Delay(BEGIN_S, SPAN_S, sensor, by_s := 0.2), clean)
    came = {round(t, 6): reading for t, reading in of(clean, sensor)}
    late = [(t, reading) for t, reading in of(steps, sensor) if BEGIN_S <= t < BEGIN_S + SPAN_S]
    assert late
    for t, reading in late:
        original = came[round(t - by_s, 6)]
        assert numbers(reading) == numbers(original)
        # The IMU's edge stamps the measurement; the others are stamped when they are read.
        shift_us = 0 if sensor is Sensor.IMU else round(by_s * 1e6)
        assert reading.sampled_us == original.sampled_us + shift_us  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("sensor", "change", "size", "least"),
    [
        (Sensor.IMU, garbled, 0.5, 100.0),  # 15 g
        (Sensor.MAG, magnetised, 100.0, 99.0),
        (Sensor.BARO, pressed, 500.0, 499.0),
        (Sensor.GPS, displaced, 100.0, 1000.0),  # 100 m are 14600 of 1e-7 deg there
    ],
)
def test_one_reading_in_so_many_is_off(
    sensor: Sensor, change: object, size: float, least: float, clean: list[Samples]
) -> None:
    steps = spoilt(Spike(BEGIN_S, SPAN_S, sensor, change, size, every=4), clean)  # type: ignore[arg-type]
    wild = [
        i
        for i, ((t, bad), (_, good)) in enumerate(
            zip(of(steps, sensor), of(clean, sensor), strict=True)
        )
        if max(abs(a - b) for a, b in zip(numbers(bad), numbers(good), strict=True)) > least
    ]
    assert len(wild) == math.ceil(
        sum(BEGIN_S <= t < BEGIN_S + SPAN_S for t, _ in of(clean, sensor)) / 4
    )
    assert set(np.diff(wild)) == {4}


def test_a_drift_grows_at_its_rate_up_to_its_most(clean: list[Samples]) -> None:
    steps = spoilt(Drift(BEGIN_S, sensor=Sensor.IMU, change=turned, rate=-0.1, most=0.15), clean)
    for (t, bad), (_, good) in zip(of(steps, Sensor.IMU), of(clean, Sensor.IMU), strict=True):
        assert isinstance(bad, ImuSample)
        assert isinstance(good, ImuSample)
        off = -min(max(0.1 * (t - BEGIN_S), 0.0), 0.15)
        assert bad.gyro_rad_s == pytest.approx([g + off for g in good.gyro_rad_s], abs=1e-9)
        assert bad.accel_m_s2 == good.accel_m_s2


def test_an_accelerometer_can_drift_alone(clean: list[Samples]) -> None:
    fault = Drift(BEGIN_S, sensor=Sensor.IMU, change=pushed, rate=0.5, most=0.2)
    bad, good = spoilt(fault, clean)[-1].imu, clean[-1].imu
    assert bad is not None
    assert good is not None
    assert bad.gyro_rad_s == good.gyro_rad_s
    assert bad.accel_m_s2 == pytest.approx([a + 0.2 for a in good.accel_m_s2])


def places(steps: list[Samples]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, places in the flight code's own frame (m), and velocities told (m/s), north and
    east.
    """
    home = _core.LocalFrame(_core.GeoPoint(520000000, 130000000, 40000))
    times, positions, velocities = [], [], []
    for t, fix in of(steps, Sensor.GPS):
        assert isinstance(fix, GpsSample)
        times.append(t)
        point = _core.GeoPoint(fix.latitude_1e7deg, fix.longitude_1e7deg, fix.altitude_mm)
        positions.append(home.toNed(point)[:2])
        course, speed = math.radians(fix.course_deg), fix.speed_knots * 0.514444
        velocities.append((speed * math.cos(course), speed * math.sin(course)))
    return np.array(times), np.array(positions), np.array(velocities)


def test_a_jump_moves_the_place_and_leaves_the_velocity(clean: list[Samples]) -> None:
    times, place, velocity = places(spoilt(Jump(BEGIN_S, by_ned_m=(12.0, -16.0, 0.0)), clean))
    _, place_0, velocity_0 = places(clean)
    jumped = times >= BEGIN_S
    # 2 cm: the fix is rounded to 1e-7 deg, and the two earths differ by as much in 20 m.
    np.testing.assert_allclose((place - place_0)[jumped], [[12.0, -16.0]] * jumped.sum(), atol=0.02)
    np.testing.assert_allclose((place - place_0)[~jumped], 0.0, atol=1e-9)
    # A knot's hundredth and a degree's.
    np.testing.assert_allclose(velocity, velocity_0, atol=0.006)


def test_who_is_pulled_away_is_told_the_velocity_he_is_pulled_with(clean: list[Samples]) -> None:
    times, place, velocity = places(
        spoilt(PullAway(BEGIN_S, velocity_m_s=(0.6, 0.8), most_m=1.5), clean)
    )
    _, place_0, velocity_0 = places(clean)
    gone_m = np.clip(times - BEGIN_S, 0.0, 1.5)  # with 1 m/s
    np.testing.assert_allclose(place - place_0, np.outer(gone_m, (0.6, 0.8)), atol=0.02)
    pulls = (times >= BEGIN_S) & (gone_m < 1.5)
    np.testing.assert_allclose(velocity - velocity_0, np.outer(pulls, (0.6, 0.8)), atol=0.006)


def test_the_slow_bus_takes_magnetometer_and_altimeter_with_it(clean: list[Samples]) -> None:
    steps = spoilt(SlowBusDown(BEGIN_S, SPAN_S), clean)
    for sensor in SENSORS:
        there = [t for t, _ in of(steps, sensor) if BEGIN_S <= t < BEGIN_S + SPAN_S]
        assert bool(there) == (sensor in (Sensor.IMU, Sensor.GPS))


class Bench:
    """Remembers what a fault did."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.done: list[tuple[object, ...]] = []

    def stall_card(self, stalled: bool) -> None:
        self.done.append(("card", stalled))

    def kill_card(self) -> None:
        self.done.append(("card dead",))

    def silence_radio(self, silent: bool, failsafe: bool) -> None:
        self.done.append(("radio", silent, failsafe))

    def restart(self) -> None:
        self.done.append(("restart",))

    def switch_kill(self) -> None:
        self.done.append(("kill",))


@pytest.fixture
def bench() -> Bench:
    plant = Plant(plant_numbers("Quad5in"), Surroundings(battery=BatteryNumbers()), 0.0, seed=1)
    hover = plant_numbers("Quad5in").hover_speed
    plant.place((0.0, 0.0, -50.0), rotor_speed=hover)
    return Bench(plant)


def hover(bench: Bench, duration_s: float) -> None:
    vehicle = plant_numbers("Quad5in")
    # The battery is full: its voltage makes the rotors faster than the curve says.
    share = vehicle.curve_voltage_v / bench.plant.truth.battery_v
    command = vehicle.command_for_speed(vehicle.hover_speed * share)
    for _ in range(round(duration_s * 1000)):
        bench.plant.step((command,) * 4, 1000)


@pytest.mark.parametrize("rotor", range(4))
def test_an_aircraft_falls_over_the_rotor_that_it_lost(rotor: int, bench: Bench) -> None:
    RotorFault(0.0, rotor=rotor, strength=0.0).begin(bench)
    hover(bench, 0.05)
    where = plant_numbers("Quad5in").rotors[rotor]
    roll, pitch, _ = bench.plant.truth.rate_body_rad_s
    # The side without thrust goes down: right is positive roll, the front is negative pitch.
    assert math.copysign(1.0, roll) == math.copysign(1.0, where.y_m)
    assert math.copysign(1.0, pitch) == -math.copysign(1.0, where.x_m)
    assert bench.plant.truth.thrust_to_weight == pytest.approx(0.75, abs=0.02)


def test_a_rotor_that_comes_back_carries_again(bench: Bench) -> None:
    fault = RotorFault(0.0, 1.0, rotor=2, strength=0.0)
    fault.begin(bench)
    fault.end(bench)
    hover(bench, 0.05)
    assert bench.plant.truth.thrust_to_weight == pytest.approx(1.0, abs=0.02)


def test_wind_that_sets_in_carries_the_aircraft_with_it(bench: Bench) -> None:
    WindStep(0.0, mean_ned_m_s=(0.0, 8.0, 0.0)).begin(bench)
    hover(bench, 1.0)
    north, east, _ = bench.plant.truth.velocity_ned_m_s
    # Rotor drag of 0.2 1/s (plant.py): 1.6 m/s after a second, gusts of some 20 % left and right.
    assert 0.8 < east < 2.4
    assert abs(north) < 0.8


def test_an_emptied_battery_has_less_voltage(bench: Bench) -> None:
    hover(bench, 0.1)
    full_v = bench.plant.truth.battery_v
    BatterySag(0.0, charge=0.02).begin(bench)
    hover(bench, 0.1)
    # 4.2 V a cell at rest when full, 3.4 V at 2 % (battery.py's chart).
    assert full_v - bench.plant.truth.battery_v == pytest.approx(6 * 0.8, rel=0.1)


def test_the_others_reach_what_they_are_about(bench: Bench) -> None:
    ends: tuple[Fault, ...] = (CardStall(0.0, 1.0), RadioLoss(0.0, 1.0, failsafe=True))
    for fault in ends:
        fault.begin(bench)
        fault.end(bench)
    once: tuple[Fault, ...] = (CardDeath(0.0), BrownOut(0.0), KillSwitch(0.0))
    for fault in once:
        fault.begin(bench)
        fault.end(bench)
    assert bench.done == [
        ("card", True),
        ("card", False),
        ("radio", True, True),
        ("radio", False, True),
        ("card dead",),
        ("restart",),
        ("kill",),
    ]


def powered(path: Path) -> _core.Flight:
    mission = find_mission("hover")
    return _core.Flight("Quad5in", mission.name, mission.text, 0.0, str(path), 1, 0)


def run(flight: _core.Flight, clean: list[Samples], begin: int, end: int) -> None:
    for i in range(begin, end):
        imu = clean[i].imu
        assert imu is not None
        flight.put_imu(imu.sampled_us, imu.accel_m_s2, imu.gyro_rad_s, 25.0)
        flight.loop((i + 1) * 1000)


def test_a_stalled_card_gets_nothing_and_then_all_that_waited(
    tmp_path: Path, clean: list[Samples]
) -> None:
    path = tmp_path / "flight.ulg"
    flight = powered(path)
    run(flight, clean, 0, 2000)
    flight.set_card(stalled=True, dead=False)
    run(flight, clean, 2000, 2010)  # what the file system had not written yet
    before = path.stat().st_size
    run(flight, clean, 2010, 3000)
    assert path.stat().st_size == before
    flight.set_card(stalled=False, dead=False)
    run(flight, clean, 3000, 4000)
    assert flight.close()
    assert path.stat().st_size > before + 1000 * 40  # an IMU record has more than 40 bytes


def test_a_dead_card_gets_nothing_more_and_the_log_says_so(
    tmp_path: Path, clean: list[Samples]
) -> None:
    path = tmp_path / "flight.ulg"
    flight = powered(path)
    run(flight, clean, 0, 2000)
    flight.set_card(stalled=False, dead=True)
    run(flight, clean, 2000, 2010)  # what the file system had not written yet
    before = path.stat().st_size
    run(flight, clean, 2010, 4000)
    assert path.stat().st_size == before
    assert not flight.close()
