"""What each flight of a campaign is: all of it drawn from the campaign's seed and its number."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from strix.campaign.kinds import KINDS
from strix.errors import BadInput
from strix.missions import Mission, find_mission, parse_mission
from strix.plant import BatteryNumbers, Surroundings, Variation
from strix.plant.faults import Fault

VEHICLE = "Quad5in"
ARM_AT_S = 12.5  # as soon as the origin is averaged
# Missions, and the time from arming to landing in still air, s: test_campaign.py measures it.
# "sticks" is the pilot's own flight, in position hold.
MISSIONS = {"first-flight": 34.0, "hover": 29.0, "square": 51.0, "sticks": 34.0}
_HOVER = "takeoff 3 12\nland\n"

# ours: an aircraft that was weighed and whose battery differs, not the 20 % of `strix handling`.
MASS_SHARE, THRUST_SHARE, INERTIA_SHARE, LAG_SHARE, ROTOR_SHARE = 0.05, 0.05, 0.1, 0.2, 0.03
MOST_WIND_M_S = 4.0  # the safety manual flies below 5 m/s
MOST_MOTOR_FIELD_UT = 3.0  # at hover, each axis: what a calibration leaves of 30 uT
VIBRATION_M_S2 = (1.0, 1.0, 1.5)  # at hover
ENDURANCE_S = (300.0, 420.0)


@dataclass(frozen=True)
class Draw:
    """One flight before it is flown. The fault is made by fault(), as it has a memory."""

    seed: int
    index: int
    kind: str
    at_s: float
    mission: str
    heading_deg: float
    surroundings: Surroundings
    variation: Variation
    noise_seed: int

    def fault(self) -> tuple[Fault, str]:
        """The fault, and what it is in words."""
        return KINDS[self.kind].draw(_stream(self.seed, self.index, 1), self.at_s)

    @property
    def by_sticks(self) -> bool:
        return self.mission == "sticks"

    @property
    def by_radio(self) -> bool:
        return self.by_sticks or KINDS[self.kind].by_radio

    def read_mission(self) -> Mission:
        if self.mission in ("hover", "sticks"):  # by sticks no mission is flown
            return parse_mission("hover", _HOVER, "hover")
        return find_mission(self.mission)


def _stream(seed: int, index: int, part: int) -> Generator:
    return np.random.default_rng([seed, index, part])


def kinds_of(wanted: str) -> list[str]:
    """--faults: all, or names."""
    if wanted == "all":
        return list(KINDS)
    names = [name.strip() for name in wanted.split(",")]
    for name in names:
        if name not in KINDS:
            known = ", ".join(KINDS)
            raise BadInput(f"--faults: expected all or names of {known}; found '{name}'")
    return list(dict.fromkeys(names))


def draw(seed: int, index: int, kinds: Sequence[str]) -> Draw:
    """Every kind once in a row of flights, in an order of their own."""
    turn, place = divmod(index, len(kinds))
    order = np.random.default_rng([seed, turn]).permutation(len(kinds))
    rng = _stream(seed, index, 0)
    mission = list(MISSIONS)[int(rng.integers(len(MISSIONS)))]
    wind_m_s = float(rng.uniform(0.0, MOST_WIND_M_S))
    towards = float(rng.uniform(0.0, 2.0 * math.pi))
    field = (float(f) for f in rng.uniform(-MOST_MOTOR_FIELD_UT, MOST_MOTOR_FIELD_UT, 3))
    surroundings = Surroundings(
        wind_mean_ned_m_s=(wind_m_s * math.cos(towards), wind_m_s * math.sin(towards), 0.0),
        gusts=True,
        battery=BatteryNumbers(endurance_s=float(rng.uniform(*ENDURANCE_S))),
        motor_field_at_hover_ut=(next(field), next(field), next(field)),
        vibration_at_hover_m_s2=VIBRATION_M_S2,
    )

    def near_one(share: float) -> float:
        return float(rng.uniform(1.0 - share, 1.0 + share))

    return Draw(
        seed=seed,
        index=index,
        kind=kinds[int(order[place])],
        at_s=round(ARM_AT_S + float(rng.uniform(0.0, MISSIONS[mission])), 3),
        mission=mission,
        heading_deg=round(float(rng.uniform(0.0, 360.0)), 1),
        surroundings=surroundings,
        variation=Variation(
            mass=near_one(MASS_SHARE),
            inertia=tuple(near_one(INERTIA_SHARE) for _ in range(3)),  # type: ignore[arg-type]
            thrust=near_one(THRUST_SHARE),
            motor_time_constant=near_one(LAG_SHARE),
            rotor_strength=tuple(near_one(ROTOR_SHARE) for _ in range(4)),  # type: ignore[arg-type]
        ),
        noise_seed=int(rng.integers(2**32)),
    )
