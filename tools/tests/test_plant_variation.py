"""A vehicle that is not what its file says, and what its motors do to the sensors."""

import math
from dataclasses import replace

import numpy as np
import pytest
from test_plant_flight import ALOFT, commands_for, fly
from test_plant_vehicle import QUAD5IN, UGGLAN_Q450, VEHICLES

from strix.plant import Plant, SensorSuite, Surroundings, Variation, VehicleNumbers
from strix.plant.frames import Vector
from strix.plant.sensors import DEFAULT_CONSTANTS

G = 9.80665
CALM = Surroundings()


def hovering(variation: Variation, vehicle: VehicleNumbers = QUAD5IN) -> Plant:
    plant = Plant(variation.applied_to(vehicle), CALM, 0.0, seed=0)
    plant.place(ALOFT, rotor_speed=vehicle.hover_speed)
    return plant


def test_each_number_is_changed_by_its_own_factor() -> None:
    vehicle = Variation(
        mass=1.2, inertia=(0.8, 0.9, 1.1), thrust=0.9, motor_time_constant=2.0
    ).applied_to(QUAD5IN)
    assert vehicle.mass_kg == pytest.approx(0.996)
    assert vehicle.inertia_kg_m2 == pytest.approx((0.0024, 0.0036, 0.0055))
    assert vehicle.thrust_constant == pytest.approx(0.9 * QUAD5IN.thrust_constant)
    assert vehicle.torque_constant == pytest.approx(0.9 * QUAD5IN.torque_constant)
    assert vehicle.motor_time_constant_s == pytest.approx(0.08)
    assert Variation().applied_to(QUAD5IN) == QUAD5IN


def test_a_weak_motor_drops_its_corner() -> None:
    plant = hovering(Variation(rotor_strength=(0.8, 1.0, 1.0, 1.0)))
    before = fly(plant, commands_for(QUAD5IN, (1, 1, 1, 1)), 19)
    truth = fly(plant, commands_for(QUAD5IN, (1, 1, 1, 1)), 1)
    assert truth.thrust_to_weight == pytest.approx(0.95)
    # M1, front left, lacks a twentieth of the weight: the left drops (-x) and the front (-y); its
    # reaction, which turns the body left, lacks too (+z).
    lack = 0.05 * QUAD5IN.weight_n
    ratio = QUAD5IN.torque_constant / QUAD5IN.thrust_constant
    torques = np.array([-0.08 * lack, -0.08 * lack, ratio * lack])
    rise = np.array(truth.rate_body_rad_s) - before.rate_body_rad_s
    expected = torques / QUAD5IN.inertia_kg_m2 * 1e-3
    # Rotor drag of hubs that move at 1 cm/s by then: 0.1 % of the roll, a few of the small yaw.
    np.testing.assert_allclose(rise[:2], expected[:2], rtol=0.01)
    np.testing.assert_allclose(rise[2], expected[2], rtol=0.05)


