"""The attitude stand: pendulum, friction and pushes by closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from test_plant_flight import OFF, commands_for, fly
from test_plant_vehicle import QUAD5IN, VEHICLES

from strix.plant import Plant, Push, Stand, Surroundings, VehicleNumbers
from strix.plant.frames import level_at_heading, rotate_to_body, rotate_to_world

G = 9.80665
FREE = Stand(centre_below_pivot_m=0.0, coulomb_n_m=0.0, viscous_n_m_s=0.0)
# Without rotor drag and without air: the closed forms are a body's alone.
ROLLED = (math.cos(0.05), math.sin(0.05), 0.0, 0.0)  # 0.1 rad


def on_stand(
    stand: Stand, vehicle: VehicleNumbers = QUAD5IN, pushes: tuple[Push, ...] = ()
) -> Plant:
    return Plant(vehicle, Surroundings(stand=stand, pushes=pushes), 0.0, seed=0)


def roll_rad(plant: Plant) -> float:
    w, x, _, _ = plant.truth.q_body_to_ned
    return 2.0 * math.atan2(x, w)


@VEHICLES
def test_hanging_below_its_pivot_the_vehicle_swings_as_a_pendulum(vehicle: VehicleNumbers) -> None:
    below_m = 0.02
    plant = on_stand(replace(FREE, centre_below_pivot_m=below_m), vehicle)
    plant.place((0.0, 0.0, 0.0), q_body_to_ned=ROLLED)
    crossings = []
    before = roll_rad(plant)
    for step in range(1, 5000):
        plant.step(OFF, 1000)
        now = roll_rad(plant)
        if before > 0.0 >= now:
            crossings.append(step - now / (now - before))
        before = now
    period_s = float(np.diff(crossings).mean()) * 1e-3
    mass, inertia = vehicle.mass_kg, vehicle.inertia_kg_m2[0]
    small = 2 * math.pi * math.sqrt((inertia + mass * below_m**2) / (mass * G * below_m))
    # An amplitude of A makes it longer by A^2 / 16 = 6e-4, and by no more than 1e-6 beyond.
    assert period_s == pytest.approx(small * (1 + 0.1**2 / 16), rel=2e-5)


def test_with_its_mass_above_the_pivot_it_falls_over_as_fast_as_it_should() -> None:
    above_m = 0.02
    plant = on_stand(replace(FREE, centre_below_pivot_m=-above_m))
    plant.place((0.0, 0.0, 0.0), q_body_to_ned=(1.0, 5e-4, 0.0, 0.0))  # 1 mrad
    inertia = QUAD5IN.inertia_kg_m2[0] + QUAD5IN.mass_kg * above_m**2
    growth = math.sqrt(QUAD5IN.mass_kg * G * above_m / inertia)
    fly(plant, OFF, 500)
    assert roll_rad(plant) == pytest.approx(1e-3 * math.cosh(growth * 0.5), rel=1e-3)


def test_a_push_gives_its_angular_momentum() -> None:
    push = Push(at_s=0.1, torque_n_m=(0.3, -0.2, 0.1), duration_s=0.05)
    plant = on_stand(FREE, pushes=(push,))
    assert fly(plant, OFF, 100).rate_body_rad_s == (0.0, 0.0, 0.0)
    truth = fly(plant, OFF, 50)
    momentum_body = np.array(QUAD5IN.inertia_kg_m2) * truth.rate_body_rad_s
    # The torque turns with the body, the momentum does not: compare while it has hardly turned,
    # by 0.12 rad, of which the momentum is off by half.
    size = 0.05 * math.sqrt(0.3**2 + 0.2**2 + 0.1**2)
    np.testing.assert_allclose(momentum_body, 0.05 * np.array(push.torque_n_m), atol=0.08 * size)
    x, y, z = momentum_body.tolist()
    momentum = np.array(rotate_to_world(truth.q_body_to_ned, (x, y, z)))
    truth = fly(plant, OFF, 1000)
    x, y, z = (np.array(QUAD5IN.inertia_kg_m2) * truth.rate_body_rad_s).tolist()
    later = rotate_to_world(truth.q_body_to_ned, (x, y, z))
    np.testing.assert_allclose(later, momentum, atol=1e-6 * size)


def test_dry_friction_stops_it_when_and_where_it_should() -> None:
    coulomb = 0.004
    plant = on_stand(replace(FREE, coulomb_n_m=coulomb))
    plant.place((0.0, 0.0, 0.0), rate_body_rad_s=(0.5, 0.0, 0.0))
    inertia = QUAD5IN.inertia_kg_m2[0]
    stops_s = inertia * 0.5 / coulomb
    truth = fly(plant, OFF, round(0.5 * stops_s * 1000))
    assert truth.rate_body_rad_s[0] == pytest.approx(0.25, rel=0.01)
    fly(plant, OFF, round(0.6 * stops_s * 1000))
    stopped = roll_rad(plant)
    assert stopped == pytest.approx(0.5 * 0.5 * stops_s, rel=0.02)
    truth = fly(plant, OFF, 5000)
    assert truth.rate_body_rad_s == pytest.approx((0, 0, 0), abs=1e-4)
    assert roll_rad(plant) == pytest.approx(stopped, abs=1e-4)


def test_friction_holds_a_small_weight_off_the_pivot_and_no_larger() -> None:
    # Tilted by 0.1 rad the weight pulls with m g d sin(0.1); at d = 5 mm that is 0.0041 N m.
    for coulomb, holds in ((0.006, True), (0.002, False)):
        plant = on_stand(Stand(0.005, coulomb, 0.0))
        plant.place((0.0, 0.0, 0.0), q_body_to_ned=ROLLED)
        fly(plant, OFF, 10_000)
        # Held it creeps by less than the gyro's step of resolution.
        assert (abs(roll_rad(plant) - 0.1) < 0.01) is holds


def test_viscous_friction_slows_it_exponentially() -> None:
    viscous = 0.002
    plant = on_stand(replace(FREE, viscous_n_m_s=viscous))
    plant.place((0.0, 0.0, 0.0), rate_body_rad_s=(0.0, 0.0, 1.0))
    truth = fly(plant, OFF, 2000)
    expected = math.exp(-2.0 * viscous / QUAD5IN.inertia_kg_m2[2])
    assert truth.rate_body_rad_s[2] == pytest.approx(expected, rel=1e-4)


def test_the_imu_at_the_pivot_feels_the_weight_and_nothing_else() -> None:
    plant = on_stand(Stand())
    plant.place((0.0, 0.0, 0.0), rate_body_rad_s=(2.0, -1.0, 3.0))
    for _ in range(500):
        plant.step(commands_for(QUAD5IN, (0.8, 0.7, 0.9, 0.8)), 1000)
        truth = plant.truth
        assert truth.position_ned_m == truth.velocity_ned_m_s == (0.0, 0.0, 0.0)
        assert not truth.on_ground
        felt = truth.specific_force_body_m_s2
        # Turned at the attitude halfway: within half a step of some rad/s.
        expected = rotate_to_body(truth.q_body_to_ned, (0.0, 0.0, -G))
        assert felt == pytest.approx(expected, abs=G * 0.5e-3 * 10.0)
    assert abs(roll_rad(plant)) > 0.1


def test_thrust_turns_it_on_the_stand_as_in_the_air() -> None:
    commands = commands_for(QUAD5IN, (1.05, 0.95, 0.95, 1.05))
    stand = on_stand(FREE)
    stand.place((0.0, 0.0, 0.0), rotor_speed=QUAD5IN.hover_speed)
    aloft = Plant(QUAD5IN, Surroundings(), 0.0, seed=0)
    aloft.place((0.0, 0.0, -100.0), rotor_speed=QUAD5IN.hover_speed)
    on, off = fly(stand, commands, 100), fly(aloft, commands, 100)
    # In the air it also gathers speed, and the wind of that turns it a little.
    assert on.rate_body_rad_s == pytest.approx(off.rate_body_rad_s, rel=2e-3, abs=1e-6)
    assert on.rate_body_rad_s[0] > 0.1


def test_it_starts_level_at_its_heading_and_cannot_be_moved() -> None:
    plant = Plant(QUAD5IN, Surroundings(stand=Stand()), 1.0, seed=0)
    assert fly(plant, OFF, 1000).q_body_to_ned == pytest.approx(level_at_heading(1.0), abs=1e-9)
    with pytest.raises(ValueError, match="a vehicle on the stand stays"):
        plant.place((0.0, 0.0, -1.0))
