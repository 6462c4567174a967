"""A vehicle that is not what its file says: what the controller was not designed for."""

from __future__ import annotations

from dataclasses import dataclass, replace

from strix.plant.frames import ZERO, Vector
from strix.plant.vehicle import VehicleNumbers


@dataclass(frozen=True)
class Variation:
    """True value over the vehicle file's, for all but centre_of_mass_m."""

    mass: float = 1.0
    inertia: Vector = (1.0, 1.0, 1.0)  # about body x, y, z
    thrust: float = 1.0  # of all rotors at a speed, and their torque: both go with air and blades
    motor_time_constant: float = 1.0
    rotor_strength: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)  # M1..M4, as thrust
    centre_of_mass_m: Vector = ZERO  # from the frame's centre, body FRD

    def applied_to(self, vehicle: VehicleNumbers) -> VehicleNumbers:
        jx, jy, jz = vehicle.inertia_kg_m2
        m1, m2, m3, m4 = (
            replace(rotor, strength=rotor.strength * factor)
            for rotor, factor in zip(vehicle.rotors, self.rotor_strength, strict=True)
        )
        return replace(
            vehicle,
            mass_kg=vehicle.mass_kg * self.mass,
            inertia_kg_m2=(jx * self.inertia[0], jy * self.inertia[1], jz * self.inertia[2]),
            rotors=(m1, m2, m3, m4),
            thrust_constant=vehicle.thrust_constant * self.thrust,
            torque_constant=vehicle.torque_constant * self.thrust,
            motor_time_constant_s=vehicle.motor_time_constant_s * self.motor_time_constant,
            centre_of_mass_m=self.centre_of_mass_m,
        )


AS_BUILT = Variation()
