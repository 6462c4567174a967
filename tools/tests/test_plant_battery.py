"""The battery against its circuit's formulas, and what its sag does to the rotors."""

import math
from itertools import pairwise

import pytest
from test_plant_flight import ALOFT, commands_for, fly
from test_plant_vehicle import UGGLAN_Q450

from strix.plant import BatteryNumbers, Plant, SensorSuite, Surroundings
from strix.plant.battery import MEAN_REST_V, Battery, rest_voltage_v
from strix.vehicles import plant_numbers

QUAD5IN = plant_numbers("Quad5in")
HOVER_W = 140.0


def test_a_cell_rests_at_4_2_v_full_and_falls_all_the_way() -> None:
    assert rest_voltage_v(1.0) == 4.2
    assert rest_voltage_v(0.5) == 3.84
    voltages = [rest_voltage_v(i / 200) for i in range(201)]
    assert all(low < high for low, high in pairwise(voltages))
    assert rest_voltage_v(-0.1) == rest_voltage_v(0.0) == 3.27


def test_a_load_drops_the_voltage_at_once_and_then_slowly_and_it_comes_back() -> None:
    # So large that its charge, and so its rest voltage, stays.
    numbers = BatteryNumbers(endurance_s=1e9)
    battery = Battery(numbers, 6, HOVER_W)
    fast, slow = 6 * numbers.resistance_ohm, 6 * numbers.slow_resistance_ohm
    rest = 6 * 4.2
    # With constant power the current changes by 1 % as the voltage does: 2 % of the drop.
    for time_s in (0.01, 5.0, 15.0, 60.0):
        battery = Battery(numbers, 6, HOVER_W)
        for _ in range(round(time_s / 0.01)):
            battery.advance(HOVER_W, 0.01)
        current = HOVER_W / battery.voltage_v
        settled = 1.0 - math.exp(-time_s / numbers.slow_time_s)
        expected = rest - current * (fast + slow * settled)
        assert battery.voltage_v == pytest.approx(expected, abs=0.02 * (rest - expected))
    battery.advance(0.0, 0.01)
    assert battery.current_a == 0.0
    assert battery.voltage_v == pytest.approx(rest - slow * current * 0.98, abs=0.005)
    for _ in range(10_000):
        battery.advance(0.0, 0.01)
    assert battery.voltage_v == pytest.approx(rest, abs=0.01)


def test_its_energy_goes_into_the_load_and_its_resistances_and_nowhere_else() -> None:
    numbers = BatteryNumbers(endurance_s=200.0)
    battery = Battery(numbers, 6, HOVER_W)
    step_s = 0.01
    given = lost = stored = 0.0
    slow_ohm = 6 * numbers.slow_resistance_ohm
    capacitance = numbers.slow_time_s / slow_ohm
    for i in range(6000):
        charge = battery.charge
        battery.advance(HOVER_W if i % 200 < 100 else 2.5 * HOVER_W, step_s)
        current, voltage = battery.current_a, battery.voltage_v
        given += voltage * current * step_s
        lost += 6 * numbers.resistance_ohm * current**2 * step_s
        # The slow part is a resistor beside a capacitor: its voltage is what is missing.
        slow_v = 6 * rest_voltage_v(charge) - voltage - 6 * numbers.resistance_ohm * current
        lost += slow_v**2 / slow_ohm * step_s
        stored = 0.5 * capacitance * slow_v**2
    # What was taken out: the integral of the rest voltage over the charge that went.
    steps = 10_000
    went = 1.0 - battery.charge
    mean = sum(rest_voltage_v(1.0 - went * (i + 0.5) / steps) for i in range(steps)) / steps
    taken = 6 * mean * went * battery.capacity_c
    # Steps of 10 ms under a load that jumps every second.
    assert given + lost + stored == pytest.approx(taken, rel=1e-3)
    assert lost > 0.01 * taken


def test_a_full_pack_hovers_for_its_endurance() -> None:
    battery = Battery(BatteryNumbers(endurance_s=100.0, resistance_ohm=1e-6), 6, HOVER_W)
    hovered_s = 0.0
    while battery.charge > 0.0:
        battery.advance(HOVER_W, 0.1)
        hovered_s += 0.1
    # The slow resistance takes half a per cent; constant power takes less current at first.
    assert hovered_s == pytest.approx(100.0, rel=0.02)
    assert 3.8 < MEAN_REST_V < 3.9


