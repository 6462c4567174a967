"""Aircraft that are not what their file says: many draws, one flight each."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from strix.handling.flights import GRID_S, Job, Kind, Measured, grid
from strix.handling.measure import step_numbers
from strix.handling.targets import ATTITUDE_BAND
from strix.plant import Variation
from strix.scenarios import Outcome
from strix.vehicles import plant_numbers

VEHICLE = "Quad5in"
SHARE = 0.2  # mass, each moment of inertia and thrust are off by up to so much
MOTOR_LAG_S = (0.02, 0.08)

# Limits. `strix gains --corners` has 22 % in the worst corner; a little more for what a linear
# design does not know: limits, noise, moments of inertia that differ from each other.
MOST_OVERSHOOT = 0.25
# The flight has -30 deg after +30: so much of these 60 deg beyond 30.
MOST_TILT_DEG = 45.0
# Twice what a tilt error may ask for (ControlConfig::rollPitchRate): a motor lag of 0.08 s lets a
# rate grow beyond it.
MOST_RATE_RAD_S = 10.0
# From then on within 10 % of the step: the roll and pitch steps are over after 1 s, yaw's after 2.
MOST_TILT_SETTLED_S = 1.0
MOST_YAW_SETTLED_S = 2.0
# Mean of the last 2 s of the 6 s at the new place: within guidance's arrival radius.
MOST_OFFSET_M = 0.5
AT_PLACE_S = 2.0


@dataclass(frozen=True)
class Draw:
    """What a seed makes of the aircraft; uniformly drawn, moments of inertia again until a body has
    them.
    """

    seed: int
    variation: Variation
    motor_lag_s: float
    heading_deg: float

    def sentence(self) -> str:
        v = self.variation
        inertia = " ".join(f"{100.0 * (j - 1.0):+.0f}" for j in v.inertia)
        return (
            f"mass {100.0 * (v.mass - 1.0):+.0f} %, inertia {inertia} %, "
            f"thrust {100.0 * (v.thrust - 1.0):+.0f} %, lag {self.motor_lag_s:.3f} s, "
            f"heading {self.heading_deg:.0f} deg"
        )


@dataclass(frozen=True)
class Robust:
    """One flight, and how near it came to each limit: above 1 it is beyond."""

    draw: Draw
    ratios: dict[str, float]

    @property
    def worst(self) -> tuple[str, float]:
        name = max(self.ratios, key=lambda key: self.ratios[key])
        return name, self.ratios[name]

    @property
    def passes(self) -> bool:
        return self.worst[1] <= 1.0


def draw(seed: int) -> Draw:
    rng = np.random.default_rng(seed)
    mass, thrust = (float(x) for x in rng.uniform(1.0 - SHARE, 1.0 + SHARE, 2))
    lag_s = float(rng.uniform(*MOTOR_LAG_S))
    heading_deg = float(rng.uniform(0.0, 360.0))
    numbers = plant_numbers(VEHICLE)
    while True:
        shares = rng.uniform(1.0 - SHARE, 1.0 + SHARE, 3)
        moments = np.sort(shares * numbers.inertia_kg_m2)
        if moments[0] + moments[1] >= moments[2]:  # there is no body with others
            break
    jx, jy, jz = (float(x) for x in shares)
    variation = Variation(
        mass=mass,
        inertia=(jx, jy, jz),
        thrust=thrust,
        motor_time_constant=lag_s / numbers.motor_time_constant_s,
    )
    return Draw(seed, variation, lag_s, heading_deg)


def robust_job(seed: int) -> Job:
    """The flight of a seed: aircraft, heading and noise."""
    drawn = draw(seed)
    return Job(Kind.ROBUST, VEHICLE, drawn.heading_deg, seed, drawn.variation)


def robust(measured: Measured) -> Robust:
    """What the flight was worth."""
    ended = measured.outcome is Outcome.LANDS and not measured.cut
    ratios = {
        "landed": 0.0 if ended else math.inf,
        "tilt": measured.largest_tilt_deg / MOST_TILT_DEG,
        "rate": measured.largest_rate_rad_s / MOST_RATE_RAD_S,
    }
    limits = {
        "roll": MOST_TILT_SETTLED_S,
        "pitch": MOST_TILT_SETTLED_S,
        "yaw": MOST_YAW_SETTLED_S,
    }
    for name, most_s in limits.items():
        for response in measured.responses.get(name, []):
            step = step_numbers(grid(len(response) * GRID_S), response, ATTITUDE_BAND)
            ratios[f"{name} overshoot"] = step.overshoot / MOST_OVERSHOOT
            settled_s = math.inf if math.isnan(step.settled_s) else step.settled_s
            ratios[f"{name} settling"] = settled_s / most_s
    for response in measured.responses.get("forward", []):
        end = float(np.mean(response[-round(AT_PLACE_S / GRID_S) :]))
        ratios["place"] = abs(end - 1.0) / MOST_OFFSET_M
    return Robust(draw(measured.job.seed), ratios)


def by_badness(flown: Iterable[Measured]) -> list[Robust]:
    """Worst first."""
    found = [robust(m) for m in flown if m.job.kind is Kind.ROBUST]
    return sorted(found, key=lambda r: (-r.worst[1], r.draw.seed))