@VEHICLES
@pytest.mark.parametrize("centre_m", [(0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (-0.01, 0.01, 0.01)])
def test_hover_with_the_mass_off_the_centre_needs_the_moment_of_the_weight(
    vehicle: VehicleNumbers, centre_m: Vector
) -> None:
    x, y, _ = centre_m
    # Thrusts that carry the weight, whose centre of pressure is (x, y): each rotor's share is
    # 1/4 (1 + x/X sign + y/Y sign). The yaw torques stay in balance: the corrections cancel.
    factors = [
        math.sqrt(1.0 + x / abs(r.x_m) * math.copysign(1, r.x_m) + y / r.y_m)
        for r in vehicle.rotors
    ]
    plant = Plant(Variation(centre_of_mass_m=centre_m).applied_to(vehicle), CALM, 0.0, seed=0)
    plant.place(ALOFT, rotor_speed=vehicle.hover_speed)
    # Let the rotors reach their speeds on the way, then start anew at rest.
    commands = commands_for(vehicle, factors)
    fly(plant, commands, 2000)
    speeds = plant.truth.rotor_speed
    still = Plant(Variation(centre_of_mass_m=centre_m).applied_to(vehicle), CALM, 0.0, seed=0)
    still.place(ALOFT)
    still._speeds = list(speeds)
    truth = fly(still, commands, 1000)
    assert truth.rate_body_rad_s == pytest.approx((0, 0, 0), abs=1e-9)
    assert truth.velocity_ned_m_s == pytest.approx((0, 0, 0), abs=1e-9)


def test_off_the_centre_of_mass_the_imu_feels_the_turning() -> None:
    centre_m = (0.02, 0.0, 0.0)
    plant = Plant(Variation(centre_of_mass_m=centre_m).applied_to(QUAD5IN), CALM, 0.0, seed=0)
    # Turning about its centre of mass in free fall: the IMU, 2 cm behind it, goes in a circle.
    rate = 5.0
    plant.place((0.0, 0.0, -1000.0), (0.0, -0.02 * rate, 0.0), rate_body_rad_s=(0.0, 0.0, rate))
    truth = fly(plant, (-1e9,) * 4, 1)
    # Towards the centre, forward: w^2 r. Halfway through the step it is turned by 2.5 mrad.
    assert truth.specific_force_body_m_s2 == pytest.approx((rate**2 * 0.02, 0, 0), abs=2e-3)
    truth = fly(plant, (-1e9,) * 4, 249)
    # Its centre of mass only falls. Drag, up to 1.8e-3 1/s at 2.5 m/s, has taken 2e-4 by then.
    speed = math.hypot(*truth.velocity_ned_m_s[:2])
    assert speed == pytest.approx(0.02 * rate, rel=3e-3)


@VEHICLES
def test_a_heavier_vehicle_sinks_and_a_lagging_motor_lags(vehicle: VehicleNumbers) -> None:
    truth = fly(hovering(Variation(mass=1.2), vehicle), commands_for(vehicle, (1, 1, 1, 1)), 100)
    # The rotors carry a 1.2th of it.
    assert truth.velocity_ned_m_s[2] == pytest.approx(0.1 * G * (1 - 1 / 1.2), rel=0.01)
    slow = Plant(Variation(motor_time_constant=2.0).applied_to(vehicle), CALM, 0.0, seed=0)
    slow.place(ALOFT)
    speed = fly(slow, commands_for(vehicle, (1, 1, 1, 1)), 80).rotor_speed[0]
    reached = 1.0 - math.exp(-0.08 / (2.0 * vehicle.motor_time_constant_s))
    assert speed == pytest.approx(reached * vehicle.hover_speed, rel=1e-9)


CLEAN = replace(
    DEFAULT_CONSTANTS, accel_sigma_m_s2=0.0, accel_bias_sigma_m_s2=0.0, imu_noise_bandwidth_hz=500.0
)


def shaken(surroundings: Surroundings, factor: float, count: int = 4000) -> np.ndarray:
    """What the accelerometer adds to the truth while hanging from rotors of that speed."""
    plant = Plant(QUAD5IN, CALM, 0.0, seed=0)
    suite = SensorSuite(surroundings, 0, CLEAN)
    commands = commands_for(QUAD5IN, (factor,) * 4)
    plant.place(ALOFT, rotor_speed=QUAD5IN.hover_speed * factor)
    rows = []
    for _ in range(count):
        plant.step(commands, 1000)
        imu = suite.sample(plant.truth).imu
        assert imu is not None
        rows.append(np.subtract(imu.accel_m_s2, plant.truth.specific_force_body_m_s2))
    return np.array(rows)


@pytest.mark.parametrize(
    ("factor", "seen_hz"),
    [(1.0, 175.8), (1.8, 316.5), (3.2, 1000.0 - 562.6)],
    ids=["hover", "fast", "beyond half the sampling rate"],
)
def test_unbalanced_rotors_shake_once_a_turn_as_the_sampling_sees_it(
    factor: float, seen_hz: float
) -> None:
    vehicle = Surroundings(vibration_at_hover_m_s2=(2.0, 0.0, 0.0))
    added = shaken(vehicle, min(factor, 400.0 / QUAD5IN.hover_speed) if factor < 2 else factor)
    if factor > 2:
        # Quad5in's ESCs stop at 400 rev/s: place() starts faster, and the rotors slow down.
        added = added[:60]
    spectrum = np.abs(np.fft.rfft(added[:, 0] * np.hanning(len(added))))
    frequency_hz = np.fft.rfftfreq(len(added), 1e-3)
    peak = float(frequency_hz[1 + spectrum[1:].argmax()])
    assert peak == pytest.approx(seen_hz, abs=max(0.5, 2.0 * frequency_hz[1]))
    assert np.abs(added[:, 1:]).max() < 0.006  # half a step of its resolution, in hover
    if factor < 2:
        # All four in step: the amplitude is 2 at hover, and grows with the speed's square.
        assert added[:, 0].max() == pytest.approx(2.0 * factor**2, rel=0.02)


def test_rectified_vibration_is_a_bias_that_grows_with_thrust() -> None:
    surroundings = Surroundings(rectified_at_hover_m_s2=(0.4, 0.0, -0.6))
    for factor in (0.5, 1.0, 1.4):
        mean = shaken(surroundings, factor, 500).mean(axis=0)
        expected = np.array([0.4, 0.0, -0.6]) * factor**2
        np.testing.assert_allclose(mean, expected, atol=0.01)  # a step of its resolution


def test_ugglan_stops_a_motor_that_is_told_to_turn_too_slowly() -> None:
    vehicle = replace(UGGLAN_Q450, speed_min=200.0)
    plant = Plant(vehicle, CALM, 0.0, seed=0)
    plant.place(ALOFT, rotor_speed=300.0)
    slow, slower = vehicle.command_for_speed(201.0), vehicle.command_for_speed(199.0)
    truth = fly(plant, (slow, slow, slower, slow), 2000)
    assert truth.rotor_speed == pytest.approx((201.0, 201.0, 0.0, 201.0), abs=1e-6)


def test_under_a_roof_only_the_satellites_are_missing() -> None:
    plant = Plant(QUAD5IN, CALM, 0.0, seed=0)
    outside, inside = SensorSuite(CALM, 3), SensorSuite(Surroundings(roof=True), 3)
    for _ in range(400):
        plant.step((-1e9,) * 4, 1000)
        there, here = outside.sample(plant.truth), inside.sample(plant.truth)
        assert here.gps is None
        assert (here.imu, here.mag, here.baro) == (there.imu, there.mag, there.baro)
