"""What each option of the navigation buys: the flight code in simulated flights with the option off
and on. One function a scenario, for the test, the figure and the table alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from strix.options import aiding_options, attitude_options, health_options
from strix.options.comparison import Comparison
from strix.options.figures import draw

SCENARIOS: dict[str, Callable[[], Comparison]] = {
    "vibration": attitude_options.vibration,
    "motor_iron": attitude_options.motor_iron,
    "bent_field": attitude_options.bent_field,
    "yaw_turns": attitude_options.yaw_turns,
    "bounded_motion": attitude_options.bounded_motion,
    "gps_jump": aiding_options.gps_jump,
    "delays": aiding_options.delays,
    "standstill_9": lambda: aiding_options.standstill(9),
    "standstill_18": lambda: aiding_options.standstill(18),
    "outage": lambda: aiding_options.outage().comparison,
    "silent_sensors": health_options.silent_sensors,
    "lost_filter": health_options.lost_filter,
    "disagreement": health_options.disagreement,
}


def write_figures(folder: Path) -> Iterator[str]:
    """Fly every scenario, draw it in `folder` as option_NAME.png and tell its numbers: of each
    variant and quantity the mean and the largest over the seeds.
    """
    for name, scenario in SCENARIOS.items():
        comparison = scenario()
        draw(comparison, folder / f"option_{name}.png")
        yield comparison.table()
