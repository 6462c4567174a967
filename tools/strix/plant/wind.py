"""Wind: a mean, and gusts with Dryden's spectra at low altitude (MIL-F-8785C, 3.7.3).

The gusts drift past with the mean wind V, so a length L becomes a time T = L / V. Along the wind
the filter behind white noise is of first order, 1 / (1 + T s); across and down it is of second,
(1 + sqrt(3) T s) / (1 + T s)^2. The mean wind is the same at every height: the specification's
logarithmic profile is left out, so that a scenario's wind is the wind the aircraft has.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from strix.plant.frames import Vector
from strix.plant.surroundings import Surroundings

_FT_M = 0.3048
_LOWEST_M = 10.0 * _FT_M  # the specification's model begins there; below, gusts are as there
_HIGHEST_M = 1000.0 * _FT_M
_NEW_COEFFICIENTS_AT = 0.02  # of the height: times follow it in steps, the gusts stay continuous
_ROOT_3 = math.sqrt(3.0)


def gust_sigmas_m_s(height_m: float, wind_m_s: float) -> Vector:
    """Along the mean wind, across it, down. The wind is the one at 20 ft."""
    height_ft = _within(height_m) / _FT_M
    down = 0.1 * wind_m_s
    level: float = down / (0.177 + 0.000823 * height_ft) ** 0.4
    return (level, level, down)


def gust_lengths_m(height_m: float) -> Vector:
    """Along the mean wind, across it, down."""
    height_ft = _within(height_m) / _FT_M
    level: float = height_ft / (0.177 + 0.000823 * height_ft) ** 1.2
    return (level * _FT_M, level * _FT_M, height_ft * _FT_M)


def _within(height_m: float) -> float:
    return min(max(height_m, _LOWEST_M), _HIGHEST_M)


class _FirstOrder:
    """x' = (noise - x) / T, variance 1: x becomes k x + sqrt(1 - k^2) N(0,1), k = exp(-dt/T)."""

    def __init__(self, draw: Callable[[], float]) -> None:
        self._draw = draw
        self._keep = self._new = 0.0
        self.output = draw()

    def set_times(self, time_s: float, step_s: float) -> None:
        self._keep = math.exp(-step_s / time_s)
        self._new = math.sqrt(1.0 - self._keep * self._keep)

    def advance(self) -> None:
        self.output = self._keep * self.output + self._new * self._draw()


class _SecondOrder:
    """(1 + sqrt(3) T s) / (1 + T s)^2 with variance 1, exact for any step.

    As sqrt(3) x + (1 - sqrt(3)) y over sqrt(2), with x' = (noise - x) / T and y' = (x - y) / T.
    With noise that gives x the variance 1, the covariance of (x, y) is P = [[1, 1/2], [1/2, 1/2]].
    Over a step the two become Phi (x, y) + w with a = dt / T, Phi = e^-a [[1, 0], [a, 1]], and w
    of covariance P - Phi P Phi^T.
    """

    def __init__(self, draw: Callable[[], float]) -> None:
        self._draw = draw
        self._keep = self._pass = self._new_x = self._new_yx = self._new_y = 0.0
        self._x = draw()
        self._y = 0.5 * self._x + 0.5 * draw()  # Cholesky factor of P

    def set_times(self, time_s: float, step_s: float) -> None:
        a = step_s / time_s
        k = math.exp(-a)
        square = k * k
        xx = 1.0 - square
        xy = 0.5 - square * (a + 0.5)
        yy = 0.5 - square * (a * a + a + 0.5)
        self._keep, self._pass = k, k * a
        self._new_x = math.sqrt(xx)
        self._new_yx = xy / self._new_x
        # Of the order a^3 in a difference of terms of the order 1: rounding may leave it below 0.
        self._new_y = math.sqrt(max(yy - self._new_yx * self._new_yx, 0.0))

    def advance(self) -> None:
        first, second = self._draw(), self._draw()
        x, y = self._x, self._y
        self._x = self._keep * x + self._new_x * first
        self._y = self._pass * x + self._keep * y + self._new_yx * first + self._new_y * second

    @property
    def output(self) -> float:
        return (_ROOT_3 * self._x + (1.0 - _ROOT_3) * self._y) / math.sqrt(2.0)


class Wind:
    """The air's velocity, the same all around the vehicle."""

    def __init__(self, surroundings: Surroundings, draw: Callable[[], float]) -> None:
        self._mean = north, east, down = surroundings.wind_mean_ned_m_s
        self._speed = speed = math.hypot(north, east)
        self.velocity_ned_m_s: Vector = (north, east, down)
        self._blows = surroundings.gusts and speed > 0.0
        if not self._blows:
            return
        self._direction = (north / speed, east / speed)
        # Drawn from their stationary distribution: the gusts blew before the flight began.
        self._along = _FirstOrder(draw)
        self._across, self._down = _SecondOrder(draw), _SecondOrder(draw)
        self._height_m = self._step_s = 0.0
        self._sigmas = gust_sigmas_m_s(0.0, speed)
        self._observe()

    def advance(self, duration_s: float, height_m: float) -> None:
        """The vehicle is that high above ground."""
        if not self._blows:
            return
        height_m = _within(height_m)
        changed = abs(height_m - self._height_m) > _NEW_COEFFICIENTS_AT * height_m
        if changed or duration_s != self._step_s:
            self._height_m, self._step_s = height_m, duration_s
            self._sigmas = gust_sigmas_m_s(height_m, self._speed)
            gusts: list[_FirstOrder | _SecondOrder] = [self._along, self._across, self._down]
            for gust, length_m in zip(gusts, gust_lengths_m(height_m), strict=True):
                gust.set_times(length_m / self._speed, duration_s)
        self._along.advance()
        self._across.advance()
        self._down.advance()
        self._observe()

    def _observe(self) -> None:
        n, e, d = self._mean
        cosine, sine = self._direction
        along_sigma, across_sigma, down_sigma = self._sigmas
        along, across = along_sigma * self._along.output, across_sigma * self._across.output
        self.velocity_ned_m_s = (
            n + cosine * along - sine * across,
            e + sine * along + cosine * across,
            d + down_sigma * self._down.output,
        )
