"""What surrounds a flight: wind, the stand, pushes, and what the motors do to the sensors."""

from __future__ import annotations

from dataclasses import dataclass

from strix.plant.battery import BatteryNumbers
from strix.plant.frames import ZERO, Vector
from strix.plant.stand import Stand


@dataclass(frozen=True)
class Push:
    """A torque on the body for a time."""

    at_s: float  # since power-up
    torque_n_m: Vector  # body FRD
    duration_s: float


@dataclass(frozen=True)
class Surroundings:
    """Still air, clean sensors, free flight and a battery that never sags, unless told."""

    wind_mean_ned_m_s: Vector = ZERO  # of the air over the ground: where it blows to, not from
    gusts: bool = False  # Dryden's, which grow with the mean wind
    pushes: tuple[Push, ...] = ()
    stand: Stand | None = None  # None: free
    roof: bool = False  # under it no satellite is heard
    battery: BatteryNumbers | None = None  # None: a supply at the command curve's voltage, unread

    # Field of the motor currents at the magnetometer, body FRD, when the rotors carry the
    # weight. The current follows the torque, and so n^2 and the thrust: it scales with them.
    motor_field_at_hover_ut: Vector = ZERO
    # Unbalanced rotors shake the accelerometer once a turn: amplitude along the body axes when
    # they carry the weight, each rotor a quarter of it. Centrifugal force goes with n^2, thrust.
    vibration_at_hover_m_s2: Vector = ZERO
    # An accelerometer that is shaken beyond what it follows reads a mean that is not there
    # (vibration rectification): body FRD, when the rotors carry the weight; grows with thrust.
    rectified_at_hover_m_s2: Vector = ZERO


UNDISTURBED = Surroundings()
