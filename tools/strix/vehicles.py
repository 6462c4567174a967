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


# What the flight code does not need. Rotor inertia is ours: no figure is published. A propeller as
# a rod, m D^2 / 12, and the motor's bell as a ring, m r^2.
_ROTOR_INERTIA_KG_M2 = {
    "Quad5in": 8e-6,  # 4.5 g, 0.127 m; 12 g at 12.5 mm
    "UgglanQ450": 6e-5,  # 11 g, 0.254 m; 20 g at 13 mm
}
_SLOWEST = {"UgglanQ450": 200.0}  # rad/s, DESIGN.md section 5: told less, the ESC stops its motor


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
        speed_min=_SLOWEST.get(name, 0.0),
        rotor_inertia_kg_m2=_ROTOR_INERTIA_KG_M2.get(name, 0.0),
        battery_cells=v["battery_cells"],
        curve_voltage_v=v["curve_voltage"],
        escs_answer=v["command_unit"] == "int16",  # over I2C, which has a way back
    )
