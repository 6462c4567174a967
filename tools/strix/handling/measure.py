"""Numbers of a step response."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from strix.flightlog import Array


@dataclass(frozen=True)
class Step:
    """Of a response that should go from 0 at time 0 to 1. NaN: it did not get there."""

    rise_s: float  # from 0.1 to 0.9, each when first passed
    overshoot: float  # largest value less 1; below 0 when it never got to 1
    settled_s: float  # from then on within the band


def step_numbers(time_s: Array, response: Array, band: float) -> Step:
    """Of a response from time 0 on; the band is the half width around 1."""
    outside = np.flatnonzero(np.abs(response - 1.0) > band)
    if not len(outside):
        settled_s = float(time_s[0])
    elif outside[-1] + 1 == len(response):
        settled_s = math.nan
    else:
        settled_s = float(time_s[outside[-1] + 1])
    return Step(
        rise_s=first_passed(time_s, response, 0.9) - first_passed(time_s, response, 0.1),
        overshoot=float(response.max()) - 1.0,
        settled_s=settled_s,
    )


def first_passed(time_s: Array, response: Array, level: float) -> float:
    """When the response first reaches the level, between samples by a straight line."""
    above = np.flatnonzero(response >= level)
    if not len(above):
        return math.nan
    after = int(above[0])
    if after == 0:
        return float(time_s[0])
    pair = slice(after - 1, after + 1)
    return float(np.interp(level, response[pair], time_s[pair]))


def spread(values: Array) -> float:
    """Largest distance from the mean, as a share of it."""
    mean = float(np.mean(values))
    return float(np.max(np.abs(values - mean))) / abs(mean)
