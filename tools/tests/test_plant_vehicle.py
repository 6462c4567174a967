"""Vehicle numbers: the command curve, and the two layouts of DESIGN.md.

QUAD5IN and UGGLAN_Q450 are fixtures: in a flight the numbers come from the flight code's headers.
"""

import math
from dataclasses import replace
from typing import Any

import pytest

from strix.plant import Rotor, VehicleNumbers

QUAD5IN = VehicleNumbers(
    name="Quad5in",
    mass_kg=0.83,
    inertia_kg_m2=(0.003, 0.004, 0.005),
    rotors=(  # front left, front right, rear right, rear left; tau_z row of DESIGN.md: - + - +
        Rotor(0.08, -0.08, 1),
        Rotor(0.08, 0.08, -1),
        Rotor(-0.08, 0.08, 1),
        Rotor(-0.08, -0.08, -1),
    ),
    thrust_constant=6.583e-5,
    torque_constant=7.51e-7,
    speed_unit="rev/s",
    motor_time_constant_s=0.04,
    command_offset=1195.0,
    command_linear=0.0,
    command_quadratic=755.0 / 160000.0,
    command_min=1150.0,
    command_max=1950.0,
)

UGGLAN_Q450 = VehicleNumbers(
    name="UgglanQ450",
    mass_kg=1.058,
    inertia_kg_m2=(0.014, 0.014, 0.026),
    rotors=(  # front right, rear right, rear left, front left; tau_z row: - + - +
        Rotor(0.163, 0.163, 1),
        Rotor(-0.163, 0.163, -1),
        Rotor(-0.163, -0.163, 1),
        Rotor(0.163, -0.163, -1),
    ),
    thrust_constant=8.37e-6,
    torque_constant=8.37e-6 / 50.0,
    speed_unit="rad/s",
    motor_time_constant_s=0.08,
    command_offset=-9675.0,
    command_linear=57.0,
    command_quadratic=0.0,
    command_min=0.0,
    command_max=32767.0,
)

VEHICLES = pytest.mark.parametrize("vehicle", [QUAD5IN, UGGLAN_Q450], ids=lambda v: v.name)


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("rotors", QUAD5IN.rotors[:3], "4 rotors expected, found 3"),
        ("inertia_kg_m2", (0.003, -0.004, 0.005), "inertia_kg_m2 must be positive"),
        ("rotors", (Rotor(0.1, 0.1, 0),) * 4, "spin is"),
        ("rotors", (Rotor(0.1, 0.1, 1, strength=0.0),) * 4, "strength of a rotor must be positive"),
        ("mass_kg", 0.0, "mass_kg must be positive"),
        ("motor_time_constant_s", math.nan, "motor_time_constant_s must be positive"),
        ("speed_unit", "rpm", "found 'rpm'"),
        ("command_max", 1000.0, "command_max - command_min must be positive"),
    ],
)
def test_an_impossible_vehicle_is_refused(key: str, value: Any, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        replace(QUAD5IN, **{key: value})


def test_quad5in_turns_400_times_a_second_at_full_command() -> None:
    # DESIGN.md section 5: 1950 us is n = 400 rev/s; hover is sqrt(0.83 g / 4 kT) = 175.8 rev/s.
    assert QUAD5IN.speed_for_command(1950.0) == pytest.approx(400.0, rel=1e-12)
    assert QUAD5IN.hover_speed == pytest.approx(175.82, abs=0.01)


def test_ugglan_turns_at_200_rad_s_where_its_curve_says_so() -> None:
    assert UGGLAN_Q450.speed_for_command(57.0 * 200.0 - 9675.0) == pytest.approx(200.0, rel=1e-12)


@VEHICLES
@pytest.mark.parametrize("fraction", [0.5, 1.0, 1.3])
def test_the_esc_inverts_the_command_curve(vehicle: VehicleNumbers, fraction: float) -> None:
    speed = fraction * vehicle.hover_speed
    command = vehicle.command_for_speed(speed)
    # The double's own rounding, times the curve's condition of about 10.
    assert vehicle.speed_for_command(command) == pytest.approx(speed, rel=1e-13)


@VEHICLES
def test_a_motor_stands_still_at_and_below_the_off_command(vehicle: VehicleNumbers) -> None:
    for command in (vehicle.command_min, vehicle.command_min - 1.0, -math.inf, math.nan):
        assert vehicle.speed_for_command(command) == 0.0


def test_between_off_and_the_curves_start_a_motor_stands_still() -> None:
    assert QUAD5IN.speed_for_command(1170.0) == 0.0


@VEHICLES
def test_a_command_beyond_the_limit_gives_the_limits_speed(vehicle: VehicleNumbers) -> None:
    top = vehicle.speed_for_command(vehicle.command_max)
    assert vehicle.speed_for_command(vehicle.command_max + 100.0) == top
    assert vehicle.speed_for_command(math.inf) == top


def test_an_esc_stops_its_motor_below_the_slowest_speed_it_can_keep() -> None:
    # DESIGN.md section 5: the UgglanQ450's command is zero below 200 rad/s, which is 1725.
    vehicle = replace(UGGLAN_Q450, speed_min=200.0)
    assert vehicle.speed_for_command(1725.0) == pytest.approx(200.0)
    assert vehicle.speed_for_command(1724.0) == 0.0
    assert UGGLAN_Q450.speed_for_command(1724.0) == pytest.approx(200.0, abs=0.02)
