"""The numbers of a vehicle as the plant uses them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from strix.plant.frames import ZERO, Vector

STANDARD_GRAVITY_M_S2 = 9.80665

SpeedUnit = Literal["rev/s", "rad/s"]


@dataclass(frozen=True)
class Rotor:
    """One rotor: position of its hub in the body frame (FRD), and the way it turns."""

    x_m: float  # forward of the frame's centre
    y_m: float  # right of the frame's centre
    spin: int  # +1 clockwise seen from above (positive about body z, down), -1 the other way
    strength: float = 1.0  # thrust and torque at a speed, over what the vehicle's constants say


@dataclass(frozen=True)
class VehicleNumbers:
    """A quadcopter. Rotor speed n is in speed_unit everywhere, and so are the constants."""

    name: str
    mass_kg: float
    inertia_kg_m2: tuple[float, float, float]  # principal moments about body x, y, z
    rotors: tuple[Rotor, Rotor, Rotor, Rotor]  # M1..M4
    thrust_constant: float  # N per speed_unit^2
    torque_constant: float  # N m per speed_unit^2
    speed_unit: SpeedUnit
    motor_time_constant_s: float
    command_offset: float  # ESC command = offset + linear n + quadratic n^2
    command_linear: float
    command_quadratic: float
    command_min: float  # at or below it the ESC stops the motor
    command_max: float
    speed_min: float = 0.0  # an ESC that is told to turn slower stops the motor
    # One rotor and its motor's bell. 0 leaves out the torque of speeding a rotor up and the
    # gyroscopic torque.
    rotor_inertia_kg_m2: float = 0.0
    # From the frame's centre, where the IMU is and from where rotors are measured, body FRD.
    centre_of_mass_m: Vector = ZERO
    battery_cells: int = 0  # in series
    curve_voltage_v: float = 0.0  # battery voltage at which the command curve holds
    escs_answer: bool = False  # they tell rotor speed and voltage when they are asked

    def __post_init__(self) -> None:
        if len(self.rotors) != 4:
            raise ValueError(f"vehicle {self.name}: 4 rotors expected, found {len(self.rotors)}")
        if any(rotor.spin not in (-1, 1) for rotor in self.rotors):
            raise ValueError(f"vehicle {self.name}: a rotor's spin is +1 or -1")
        if self.speed_unit not in ("rev/s", "rad/s"):
            raise ValueError(
                f"vehicle {self.name}: speed_unit is 'rev/s' or 'rad/s', found {self.speed_unit!r}"
            )
        positive = {
            "mass_kg": self.mass_kg,
            "inertia_kg_m2": min(self.inertia_kg_m2),
            "thrust_constant": self.thrust_constant,
            "motor_time_constant_s": self.motor_time_constant_s,
            "command_linear + command_quadratic": self.command_linear + self.command_quadratic,
            "command_max - command_min": self.command_max - self.command_min,
            "strength of a rotor": min(rotor.strength for rotor in self.rotors),
        }
        for key, value in positive.items():
            if not value > 0.0:
                raise ValueError(f"vehicle {self.name}: {key} must be positive, found {value}")

    @property
    def weight_n(self) -> float:
        return self.mass_kg * STANDARD_GRAVITY_M_S2

    @property
    def hover_speed(self) -> float:
        """Rotor speed at which four equal rotors carry the weight."""
        return math.sqrt(self.weight_n / (4.0 * self.thrust_constant))

    @property
    def rad_s_per_unit(self) -> float:
        return 2.0 * math.pi if self.speed_unit == "rev/s" else 1.0

    def speed_for_command(self, command: float) -> float:
        """Rotor speed an ESC settles at, at curve_voltage_v: the root of the command curve.

        Written as 2 c / (b + sqrt(b^2 + 4 a c)), which also holds for a = 0. A command that is
        not a number is no pulse at all, and stops the motor.
        """
        rise = min(command, self.command_max) - self.command_offset
        if not (command > self.command_min and rise > 0.0):
            return 0.0
        linear = self.command_linear
        speed = (
            2.0 * rise / (linear + math.sqrt(linear * linear + 4.0 * self.command_quadratic * rise))
        )
        return speed if speed >= self.speed_min else 0.0

    def command_for_speed(self, speed: float) -> float:
        """The command curve itself."""
        return self.command_offset + (self.command_linear + self.command_quadratic * speed) * speed
