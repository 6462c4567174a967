"""The vehicle in the air and on the ground: ESC commands in, truth out.

Left out: change of thrust with inflow, ground effect, propeller vibration, flexible arms.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from strix.plant.frames import (
    ZERO,
    Quaternion,
    Vector,
    between,
    level_at_heading,
    rotate_to_body,
)
from strix.plant.noise import normal_stream
from strix.plant.rigid_body import MAX_STEP_US, RigidBody
from strix.plant.scenario import Scenario
from strix.plant.vehicle import STANDARD_GRAVITY_M_S2, VehicleNumbers
from strix.plant.wind import Wind

# Rotor drag (H-force) of four hovering rotors, per unit of mass and speed. RotorS (Furrer et al.
# 2016) has 8.06e-5 N per rad/s and m/s on each rotor of its Hummingbird (0.716 kg, hover at
# 453 rad/s), which is 0.20 1/s.
_HOVER_ROTOR_DRAG_PER_S = 0.2

# Drag area of frame and battery: a bluff body, drag coefficient 1, of about 0.1 m x 0.1 m.
_BODY_DRAG_AREA_M2 = 0.01
_AIR_DENSITY_KG_M3 = 1.225  # standard atmosphere at sea level

_WIND_STREAM = 0  # number of the random stream; the sensors have the others


@dataclass(frozen=True, slots=True)
class Truth:
    """What is so, at one instant. Frames: NED from the place of rest at the start, body FRD."""

    time_us: int
    position_ned_m: Vector  # of the centre of mass, where the IMU is
    velocity_ned_m_s: Vector
    q_body_to_ned: Quaternion
    rate_body_rad_s: Vector
    specific_force_body_m_s2: Vector  # mean over the last step; at rest, level: [0 0 -g]
    rotor_speed: tuple[float, float, float, float]  # M1..M4, in the vehicle's speed unit
    on_ground: bool
    wind_ned_m_s: Vector
    thrust_to_weight: float


class Plant:
    """Starts at rest on the ground, motors off, facing heading_rad, at time 0."""

    def __init__(
        self, vehicle: VehicleNumbers, scenario: Scenario, heading_rad: float, seed: int
    ) -> None:
        self._vehicle = vehicle
        self._body = RigidBody(vehicle, level_at_heading(heading_rad))
        self._wind = Wind(scenario, normal_stream(seed, _WIND_STREAM))
        self._rotor_drag = (
            _HOVER_ROTOR_DRAG_PER_S * vehicle.mass_kg / (4.0 * vehicle.hover_speed)
        )  # N per speed_unit and m/s, one rotor
        self._momentum_per_speed = vehicle.rotor_inertia_kg_m2 * vehicle.rad_s_per_unit
        self._time_us = 0
        self._speeds = [0.0, 0.0, 0.0, 0.0]
        self._truth = self._observe((0.0, 0.0, -STANDARD_GRAVITY_M_S2))

    @property
    def truth(self) -> Truth:
        return self._truth

    def place(
        self,
        position_ned_m: Vector,
        velocity_ned_m_s: Vector = ZERO,
        q_body_to_ned: Quaternion | None = None,
        rate_body_rad_s: Vector = ZERO,
        rotor_speed: float = 0.0,
    ) -> None:
        """Move the vehicle, for example to start in the air; the attitude stays unless given."""
        self._body.place(
            position_ned_m,
            velocity_ned_m_s,
            q_body_to_ned or self._body.q_body_to_ned,
            rate_body_rad_s,
        )
        self._speeds = [rotor_speed] * 4
        self._truth = self._observe(self._truth.specific_force_body_m_s2)

    def step(self, commands: Sequence[float], duration_us: int) -> None:
        """Hold four ESC commands (M1..M4) for a time."""
        if len(commands) != 4 or duration_us <= 0:
            raise ValueError(
                f"4 commands and a positive time expected, found {len(commands)}, {duration_us} us"
            )
        targets = [self._vehicle.speed_for_command(command) for command in commands]
        velocity, attitude = self._body.velocity_ned_m_s, self._body.q_body_to_ned
        left_us = duration_us
        while left_us > 0:
            step_us = min(left_us, MAX_STEP_US)
            self._advance(targets, step_us)
            left_us -= step_us
        self._time_us += duration_us
        self._truth = self._observe(self._specific_force(velocity, attitude, duration_us * 1e-6))

    def _advance(self, targets: Sequence[float], step_us: int) -> None:
        step_s = step_us * 1e-6
        self._wind.advance(step_s)
        # Exact first-order lag. The wrench of the step uses the speeds in its middle.
        half = 1.0 - math.exp(-0.5 * step_s / self._vehicle.motor_time_constant_s)
        start = self._speeds
        middle = [n + (goal - n) * half for n, goal in zip(start, targets, strict=True)]
        end = [n + (goal - n) * half for n, goal in zip(middle, targets, strict=True)]
        spin_up_n_m = (self._rotor_momentum(end) - self._rotor_momentum(start)) / step_s
        self._speeds = end
        self._body.advance(*self._wrench(middle, spin_up_n_m), step_us)

    def _wrench(self, speeds: Sequence[float], spin_up_n_m: float) -> tuple[Vector, Vector]:
        """Force (N) and torque about the centre of mass (N m) of rotors and air, body FRD."""
        vehicle, body = self._vehicle, self._body
        vn, ve, vd = body.velocity_ned_m_s
        wn, we, wd = self._wind.velocity_ned_m_s
        # Velocity through the air.
        u, v, w = rotate_to_body(body.q_body_to_ned, (vn - wn, ve - we, vd - wd))
        p, q, r = body.rate_body_rad_s

        drag = 0.5 * _AIR_DENSITY_KG_M3 * _BODY_DRAG_AREA_M2 * math.sqrt(u * u + v * v + w * w)
        fx, fy, fz = -drag * u, -drag * v, -drag * w

        # Spinning rotors carry angular momentum h along body z: torque -h' z - omega x h z.
        h = self._rotor_momentum(speeds)
        tx, ty, tz = -q * h, p * h, -spin_up_n_m

        for rotor, n in zip(vehicle.rotors, speeds, strict=True):
            x, y = rotor.x_m, rotor.y_m
            thrust = vehicle.thrust_constant * n * n  # along -z
            # H-force: against the hub's velocity in the rotor plane, v + omega x r.
            hx = -self._rotor_drag * n * (u - r * y)
            hy = -self._rotor_drag * n * (v + r * x)
            fx += hx
            fy += hy
            fz -= thrust
            # r x F; the air turns the body against the rotor's own spin.
            tx -= y * thrust
            ty += x * thrust
            tz += x * hy - y * hx - rotor.spin * vehicle.torque_constant * n * n
        return (fx, fy, fz), (tx, ty, tz)

    def _rotor_momentum(self, speeds: Sequence[float]) -> float:
        """Angular momentum of the spinning rotors about body z, N m s."""
        return self._momentum_per_speed * sum(
            rotor.spin * n for rotor, n in zip(self._vehicle.rotors, speeds, strict=True)
        )

    def _specific_force(self, velocity: Vector, attitude: Quaternion, duration_s: float) -> Vector:
        """Mean of acceleration minus gravity since then, contact included, body FRD.

        From the change of velocity, as an accelerometer's own filter averages; turned into the
        body at the attitude halfway, which is exact to second order in the angle turned.
        """
        now = self._body.velocity_ned_m_s
        return rotate_to_body(
            between(attitude, self._body.q_body_to_ned),
            (
                (now[0] - velocity[0]) / duration_s,
                (now[1] - velocity[1]) / duration_s,
                (now[2] - velocity[2]) / duration_s - STANDARD_GRAVITY_M_S2,
            ),
        )

    def _observe(self, specific_force: Vector) -> Truth:
        body, (n1, n2, n3, n4) = self._body, self._speeds
        thrust = self._vehicle.thrust_constant * (n1 * n1 + n2 * n2 + n3 * n3 + n4 * n4)
        return Truth(
            time_us=self._time_us,
            position_ned_m=body.position_ned_m,
            velocity_ned_m_s=body.velocity_ned_m_s,
            q_body_to_ned=body.q_body_to_ned,
            rate_body_rad_s=body.rate_body_rad_s,
            specific_force_body_m_s2=specific_force,
            rotor_speed=(n1, n2, n3, n4),
            on_ground=body.on_ground,
            wind_ned_m_s=self._wind.velocity_ned_m_s,
            thrust_to_weight=thrust / self._vehicle.weight_n,
        )
