"""The vehicle in the air and on the ground: ESC commands in, truth out.

Left out: change of thrust with inflow, ground effect, propeller vibration, flexible arms.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from strix.plant.battery import ELECTRONICS_W, MOTOR_EFFICIENCY, Battery
from strix.plant.frames import (
    ZERO,
    Quaternion,
    Vector,
    between,
    level_at_heading,
    rotate_to_body,
)
from strix.plant.noise import normal_stream
from strix.plant.rigid_body import MAX_STEP_US, GimballedBody, RigidBody
from strix.plant.surroundings import Surroundings
from strix.plant.vehicle import STANDARD_GRAVITY_M_S2, VehicleNumbers
from strix.plant.wind import Wind

# Rotor drag (H-force) of four hovering rotors, per unit of mass and speed. RotorS (Furrer et al.
# 2016) has 8.06e-5 N per rad/s and m/s on each rotor of its Hummingbird (0.716 kg, hover at
# 453 rad/s), which is 0.20 1/s.
_HOVER_ROTOR_DRAG_PER_S = 0.2

# Drag area of frame and battery: a bluff body, drag coefficient 1, of about 0.1 m x 0.1 m.
_BODY_DRAG_AREA_M2 = 0.01
_AIR_DENSITY_KG_M3 = 1.225  # standard atmosphere at sea level

# Numbers of the random streams; the sensors have 1 to 6.
_WIND_STREAM, _LATER_WIND_STREAM = 0, 7


@dataclass(frozen=True, slots=True)
class Truth:
    """What is so, at one instant. Frames: NED from the place of rest at the start, body FRD."""

    time_us: int
    position_ned_m: Vector  # of the frame's centre, where the IMU is
    velocity_ned_m_s: Vector
    q_body_to_ned: Quaternion
    rate_body_rad_s: Vector
    specific_force_body_m_s2: Vector  # mean over the last step; at rest, level: [0 0 -g]
    rotor_speed: tuple[float, float, float, float]  # M1..M4, in the vehicle's speed unit
    rotor_turns: tuple[float, float, float, float]  # M1..M4, since power-up
    on_ground: bool
    wind_ned_m_s: Vector
    thrust_to_weight: float
    battery_v: float
    battery_a: float  # 0 without a battery


class Plant:
    """Starts at rest on the ground or the stand, motors off, facing heading_rad, at time 0."""

    def __init__(
        self, vehicle: VehicleNumbers, surroundings: Surroundings, heading_rad: float, seed: int
    ) -> None:
        self._vehicle = vehicle
        self._surroundings = surroundings
        self._seed = seed
        self._body: RigidBody | GimballedBody
        if surroundings.stand is None:
            self._body = RigidBody(vehicle, level_at_heading(heading_rad))
        else:
            self._body = GimballedBody(vehicle, level_at_heading(heading_rad), surroundings.stand)
        self._wind = Wind(surroundings, normal_stream(seed, _WIND_STREAM))
        self._pushes = [
            (round(push.at_s * 1e6), round((push.at_s + push.duration_s) * 1e6), push.torque_n_m)
            for push in surroundings.pushes
        ]
        self._battery: Battery | None = None
        if surroundings.battery is not None:
            hover_w = self._power([vehicle.hover_speed] * 4)
            self._battery = Battery(surroundings.battery, vehicle.battery_cells, hover_w)
        self._rotor_drag = (
            _HOVER_ROTOR_DRAG_PER_S * vehicle.mass_kg / (4.0 * vehicle.hover_speed)
        )  # N per speed_unit and m/s, one rotor
        self._momentum_per_speed = vehicle.rotor_inertia_kg_m2 * vehicle.rad_s_per_unit
        self._turns_per_s = vehicle.rad_s_per_unit / (2.0 * math.pi)
        # x, y, thrust over n^2, torque on the body over n^2; M1..M4.
        self._rotors = [
            (
                rotor.x_m,
                rotor.y_m,
                vehicle.thrust_constant * rotor.strength,
                -rotor.spin * vehicle.torque_constant * rotor.strength,
            )
            for rotor in vehicle.rotors
        ]
        self._spins = tuple(rotor.spin for rotor in vehicle.rotors)
        self._thrust_constants = tuple(rotor[2] for rotor in self._rotors)
        # Exact first-order lag over half a step of the usual length.
        self._half_step = (MAX_STEP_US, self._lag(MAX_STEP_US))
        self._time_us = 0
        self._speeds = [0.0, 0.0, 0.0, 0.0]
        self._turns = [0.0, 0.0, 0.0, 0.0]
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

    # What goes wrong with the vehicle and the air around it, from now on.

    def weaken_rotor(self, index: int, strength: float) -> None:
        """A rotor (0 for M1) gives so much of its thrust and torque; 0: it has lost its blades."""
        x, y, _, _ = self._rotors[index]
        vehicle, rotor = self._vehicle, self._vehicle.rotors[index]
        strength *= rotor.strength
        self._rotors[index] = (
            x,
            y,
            vehicle.thrust_constant * strength,
            -rotor.spin * vehicle.torque_constant * strength,
        )
        self._thrust_constants = tuple(rotor[2] for rotor in self._rotors)

    def blow(self, wind_mean_ned_m_s: Vector) -> None:
        """Another mean wind with gusts."""
        around = replace(self._surroundings, wind_mean_ned_m_s=wind_mean_ned_m_s, gusts=True)
        self._wind = Wind(around, normal_stream(self._seed, _LATER_WIND_STREAM))

    def drain_battery(self, charge: float) -> None:
        """The battery has no more than this left, of 1."""
        if self._battery is not None:
            self._battery.charge = min(self._battery.charge, charge)

    def step(self, commands: Sequence[float], duration_us: int) -> None:
        """Hold four ESC commands (M1..M4) for a time."""
        if len(commands) != 4 or duration_us <= 0:
            raise ValueError(
                f"4 commands and a positive time expected, found {len(commands)}, {duration_us} us"
            )
        targets = [self._vehicle.speed_for_command(command) for command in commands]
        velocity, attitude = self._body.velocity_ned_m_s, self._body.q_body_to_ned
        begin_us, left_us = self._time_us, duration_us
        while left_us > 0:
            step_us = min(left_us, MAX_STEP_US)
            self._advance(targets, step_us)
            left_us -= step_us
            self._time_us += step_us
        duration_s = (self._time_us - begin_us) * 1e-6
        self._truth = self._observe(self._specific_force(velocity, attitude, duration_s))

    def _lag(self, step_us: int) -> float:
        return 1.0 - math.exp(-0.5e-6 * step_us / self._vehicle.motor_time_constant_s)

    def _advance(self, targets: Sequence[float], step_us: int) -> None:
        step_s = step_us * 1e-6
        self._wind.advance(step_s, -self._body.position_ned_m[2])
        if self._battery is not None:
            self._battery.advance(self._power(self._speeds), step_s)
            # An ESC's command is a share of the battery's voltage: the speed goes with both.
            share = self._battery.voltage_v / self._vehicle.curve_voltage_v
            targets = [target * share for target in targets]
        # The wrench of the step uses the speeds in its middle.
        if self._half_step[0] != step_us:
            self._half_step = (step_us, self._lag(step_us))
        half = self._half_step[1]
        start = self._speeds
        middle = [n + (goal - n) * half for n, goal in zip(start, targets, strict=True)]
        end = [n + (goal - n) * half for n, goal in zip(middle, targets, strict=True)]
        spin_up_n_m = (self._rotor_momentum(end) - self._rotor_momentum(start)) / step_s
        self._speeds = end
        turns = self._turns_per_s * step_s
        self._turns = [t + n * turns for t, n in zip(self._turns, middle, strict=True)]
        force, torque = self._wrench(middle, spin_up_n_m)
        if self._pushes:
            torque = self._pushed(torque)
        self._body.advance(force, torque, step_us)

    def _wrench(self, speeds: Sequence[float], spin_up_n_m: float) -> tuple[Vector, Vector]:
        """Force (N) and torque about the frame's centre (N m) of rotors and air, body FRD."""
        body = self._body
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

        rotor_drag = self._rotor_drag
        for (x, y, thrust_constant, torque_constant), n in zip(self._rotors, speeds, strict=True):
            square = n * n
            thrust = thrust_constant * square  # along -z
            # H-force: against the hub's velocity in the rotor plane, v + omega x r.
            hx = -rotor_drag * n * (u - r * y)
            hy = -rotor_drag * n * (v + r * x)
            fx += hx
            fy += hy
            fz -= thrust
            # r x F; the air turns the body against the rotor's own spin.
            tx -= y * thrust
            ty += x * thrust
            tz += x * hy - y * hx + torque_constant * square
        return (fx, fy, fz), (tx, ty, tz)

    def _pushed(self, torque_n_m: Vector) -> Vector:
        """With the pushes of this moment; a push lasts whole steps."""
        x, y, z = torque_n_m
        for begin_us, end_us, (px, py, pz) in self._pushes:
            if begin_us <= self._time_us < end_us:
                x, y, z = x + px, y + py, z + pz
        return (x, y, z)

    def _rotor_momentum(self, speeds: Sequence[float]) -> float:
        """Angular momentum of the spinning rotors about body z, N m s."""
        n1, n2, n3, n4 = speeds
        s1, s2, s3, s4 = self._spins
        return self._momentum_per_speed * (s1 * n1 + s2 * n2 + s3 * n3 + s4 * n4)

    def _power(self, speeds: Sequence[float]) -> float:
        """What rotors at these speeds and the electronics take from the battery, W.

        Without what it takes to speed a rotor up, which a slower one does not give back.
        """
        vehicle = self._vehicle
        shafts_w = (
            vehicle.torque_constant
            * vehicle.rad_s_per_unit
            * sum(rotor.strength * n**3 for rotor, n in zip(vehicle.rotors, speeds, strict=True))
        )
        return shafts_w / MOTOR_EFFICIENCY + ELECTRONICS_W

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
        body, (n1, n2, n3, n4), (t1, t2, t3, t4) = self._body, self._speeds, self._turns
        k1, k2, k3, k4 = self._thrust_constants
        thrust = k1 * n1 * n1 + k2 * n2 * n2 + k3 * n3 * n3 + k4 * n4 * n4
        battery = self._battery
        return Truth(
            time_us=self._time_us,
            position_ned_m=body.position_ned_m,
            velocity_ned_m_s=body.velocity_ned_m_s,
            q_body_to_ned=body.q_body_to_ned,
            rate_body_rad_s=body.rate_body_rad_s,
            specific_force_body_m_s2=specific_force,
            rotor_speed=(n1, n2, n3, n4),
            rotor_turns=(t1, t2, t3, t4),
            on_ground=body.on_ground,
            wind_ned_m_s=self._wind.velocity_ned_m_s,
            thrust_to_weight=thrust / self._vehicle.weight_n,
            battery_v=self._vehicle.curve_voltage_v if battery is None else battery.voltage_v,
            battery_a=0.0 if battery is None else battery.current_a,
        )
