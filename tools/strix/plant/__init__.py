"""The simulated world: vehicle, air, ground and sensors.

It stands in for nature, so it shares no code and no model function with the flight code: what
the two agree on is DESIGN.md and the vehicle's measured numbers, nothing else.
"""

from strix.plant.plant import Plant, Truth
from strix.plant.scenario import SCENARIOS, Scenario, find_scenario
from strix.plant.sensors import SensorConstants, SensorSuite
from strix.plant.vehicle import Rotor, VehicleNumbers

__all__ = [
    "SCENARIOS",
    "Plant",
    "Rotor",
    "Scenario",
    "SensorConstants",
    "SensorSuite",
    "Truth",
    "VehicleNumbers",
    "find_scenario",
]
