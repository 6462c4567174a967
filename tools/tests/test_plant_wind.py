"""Scenarios and wind."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2
from test_plant_flight import ALOFT, commands_for, fly
from test_plant_vehicle import QUAD5IN

from strix.plant import SCENARIOS, Plant, Scenario, find_scenario
from strix.plant.noise import normal_stream
from strix.plant.wind import Wind

WIND = SCENARIOS["wind"]


def test_an_unknown_scenario_is_told_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match=r"'storm'; known scenarios: calm, .*wind"):
        find_scenario("storm")


def test_scenarios_are_found_by_their_own_name_and_calm_is_calm() -> None:
    for name, scenario in SCENARIOS.items():
        assert find_scenario(name) is scenario
        assert scenario.name == name
    calm = find_scenario("calm")
    assert calm == Scenario(name="calm", description=calm.description)
    assert not any(calm.wind_mean_ned_m_s + calm.gust_sigma_ned_m_s)


def hover_in(scenario: Scenario, seed: int) -> Plant:
    plant = Plant(QUAD5IN, scenario, 0.0, seed)
    plant.place(ALOFT, rotor_speed=QUAD5IN.hover_speed)
    return plant


def test_wind_pushes_downwind() -> None:
    steady = replace(WIND, gust_sigma_ned_m_s=(0.0, 0.0, 0.0), wind_mean_ned_m_s=(2.0, -1.0, 0.0))
    truth = fly(hover_in(steady, 0), commands_for(QUAD5IN, (1, 1, 1, 1)), 1000)
    north, east, _ = truth.position_ned_m
    # Drag 0.2 1/s of the air's speed for one second: half of 0.2 x 2 m, less 7 % as the vehicle
    # picks up speed, plus 5 % from the frame.
    assert north == pytest.approx(0.2, rel=0.1)
    assert east == pytest.approx(-0.1, rel=0.1)


def test_a_vehicle_that_drifts_with_the_wind_feels_none() -> None:
    steady = replace(WIND, gust_sigma_ned_m_s=(0.0, 0.0, 0.0))
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
        wind.advance(1e-3)


def gusts(step_s: float, count: int) -> np.ndarray:
    wind = Wind(WIND, normal_stream(1, 0))
    rows = []
    for _ in range(count):
        rows.append(wind.velocity_ned_m_s)
        wind.advance(step_s)
    return np.array(rows) - WIND.wind_mean_ned_m_s


def test_gusts_have_their_size_from_the_first_moment() -> None:
    first = [Wind(WIND, normal_stream(seed, 0)).velocity_ned_m_s for seed in range(500)]
    spread = (np.array(first) - WIND.wind_mean_ned_m_s) / WIND.gust_sigma_ned_m_s
    low, high = chi2.ppf([1e-6, 1 - 1e-6], 3 * 500)
    assert low < (spread**2).sum() < high


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_gusts_have_their_size_and_correlation_time(axis: int) -> None:
    time_s, sigma = WIND.gust_time_ned_s[axis], WIND.gust_sigma_ned_m_s[axis]
    # A tenth of the correlation time a step: the coefficient is exp(-0.1), and
    # the innovations over sigma sqrt(1 - a^2) are standard normal, by the definition alone.
    x = gusts(time_s / 10.0, 20_000)[:, axis]
    keep = float(x[1:] @ x[:-1] / (x[:-1] @ x[:-1]))
    # Standard error of the coefficient: sqrt((1 - a^2)/N) = 0.003.
    assert keep == pytest.approx(math.exp(-0.1), abs=5 * 0.003)
    innovations = (x[1:] - math.exp(-0.1) * x[:-1]) / (sigma * math.sqrt(1 - math.exp(-0.2)))
    low, high = chi2.ppf([1e-6, 1 - 1e-6], innovations.size)
    assert low < float(innovations @ innovations) < high
    # Mean: sigma sqrt(2 T / duration), duration 2000 T.
    assert abs(x.mean()) < 5 * sigma * math.sqrt(2.0 / 2000.0)


def test_streams_of_one_seed_are_independent_and_repeat() -> None:
    def values(seed: int, stream: int) -> np.ndarray:
        draw = normal_stream(seed, stream)
        return np.array([draw() for _ in range(10_000)])  # over two chunks

    a, b, c = values(1, 0), values(1, 1), values(2, 0)
    np.testing.assert_array_equal(a, values(1, 0))
    for other in (b, c, np.roll(a, 4096)):
        assert abs(np.corrcoef(a, other)[0, 1]) < 5 / math.sqrt(10_000)
