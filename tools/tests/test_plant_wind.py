"""Wind: its push, and gusts against Dryden's formulas."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import welch
from scipy.stats import chi2
from test_plant_flight import ALOFT, commands_for, fly
from test_plant_vehicle import QUAD5IN

from strix.plant import Plant, Surroundings
from strix.plant.noise import normal_stream
from strix.plant.wind import Wind, gust_lengths_m, gust_sigmas_m_s

# 5 m/s towards 3 parts north and 4 parts east.
WIND = Surroundings(wind_mean_ned_m_s=(3.0, 4.0, 0.0), gusts=True)
SPEED = 5.0
HEIGHT_M = 30.0


def hover_in(surroundings: Surroundings, seed: int) -> Plant:
    plant = Plant(QUAD5IN, surroundings, 0.0, seed)
    plant.place(ALOFT, rotor_speed=QUAD5IN.hover_speed)
    return plant


def test_wind_pushes_downwind() -> None:
    steady = Surroundings(wind_mean_ned_m_s=(2.0, -1.0, 0.0))
    truth = fly(hover_in(steady, 0), commands_for(QUAD5IN, (1, 1, 1, 1)), 1000)
    north, east, _ = truth.position_ned_m
    # Drag 0.2 1/s of the air's speed for one second: half of 0.2 x 2 m, less 7 % as the vehicle
    # picks up speed, plus 5 % from the frame.
    assert north == pytest.approx(0.2, rel=0.1)
    assert east == pytest.approx(-0.1, rel=0.1)


def test_a_vehicle_that_drifts_with_the_wind_feels_none() -> None:
    steady = replace(WIND, gusts=False)
    plant = hover_in(steady, 0)
    plant.place(ALOFT, steady.wind_mean_ned_m_s, rotor_speed=QUAD5IN.hover_speed)
    force = fly(plant, commands_for(QUAD5IN, (1, 1, 1, 1)), 1).specific_force_body_m_s2
    assert force[:2] == pytest.approx((0, 0), abs=1e-12)


def test_gusts_repeat_with_the_seed_and_differ_without() -> None:
    def end(seed: int) -> tuple[float, float, float]:
        return fly(hover_in(WIND, seed), commands_for(QUAD5IN, (1, 1, 1, 1)), 500).position_ned_m

    assert end(7) == end(7)
    assert end(7) != end(8)
    assert math.dist(end(7), end(8)) > 1e-3


def test_the_gusts_go_on_during_the_flight() -> None:
    plant, wind = Plant(QUAD5IN, WIND, 0.0, seed=7), Wind(WIND, normal_stream(7, 0))
    for _ in range(3):
        assert plant.truth.wind_ned_m_s == wind.velocity_ned_m_s
        plant.step((0.0,) * 4, 1000)
        wind.advance(1e-3, 0.0)


def gusts(step_s: float, count: int, seed: int = 1, height_m: float = HEIGHT_M) -> np.ndarray:
    """Along the wind, across it to the right, down; in units of their own sigma."""
    wind = Wind(WIND, normal_stream(seed, 0))
    rows = []
    for _ in range(count):
        wind.advance(step_s, height_m)
        rows.append(wind.velocity_ned_m_s)
    n, e, d = (np.array(rows) - WIND.wind_mean_ned_m_s).T
    turned = np.stack([0.6 * n + 0.8 * e, -0.8 * n + 0.6 * e, d], axis=1)
    return np.asarray(turned / gust_sigmas_m_s(height_m, SPEED))


def times_s(axis: int) -> float:
    return gust_lengths_m(HEIGHT_M)[axis] / SPEED


def test_lengths_and_sizes_are_those_of_the_specification() -> None:
    # MIL-F-8785C at 100 ft and a wind of 10 m/s at 20 ft: 0.177 + 0.0823 = 0.2593.
    height_m = 100 * 0.3048
    level = 10.0 * 0.1 / 0.2593**0.4  # 1.716 m/s
    assert gust_sigmas_m_s(height_m, 10.0) == pytest.approx((level, level, 1.0), rel=1e-12)
    length_m = 100 / 0.2593**1.2 * 0.3048  # 154 m
    assert gust_lengths_m(height_m) == pytest.approx((length_m, length_m, height_m), rel=1e-12)
    # At its upper end, 1000 ft, it is the same in all directions.
    assert gust_lengths_m(304.8) == pytest.approx((304.8,) * 3, rel=1e-3)
    assert gust_sigmas_m_s(304.8, 10.0) == pytest.approx((1.0,) * 3, rel=1e-3)
    # Below its lower end gusts do not shrink to nothing.
    assert gust_lengths_m(0.0) == gust_lengths_m(3.048)


def test_gusts_have_their_size_from_the_first_moment() -> None:
    first = np.array([gusts(1e-3, 1, seed, 0.0)[0] for seed in range(500)])
    low, high = chi2.ppf([1e-6, 1 - 1e-6], 3 * 500)
    assert low < (first**2).sum() < high


# Correlation of what the filters give, of lag s in units of T: exp(-s) behind the first-order one,
# exp(-s) (1 - s / 2) behind the second-order one (the transforms of Dryden's spectra).
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("steps_per_time", [2, 20])
def test_gusts_are_correlated_as_drydens_at_any_step(axis: int, steps_per_time: int) -> None:
    count = 30_000
    x = gusts(times_s(axis) / steps_per_time, count)[:, axis]
    # Of a correlation estimated over N times T the standard error is below sqrt(2 / N).
    tolerance = 4.0 * math.sqrt(2.0 * steps_per_time / count)
    for lag in (0, 1, steps_per_time, 3 * steps_per_time):
        s = lag / steps_per_time
        expected = math.exp(-s) * (1.0 if axis == 0 else 1.0 - 0.5 * s)
        found = float(x[lag:] @ x[: count - lag]) / (count - lag)
        assert found == pytest.approx(expected, abs=tolerance)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_gusts_have_drydens_spectrum(axis: int) -> None:
    time_s = times_s(axis)
    rate_hz = 25.0 / time_s
    x = gusts(1.0 / rate_hz, 120_000)[:, axis]
    frequency_hz, found = welch(x, rate_hz, nperseg=2048)
    w = 2.0 * math.pi * frequency_hz * time_s
    # One-sided, in Hz, variance 1: 4 T / (1 + w^2), and 2 T (1 + 3 w^2) / (1 + w^2)^2.
    first, second = 4.0 / (1.0 + w**2), 2.0 * (1.0 + 3.0 * w**2) / (1.0 + w**2) ** 2
    expected = time_s * (first if axis == 0 else second)
    # A factor of two about w = 1, and two decades of power down: 0.1 < w < 10.
    for low, high in ((0.1, 0.5), (0.5, 2.0), (2.0, 5.0), (5.0, 10.0)):
        band = (w >= low) & (w < high)
        # About 115 overlapping segments: each bin to 11 %, a band of ten bins or more to 4 %; at
        # w = 10 the sampled spectrum is 4 % above the formula, by aliasing.
        assert found[band].mean() == pytest.approx(expected[band].mean(), rel=0.15)


def test_gusts_along_across_and_down_have_nothing_to_do_with_each_other() -> None:
    correlation = np.corrcoef(gusts(times_s(0), 20_000).T)
    np.testing.assert_allclose(correlation, np.eye(3), atol=5 / math.sqrt(20_000))


def test_gusts_grow_steadily_as_the_aircraft_climbs() -> None:
    wind = Wind(WIND, normal_stream(3, 0))
    before = wind.velocity_ned_m_s
    for step in range(20_000):  # 100 m in 20 s
        wind.advance(1e-3, step * 5e-3)
        jump = math.dist(wind.velocity_ned_m_s, before)
        before = wind.velocity_ned_m_s
        # In 1 ms: 5 sigma of sqrt(2 dt / T) of 1 m/s at the shortest T, 0.6 s, is 0.3 m/s.
        assert jump < 0.3


def test_no_wind_no_gusts() -> None:
    wind = Wind(Surroundings(gusts=True), normal_stream(1, 0))
    wind.advance(1.0, 10.0)
    assert wind.velocity_ned_m_s == (0.0, 0.0, 0.0)


def test_streams_of_one_seed_are_independent_and_repeat() -> None:
    def values(seed: int, stream: int) -> np.ndarray:
        draw = normal_stream(seed, stream)
        return np.array([draw() for _ in range(10_000)])  # over two chunks

    a, b, c = values(1, 0), values(1, 1), values(2, 0)
    np.testing.assert_array_equal(a, values(1, 0))
    for other in (b, c, np.roll(a, 4096)):
        assert abs(np.corrcoef(a, other)[0, 1]) < 5 / math.sqrt(10_000)
