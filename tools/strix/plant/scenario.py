"""What surrounds a flight: wind, and disturbances that are off unless a scenario names them."""

from __future__ import annotations

from dataclasses import dataclass

from strix.plant.frames import ZERO, Vector


@dataclass(frozen=True)
class Scenario:
    """Wind is the velocity of the air over the ground, NED: where it blows to, not from."""

    name: str
    description: str
    wind_mean_ned_m_s: Vector = ZERO
    gust_sigma_ned_m_s: Vector = ZERO  # one sigma about the mean
    gust_time_ned_s: Vector = (1.0, 1.0, 1.0)  # correlation time of each axis
    # Field of the motor currents at the magnetometer, body frame, when the rotors carry the
    # weight. The current follows the torque, and so n^2 and the thrust: it scales with them.
    motor_field_at_hover_ut: Vector = ZERO


# Gusts after MIL-F-8785C (Dryden, low altitude) at its lower limit h = 10 ft, with the mean wind
# V = 3 m/s taken for the wind at 20 ft: sigma_w = 0.1 V = 0.3 m/s,
# sigma_u = sigma_w / (0.177 + 0.000823 h)^0.4 = 0.59 m/s, L_w = h = 3.0 m,
# L_u = h / (0.177 + 0.000823 h)^1.2 = 23 m. Past a hovering vehicle they drift at V: time = L / V.
_WIND = Scenario(
    name="wind",
    description="3 m/s towards north-east with gusts of 0.6 m/s",
    wind_mean_ned_m_s=(2.12, 2.12, 0.0),
    gust_sigma_ned_m_s=(0.59, 0.59, 0.3),
    gust_time_ned_s=(7.7, 7.7, 1.0),
)

SCENARIOS: dict[str, Scenario] = {
    scenario.name: scenario
    for scenario in (
        Scenario(name="calm", description="still air, clean magnetic field"),
        _WIND,
        Scenario(
            name="magnetic",
            description="still air, motor currents add 5 uT to the magnetometer at hover",
            motor_field_at_hover_ut=(3.0, -2.0, 3.5),
        ),
    )
}

DEFAULT_SCENARIO = "calm"


def find_scenario(name: str) -> Scenario:
    try:
        return SCENARIOS[name]
    except KeyError:
        known = ", ".join(sorted(SCENARIOS))
        raise ValueError(f"unknown scenario '{name}'; known scenarios: {known}") from None
