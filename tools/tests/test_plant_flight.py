"""The plant in the air: signs, sizes, conservation laws, and the same answer at every heading."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from test_plant_vehicle import QUAD5IN, VEHICLES

from strix.plant import Plant, Rotor, Surroundings, Truth, VehicleNumbers
from strix.plant.frames import level_at_heading, rotate_to_body, rotate_to_world

G = 9.80665
CALM = Surroundings()
OFF = (-1e9,) * 4
ALOFT = (0.0, 0.0, -100.0)


def fly(plant: Plant, commands: Sequence[float], duration_ms: int) -> Truth:
    for _ in range(duration_ms):
        plant.step(commands, 1000)
    return plant.truth


def hovering(vehicle: VehicleNumbers, heading_rad: float = 0.0) -> Plant:
    plant = Plant(vehicle, CALM, heading_rad, seed=0)
    plant.place(ALOFT, rotor_speed=vehicle.hover_speed)
    return plant


def commands_for(vehicle: VehicleNumbers, factors: Sequence[float]) -> tuple[float, ...]:
    return tuple(vehicle.command_for_speed(vehicle.hover_speed * factor) for factor in factors)


def test_free_fall_feels_nothing_but_the_air() -> None:
    plant = Plant(QUAD5IN, CALM, 0.3, seed=0)
    plant.place(ALOFT)
    # After 1 ms the fall is 1 cm/s: drag 0.5 rho A v^2 / m = 7e-7 m/s^2.
    assert fly(plant, OFF, 1).specific_force_body_m_s2 == pytest.approx((0, 0, 0), abs=1e-6)
    truth = fly(plant, OFF, 999)
    # Fall with quadratic drag: v = u tanh(g t / u), z = u^2/g ln cosh(g t / u), u^2 = 2mg/(rho A)
    u = math.sqrt(2.0 * QUAD5IN.mass_kg * G / (1.225 * 0.01))
    # Drag is held over a step of 1 ms, so it lags by 0.5 ms: at the end's 0.68 m/s^2 that is
    # 3.4e-4 m/s, and a third of it in metres. All of drag is 0.23 m/s and 0.06 m.
    assert truth.velocity_ned_m_s[2] == pytest.approx(u * math.tanh(G / u), abs=5e-4)
    fall = u * u / G * math.log(math.cosh(G / u))
    assert truth.position_ned_m[2] + 100.0 == pytest.approx(fall, abs=2e-4)
    assert not truth.on_ground


@VEHICLES
def test_four_rotors_at_hover_speed_carry_the_weight(vehicle: VehicleNumbers) -> None:
    plant = hovering(vehicle)
    truth = fly(plant, commands_for(vehicle, (1, 1, 1, 1)), 2000)
    # Only rounding of the command and of 2000 steps.
    assert truth.velocity_ned_m_s == pytest.approx((0, 0, 0), abs=1e-9)
    assert truth.rate_body_rad_s == pytest.approx((0, 0, 0), abs=1e-9)
    assert truth.specific_force_body_m_s2 == pytest.approx((0, 0, -G), abs=1e-9)
    assert truth.thrust_to_weight == pytest.approx(1.0, abs=1e-12)


def right(rotor: Rotor) -> bool:
    return rotor.y_m > 0.0


def front(rotor: Rotor) -> bool:
    return rotor.x_m > 0.0


def clockwise(rotor: Rotor) -> bool:
    return rotor.spin > 0


@VEHICLES
@pytest.mark.parametrize(
    ("group", "faster", "axis"),
    [
        (right, False, 0),  # more thrust on the left rolls right: +x
        (front, True, 1),  # more thrust in front pitches up: +y
        (clockwise, False, 2),  # faster counter-clockwise rotors yaw clockwise from above: +z
    ],
    ids=["roll", "pitch", "yaw"],
)
def test_unequal_thrust_turns_the_right_way_by_the_right_amount(
    vehicle: VehicleNumbers, group: object, faster: bool, axis: int
) -> None:
    assert callable(group)
    plant = hovering(vehicle)
    commands = commands_for(
        vehicle, [1.05 if group(rotor) is faster else 0.95 for rotor in vehicle.rotors]
    )
    before = fly(plant, commands, 20)
    after = fly(plant, commands, 1)
    rise = [a - b for a, b in zip(after.rate_body_rad_s, before.rate_body_rad_s, strict=True)]

    lever = {0: lambda r: abs(r.y_m), 1: lambda r: abs(r.x_m)}.get(axis)
    ratio = vehicle.torque_constant / vehicle.thrust_constant
    torque = 0.0
    for rotor, n0, n1 in zip(vehicle.rotors, before.rotor_speed, after.rotor_speed, strict=True):
        thrust = vehicle.thrust_constant * (0.5 * (n0 + n1)) ** 2
        sign = 1.0 if group(rotor) is faster else -1.0
        torque += sign * thrust * (lever(rotor) if lever else ratio)
    expected = torque * 1e-3 / vehicle.inertia_kg_m2[axis]
    assert expected > 0.0
    # The mean of the ends differs from the speed in the middle by (h/tau)^2/8 < 1e-4; in yaw the
    # drag of the turning hubs, 2 % of the torque by then, comes on top.
    assert rise[axis] == pytest.approx(expected, rel=0.03 if axis == 2 else 1e-3)
    others = [abs(rise[i]) for i in range(3) if i != axis]
    assert max(others) < 1e-6 * rise[axis]


@VEHICLES
def test_a_step_of_the_command_shows_the_motors_time_constant(vehicle: VehicleNumbers) -> None:
    plant = Plant(vehicle, CALM, 0.0, seed=0)
    plant.place(ALOFT)
    goal = vehicle.hover_speed
    times_s, left = [], []
    for step in range(1, 101):
        truth = fly(plant, commands_for(vehicle, (1, 1, 1, 1)), 1)
        times_s.append(step * 1e-3)
        left.append(math.log(1.0 - truth.rotor_speed[2] / goal))
    slope = np.polyfit(times_s, left, 1)[0]
    assert -1.0 / slope == pytest.approx(vehicle.motor_time_constant_s, rel=1e-9)


def test_a_tumbling_vehicle_keeps_its_angular_momentum_and_energy() -> None:
    inertia = np.array(QUAD5IN.inertia_kg_m2)

    def momentum_and_energy(truth: Truth) -> tuple[np.ndarray, float]:
        rate = np.array(truth.rate_body_rad_s)
        x, y, z = (inertia * rate).tolist()
        momentum = np.array(rotate_to_world(truth.q_body_to_ned, (x, y, z)))
        return momentum, float(rate @ (inertia * rate) / 2.0)

    plant = Plant(QUAD5IN, CALM, 0.0, seed=0)
    plant.place((0.0, 0.0, -1000.0), rate_body_rad_s=(3.0, 5.0, 4.0))
    momentum0, energy0 = momentum_and_energy(plant.truth)
    momentum1, energy1 = momentum_and_energy(fly(plant, OFF, 5000))
    # Runge-Kutta 4: (7 rad/s x 1 ms)^5 a step, 5000 steps: 1e-7 at worst. Euler's is 1e-2.
    np.testing.assert_allclose(momentum1, momentum0, atol=1e-7 * float(np.linalg.norm(momentum0)))
    assert energy1 == pytest.approx(energy0, rel=1e-7)


@VEHICLES
def test_rotors_and_body_together_keep_their_angular_momentum(vehicle: VehicleNumbers) -> None:
    # Two clockwise rotors spin up in a tumbling body. Without aerodynamic torque, and with next
    # to no mass (all drag is per mass), nothing from outside turns the whole.
    rotor_inertia = 2e-5
    vehicle = replace(
        vehicle,
        inertia_kg_m2=(0.014, 0.016, 0.026),
        mass_kg=1e-3,
        torque_constant=0.0,
        thrust_constant=1e-9,
        rotor_inertia_kg_m2=rotor_inertia,
    )
    inertia = np.array(vehicle.inertia_kg_m2)
    rad_s = {"rev/s": 2.0 * math.pi, "rad/s": 1.0}[vehicle.speed_unit]

    def momentum(truth: Truth) -> np.ndarray:
        rotors = sum(
            rotor.spin * rotor_inertia * n * rad_s
            for rotor, n in zip(vehicle.rotors, truth.rotor_speed, strict=True)
        )
        x, y, z = (inertia * truth.rate_body_rad_s + [0.0, 0.0, rotors]).tolist()
        return np.array(rotate_to_world(truth.q_body_to_ned, (x, y, z)))

    plant = Plant(vehicle, CALM, 0.0, seed=0)
    plant.place((0.0, 0.0, -1000.0), rate_body_rad_s=(0.5, 1.0, 0.2))
    before = momentum(plant.truth)
    fast = vehicle.command_for_speed(500.0 / rad_s)
    off = vehicle.command_min
    after = momentum(fly(plant, [fast if r.spin > 0 else off for r in vehicle.rotors], 500))
    # The rotors' 0.02 N m s is as much as the body's; turned against them, it yaws left.
    assert plant.truth.rate_body_rad_s[2] < -0.4
    # The gyroscopic torque is held over a step of 1 ms, in which 1 rad/s turns it by 1e-3.
    np.testing.assert_allclose(after, before, atol=1e-3 * float(np.linalg.norm(before)))


def test_moving_forward_the_rotors_and_the_frame_drag_backward() -> None:
    plant = hovering(QUAD5IN)
    plant.place(ALOFT, (2.0, 0.0, 0.0), rotor_speed=QUAD5IN.hover_speed)
    force = fly(plant, commands_for(QUAD5IN, (1, 1, 1, 1)), 1).specific_force_body_m_s2
    expected = -(0.2 * 2.0 + 0.5 * 1.225 * 0.01 * 2.0**2 / QUAD5IN.mass_kg)
    # Slowing down by 4e-4 m/s during the step.
    assert force[0] == pytest.approx(expected, rel=1e-3)
    assert abs(force[1]) < 1e-12


def test_a_yawing_vehicle_is_braked_by_its_hubs() -> None:
    plant = Plant(QUAD5IN, CALM, 0.0, seed=0)
    plant.place(ALOFT, rate_body_rad_s=(0.0, 0.0, 2.0), rotor_speed=QUAD5IN.hover_speed)
    truth = fly(plant, commands_for(QUAD5IN, (1, 1, 1, 1)), 1)
    # Each hub drags with 0.2 m/4 times its speed r |xy|, at lever |xy|: |xy|^2 = 2 x 0.08^2.
    rise = -0.2 * QUAD5IN.mass_kg * 2.0 * (2.0 * 0.08**2) * 1e-3 / 0.005
    assert truth.rate_body_rad_s[2] - 2.0 == pytest.approx(rise, rel=1e-3)


MANOEUVRE = ((1.10, 1.05, 1.08, 1.07), (1.02, 0.97, 0.99, 1.01), (0.97, 1.03, 1.0, 1.0))


def response(heading_deg: float, *, from_ground: bool) -> np.ndarray:
    """What the body feels: rate, specific force, velocity in body axes; ten times a second."""
    plant = Plant(QUAD5IN, CALM, math.radians(heading_deg), seed=0)
    if not from_ground:
        plant.place(ALOFT, rotor_speed=QUAD5IN.hover_speed)
    rows = []
    for factors in MANOEUVRE:
        for _ in range(3):
            truth = fly(plant, commands_for(QUAD5IN, factors), 100)
            rows.append(
                truth.rate_body_rad_s
                + truth.specific_force_body_m_s2
                + rotate_to_body(truth.q_body_to_ned, truth.velocity_ned_m_s)
            )
    return np.array(rows)


# On the ground the contact solver stops at its tolerance, 1e-8 of its scale, not at rounding.
@pytest.mark.parametrize(
    ("from_ground", "tolerance"), [(False, 1e-9), (True, 1e-6)], ids=["aloft", "take-off"]
)
@pytest.mark.parametrize("heading_deg", [90.0, 180.0, -135.0])
def test_the_body_responds_the_same_at_every_heading(
    heading_deg: float, from_ground: bool, tolerance: float
) -> None:
    expected = response(0.0, from_ground=from_ground)
    assert np.abs(expected[-1]).max() > 1.0  # it does manoeuvre
    found = response(heading_deg, from_ground=from_ground)
    np.testing.assert_allclose(found, expected, atol=tolerance)


def test_a_step_of_1_ms_is_short_enough() -> None:
    def end(step_us: int) -> Truth:
        plant = hovering(QUAD5IN, 0.5)
        for factors in MANOEUVRE:
            for _ in range(300_000 // step_us):
                plant.step(commands_for(QUAD5IN, factors), step_us)
        return plant.truth

    coarse, fine = end(1000), end(125)
    # Only drag is held over a step. 1 mm and 1 mrad after a second of rolling and pitching are
    # a thousandth of what the sensors see.
    assert coarse.position_ned_m == pytest.approx(fine.position_ned_m, abs=1e-3)
    assert coarse.q_body_to_ned == pytest.approx(fine.q_body_to_ned, abs=1e-3)
    assert max(map(abs, coarse.rate_body_rad_s)) > 1.0


def test_a_long_step_is_the_same_as_its_parts() -> None:
    commands = commands_for(QUAD5IN, MANOEUVRE[0])
    whole, parts = hovering(QUAD5IN), hovering(QUAD5IN)
    whole.step(commands, 2500)
    for part_us in (1000, 1000, 500):
        parts.step(commands, part_us)
    assert whole.truth.position_ned_m == parts.truth.position_ned_m
    assert whole.truth.q_body_to_ned == parts.truth.q_body_to_ned
    assert whole.truth.time_us == parts.truth.time_us == 2500


def test_specific_force_sums_up_to_the_change_of_velocity() -> None:
    plant = hovering(QUAD5IN)
    before = plant.truth
    velocity = np.array(before.velocity_ned_m_s)
    for _ in range(500):
        q0 = plant.truth.q_body_to_ned
        truth = fly(plant, commands_for(QUAD5IN, MANOEUVRE[1]), 1)
        middle = np.array(q0) + np.array(truth.q_body_to_ned)
        w, x, y, z = (middle / np.linalg.norm(middle)).tolist()
        force = np.array(rotate_to_world((w, x, y, z), truth.specific_force_body_m_s2))
        velocity += (force + np.array([0.0, 0.0, G])) * 1e-3
    np.testing.assert_allclose(velocity, truth.velocity_ned_m_s, atol=1e-9)


@pytest.mark.parametrize(("commands", "duration_us"), [((0.0,) * 3, 1000), ((0.0,) * 4, 0)])
def test_a_wrong_step_is_refused(commands: Sequence[float], duration_us: int) -> None:
    with pytest.raises(ValueError, match="4 commands and a positive time"):
        hovering(QUAD5IN).step(commands, duration_us)


def test_place_turns_the_vehicle_when_asked() -> None:
    plant = hovering(QUAD5IN, heading_rad=1.0)
    plant.place(ALOFT)
    assert plant.truth.q_body_to_ned == pytest.approx(level_at_heading(1.0))
    plant.place(ALOFT, q_body_to_ned=level_at_heading(2.0))
    assert plant.truth.q_body_to_ned == pytest.approx(level_at_heading(2.0))
