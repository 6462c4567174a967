"""The simulated world: vehicle, air, ground, stand, battery and sensors.

It stands in for nature, so it shares no code and no model function with the flight code: what
the two agree on is DESIGN.md and the vehicle's measured numbers, nothing else.
"""

from strix.plant.battery import BatteryNumbers
from strix.plant.plant import Plant, Truth
from strix.plant.sensors import SensorConstants, SensorSuite
from strix.plant.stand import Stand
from strix.plant.surroundings import UNDISTURBED, Push, Surroundings
from strix.plant.variation import AS_BUILT, Variation
from strix.plant.vehicle import Rotor, VehicleNumbers

__all__ = [
    "AS_BUILT",
    "UNDISTURBED",
    "BatteryNumbers",
    "Plant",
    "Push",
    "Rotor",
    "SensorConstants",
    "SensorSuite",
    "Stand",
    "Surroundings",
    "Truth",
    "Variation",
    "VehicleNumbers",
]
