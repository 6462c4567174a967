"""Wind: a mean and gusts, a first-order Gauss-Markov process on each axis of NED."""

from __future__ import annotations

import math
from collections.abc import Callable

from strix.plant.frames import Vector
from strix.plant.scenario import Scenario


class Wind:
    """The air's velocity, the same everywhere at one time."""

    def __init__(self, scenario: Scenario, draw: Callable[[], float]) -> None:
        self._mean = scenario.wind_mean_ned_m_s
        self._sigma = scenario.gust_sigma_ned_m_s
        self._time_s = scenario.gust_time_ned_s
        self._draw = draw
        self._calm = not any(self._sigma)
        # Start from the stationary distribution: the gusts blew before the flight began.
        n, e, d = (sigma * draw() for sigma in self._sigma)
        self._gust: Vector = (n, e, d)
        self.velocity_ned_m_s: Vector = self._sum()

    def advance(self, duration_s: float) -> None:
        """Exact for any time step: x becomes a x + sigma sqrt(1 - a^2) N(0,1), a = exp(-dt/T)."""
        if self._calm:
            return
        draw = self._draw
        gust = []
        for value, sigma, time_s in zip(self._gust, self._sigma, self._time_s, strict=True):
            keep = math.exp(-duration_s / time_s)
            gust.append(keep * value + sigma * math.sqrt(1.0 - keep * keep) * draw())
        self._gust = (gust[0], gust[1], gust[2])
        self.velocity_ned_m_s = self._sum()

    def _sum(self) -> Vector:
        return (
            self._mean[0] + self._gust[0],
            self._mean[1] + self._gust[1],
            self._mean[2] + self._gust[2],
        )
