"""The airframes of the flight code, as the plant wants their numbers."""

from __future__ import annotations

from typing import Any

from strix import _core
from strix.errors import BadInput
from strix.plant.vehicle import Rotor, VehicleNumbers


def vehicle_name(wanted: str) -> str:
    """The flight code's spelling of a vehicle's name; upper and lower case are alike."""
    names: list[str] = _core.vehicle_names()
    for name in names:
        if name.lower() == wanted.lower():
            return name
    raise BadInput(f"--vehicle: expected one of {', '.join(names)}, found '{wanted}'")


def plant_numbers(name: str) -> VehicleNumbers:
    """The header's numbers (include/vehicles/) for the simulated airframe."""
    v: dict[str, Any] = _core.vehicle(name)
    m1, m2, m3, m4 = (Rotor(x_m=r["x"], y_m=r["y"], spin=r["spin"]) for r in v["rotors"])
    return VehicleNumbers(
        name=v["name"],
        mass_kg=v["mass"],
        inertia_kg_m2=v["inertia"],
        rotors=(m1, m2, m3, m4),
        thrust_constant=v["thrust_constant"],
        torque_constant=v["torque_constant"],
        speed_unit=v["speed_unit"],
        motor_time_constant_s=v["motor_time_constant"],
        command_offset=v["command"]["offset"],
        command_linear=v["command"]["linear"],
        command_quadratic=v["command"]["quadratic"],
        command_min=v["command_off"],
        command_max=v["command_max"],
    )