def test_more_than_the_pack_can_give_is_not_given() -> None:
    battery = Battery(BatteryNumbers(), 6, HOVER_W)
    r = 6 * BatteryNumbers().resistance_ohm
    battery.advance(1e6, 1e-3)
    # The most there is, at half the rest voltage.
    assert battery.voltage_v == pytest.approx(12.6)
    assert battery.current_a == pytest.approx(12.6 / r)


@pytest.mark.parametrize("full", [True, False])
def test_rotors_turn_with_the_voltage(full: bool) -> None:
    # Commands are shares of the voltage; the curve holds at curve_voltage_v.
    surroundings = Surroundings(battery=BatteryNumbers(endurance_s=1e9 if full else 0.1))
    plant = Plant(QUAD5IN, surroundings, 0.0, seed=0)
    plant.place(ALOFT, rotor_speed=QUAD5IN.hover_speed)
    truth = fly(plant, commands_for(QUAD5IN, (1, 1, 1, 1)), 1000)
    cell_v = truth.battery_v / 6
    assert (cell_v > 4.1) if full else (cell_v < 3.3)
    expected = QUAD5IN.hover_speed * truth.battery_v / 22.8
    # A second is 25 motor time constants; the voltage still moves by 0.1 %.
    assert truth.rotor_speed == pytest.approx((expected,) * 4, rel=1e-3)


def test_quad5in_hovers_with_as_many_amperes_as_its_size_does() -> None:
    plant = Plant(QUAD5IN, Surroundings(battery=BatteryNumbers()), 0.0, seed=0)
    plant.place(ALOFT, rotor_speed=QUAD5IN.hover_speed)
    plant.step(commands_for(QUAD5IN, (1, 1, 1, 1)), 1000)
    # kM n^2 2 pi n, four times, over 0.75, and 3 W: 140 W at 25.1 V.
    watts = 4 * 7.51e-7 * 175.82**3 * 2 * math.pi / 0.75 + 3.0
    assert plant.truth.battery_a == pytest.approx(watts / plant.truth.battery_v, rel=1e-3)
    assert 5.0 < plant.truth.battery_a < 6.0


def test_the_battery_is_measured_ten_times_a_second_with_its_noise() -> None:
    surroundings = Surroundings(battery=BatteryNumbers(endurance_s=1e9))
    plant = Plant(QUAD5IN, surroundings, 0.0, seed=0)
    suite = SensorSuite(surroundings, 5)
    readings = []
    for _ in range(20_000):
        plant.step((0.0,) * 4, 1000)
        if (battery := suite.sample(plant.truth).battery) is not None:
            readings.append(battery.voltage_v - plant.truth.battery_v)
    assert len(readings) == pytest.approx(200, abs=1)
    spread = math.sqrt(sum(r * r for r in readings) / len(readings))
    # 0.02 V and a step of 0.01 V, over 200 readings: 5 % each.
    assert spread == pytest.approx(math.hypot(0.02, 0.01 / math.sqrt(12)), rel=0.2)


def test_without_a_battery_nothing_is_measured_and_the_curve_holds() -> None:
    plant = Plant(QUAD5IN, Surroundings(), 0.0, seed=0)
    suite = SensorSuite(Surroundings(), 5)
    for _ in range(300):
        plant.step((0.0,) * 4, 1000)
        assert suite.sample(plant.truth).battery is None
    assert plant.truth.battery_v == QUAD5IN.curve_voltage_v == pytest.approx(22.8)


@pytest.mark.parametrize("answer", [True, False])
def test_escs_that_answer_tell_speed_and_voltage_five_times_a_second(answer: bool) -> None:
    vehicle = plant_numbers("UgglanQ450")
    assert vehicle.escs_answer
    assert not QUAD5IN.escs_answer
    plant = Plant(vehicle, Surroundings(), 0.0, seed=0)
    plant.place(ALOFT, rotor_speed=vehicle.hover_speed)
    suite = SensorSuite(Surroundings(), 5, escs_answer=answer)
    commands = commands_for(vehicle, (1.0, 1.1, 1.0, 0.9))
    told = []
    for _ in range(2000):
        plant.step(commands, 1000)
        if (esc := suite.sample(plant.truth).esc) is not None:
            told.append(esc)
    if not answer:
        assert not told
        return
    # The first is asked for nothing: there is no count before it.
    assert len(told) == 9
    hover_rev_s = UGGLAN_Q450.hover_speed / (2 * math.pi)
    # Counts of 1/42 turn over 0.2 s: 0.12 rev/s.
    expected = [hover_rev_s * factor for factor in (1.0, 1.1, 1.0, 0.9)]
    assert told[-1].rev_s == pytest.approx(expected, abs=0.125)
    assert told[-1].voltage_v == pytest.approx((11.4,) * 4, abs=0.016)
