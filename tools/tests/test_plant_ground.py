"""The plant on the ground: at rest, landing, in wind, and after a crash."""

import math
from dataclasses import replace

import pytest
from test_plant_flight import OFF, commands_for, fly
from test_plant_vehicle import QUAD5IN, VEHICLES

from strix.plant import Plant, Surroundings, VehicleNumbers
from strix.plant.frames import level_at_heading, rotate_to_world

G = 9.80665
CALM = Surroundings()


@VEHICLES
@pytest.mark.parametrize("heading_deg", [0.0, 37.0, 90.0, 180.0, -135.0])
def test_a_vehicle_at_rest_feels_one_g_upward_at_every_heading(
    vehicle: VehicleNumbers, heading_deg: float
) -> None:
    plant = Plant(vehicle, CALM, math.radians(heading_deg), seed=0)
    heading = level_at_heading(math.radians(heading_deg))
    for time_ms in (0, 1, 3000):
        truth = fly(plant, OFF, time_ms - plant.truth.time_us // 1000)
        # The contact solver's tolerance; a thousandth of the accelerometer's resolution.
        assert truth.specific_force_body_m_s2 == pytest.approx((0, 0, -G), abs=1e-5)
        assert truth.position_ned_m == pytest.approx((0, 0, 0), abs=1e-6)
        assert truth.velocity_ned_m_s == pytest.approx((0, 0, 0), abs=1e-6)
        assert truth.q_body_to_ned == pytest.approx(heading, abs=1e-6)
        assert truth.on_ground
        assert truth.time_us == time_ms * 1000


@VEHICLES
def test_half_the_hover_thrust_does_not_lift_and_more_than_all_does(
    vehicle: VehicleNumbers,
) -> None:
    plant = Plant(vehicle, CALM, 0.0, seed=0)
    truth = fly(plant, commands_for(vehicle, (math.sqrt(0.5),) * 4), 1000)
    assert truth.on_ground
    # The feet rise as they unload, by less than they had sunk: 1 mm.
    assert abs(truth.position_ned_m[2]) < 1e-3
    assert truth.specific_force_body_m_s2[2] == pytest.approx(-G, abs=1e-3)
    truth = fly(plant, commands_for(vehicle, (1.1,) * 4), 1000)
    assert not truth.on_ground
    assert truth.position_ned_m[2] < -0.3


@VEHICLES
def test_landing_at_half_a_metre_a_second_does_not_bounce(vehicle: VehicleNumbers) -> None:
    plant = Plant(vehicle, CALM, 0.0, seed=0)
    plant.place((0.0, 0.0, -0.05), (0.0, 0.0, 0.5), rotor_speed=vehicle.hover_speed)
    for _ in range(200):  # 5 cm are through after 100 ms
        if fly(plant, commands_for(vehicle, (1, 1, 1, 1)), 1).on_ground:
            break
    assert plant.truth.velocity_ned_m_s[2] == pytest.approx(0.5, abs=0.01)
    highest, fastest_up = 0.0, 0.0
    for _ in range(1000):
        truth = fly(plant, OFF, 1)
        if truth.position_ned_m[2] > 0.0:  # past first contact, pressed in
            highest, fastest_up = 0.0, 0.0
        highest = max(highest, -truth.position_ned_m[2])
        fastest_up = max(fastest_up, -truth.velocity_ned_m_s[2])
    # A foot may lift by a hair on the way back to the resting height; a bounce would be cm.
    assert highest < 1e-3
    assert fastest_up < 0.05
    assert truth.velocity_ned_m_s == pytest.approx((0, 0, 0), abs=1e-5)
    assert truth.position_ned_m == pytest.approx((0, 0, 0), abs=1e-4)


@VEHICLES
def test_a_crooked_drop_ends_level_and_still_where_it_fell(vehicle: VehicleNumbers) -> None:
    plant = Plant(vehicle, CALM, 0.0, seed=0)
    tilt = math.radians(10.0)
    q = (math.cos(tilt / 2), math.sin(tilt / 2) * 0.6, math.sin(tilt / 2) * 0.8, 0.0)
    plant.place((0.0, 0.0, -0.2), (0.3, -0.2, 0.0), q)
    truth = fly(plant, OFF, 2000)
    up = rotate_to_world(truth.q_body_to_ned, (0.0, 0.0, -1.0))
    assert up == pytest.approx((0, 0, -1), abs=1e-4)
    assert truth.rate_body_rad_s == pytest.approx((0, 0, 0), abs=1e-4)
    assert truth.velocity_ned_m_s == pytest.approx((0, 0, 0), abs=1e-4)
    assert truth.position_ned_m[2] == pytest.approx(0.0, abs=1e-4)
    assert math.hypot(*truth.position_ned_m[:2]) < 0.3


def test_a_standing_vehicle_does_not_creep_in_a_fresh_breeze() -> None:
    breeze = replace(CALM, wind_mean_ned_m_s=(6.0, -5.0, 0.0))  # 8 m/s
    truth = fly(Plant(QUAD5IN, breeze, 0.4, seed=0), OFF, 10_000)
    # MuJoCo's friction is soft: it yields slowly. 1 mm in 10 s is below everything measured.
    assert math.hypot(*truth.position_ned_m[:2]) < 1e-3


def test_friction_holds_a_push_below_its_cone_and_yields_above() -> None:
    # The rotors carry half the weight, at sqrt(1/2) of their hover speed, and drag with the wind.
    def slip_m(wind_m_s: float) -> float:
        wind = replace(CALM, wind_mean_ned_m_s=(wind_m_s, 0.0, 0.0))
        plant = Plant(QUAD5IN, wind, 0.0, seed=0)
        commands = commands_for(QUAD5IN, (math.sqrt(0.5),) * 4)
        return fly(plant, commands, 2000).position_ned_m[0]

    def push_over_grip(wind_m_s: float) -> float:
        rotors = 0.2 * QUAD5IN.mass_kg * wind_m_s * math.sqrt(0.5)
        frame = 0.5 * 1.225 * 0.01 * wind_m_s**2
        return (rotors + frame) / (0.8 * 0.5 * QUAD5IN.weight_n)

    assert push_over_grip(10.0) < 0.7
    assert abs(slip_m(10.0)) < 0.01
    assert push_over_grip(22.0) > 1.5
    assert slip_m(22.0) > 0.5


def test_after_a_crash_the_vehicle_lies_above_the_ground() -> None:
    plant = Plant(QUAD5IN, CALM, 0.0, seed=0)
    upside_down = (0.0, 1.0, 0.0, 0.0)
    plant.place((0.0, 0.0, -3.0), q_body_to_ned=upside_down, rate_body_rad_s=(1.0, 0.5, 0.0))
    truth = fly(plant, commands_for(QUAD5IN, (1.2,) * 4), 3000)
    truth = fly(plant, OFF, 3000)
    # On its back the centre of mass is 4 cm below its height of rest; sinking in stays within 1 cm.
    assert -0.1 < truth.position_ned_m[2] < 0.05
    assert truth.velocity_ned_m_s == pytest.approx((0, 0, 0), abs=1e-3)
    felt = rotate_to_world(truth.q_body_to_ned, truth.specific_force_body_m_s2)
    assert felt == pytest.approx((0, 0, -G), abs=1e-2)
