"""The flight filter against its own claim, in short; `make consistency` is the long version."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest

from strix import _core, consistency
from strix.consistency import CASES, Consistency, Judgement, Series, judge
from strix.ideal_flight import Flight, Kind, configuration, rotated
from strix.report.consistency_page import charts


@pytest.fixture(scope="module")
def found() -> Consistency:
    return consistency.check(flights=20, flight_s=30, endurance_s=120, seed=1)


def test_errors_and_innovations_are_as_large_as_the_filter_claims(found: Consistency) -> None:
    assert [row for row in found.judgements if not row.consistent] == []
    assert [(row.case, row.name) for row in found.judgements] == [
        (case.name, name)
        for case in CASES
        for name in (
            "NEES",
            *["NIS tilt"] * (case.kind is Kind.TURNING),
            "NIS mag",
            "NIS alt",
            "NIS gps",
        )
    ]


def test_the_covariance_stays_positive_definite(found: Consistency) -> None:
    assert found.not_positive_definite == 0
    for run in found.endurance:
        assert (run.looks, run.not_positive_definite) == (120, 0)
        # Of the correlation matrix, whose elements float32 rounds by 6e-8: far from the edge.
        assert run.smallest_eigenvalue > 1e-5
    assert found.consistent


@pytest.mark.parametrize(
    ("attribute", "factor", "series"),
    [
        ("gyroNoise", 0.5, "NEES"),
        ("accelNoise", 0.5, "NEES"),
        ("gyroNoise", 4.0, "NEES"),
        ("gyroBiasSigma0", 0.3, "NEES"),
        ("gpsPositionSigma", 0.9, "NIS gps"),
    ],
)
def test_a_filter_that_is_wrong_about_its_noise_is_found_out(
    attribute: str, factor: float, series: str
) -> None:
    """Ten flights are enough for errors of this size; a few per cent need the long version."""
    claimed = configuration(Kind.MANOEUVRING)
    setattr(claimed, attribute, factor * getattr(claimed, attribute))
    assert not _judgement(claimed, series).consistent


def _judgement(claimed: _core.NavigationConfig, name: str) -> Judgement:
    records: list[_core.ConsistencyRecord] = []
    for seed in range(10):
        flight = Flight(18, Kind.MANOEUVRING, np.random.default_rng(seed))
        records += consistency.fly(flight, claimed, seconds=20, piece_s=20)
    (series,) = (series for series in consistency.series_of(records) if series.name == name)
    return judge("", series)


def test_without_noise_the_filter_follows_the_truth_to_rounding() -> None:
    """So the simulated flights obey the filter's equations, and only noise makes errors."""
    config = configuration(Kind.QUIET)
    for name in dir(config):
        if name.endswith(("Noise", "Walk", "Sigma", "Sigma0")):
            setattr(config, name, 0.0)
    for sensor in ("tilt", "mag", "alt"):
        setattr(config, sensor, _core.MeasurementNoise(0.0, 0.0))
    flight = Flight(18, Kind.QUIET, np.random.default_rng(5), config)
    (record,) = consistency.fly(flight, configuration(Kind.QUIET), seconds=20, piece_s=20)
    # 20000 steps, each rounding p (tens of m), v (m/s) and q by up to 4e-6 m, 5e-7 m/s and 6e-8,
    # at random; and the measurements correct what adds up.
    position, velocity, alpha = (np.abs(record.error[:, i : i + 3]).max() for i in (0, 3, 6))
    assert position < 5e-3
    assert velocity < 5e-4
    assert alpha < 5e-5


def test_the_flights_go_through_all_attitudes_and_keep_their_place() -> None:
    flight = Flight(18, Kind.MANOEUVRING, np.random.default_rng(3))
    said = flight.fly(60_000)
    down = rotated(said.truth[:, 6:10], np.array([[0.0, 0.0, 1.0]]))[:, 2]
    assert down.min() < -0.8  # inverted, within 37 deg
    assert down.max() > 0.8
    assert np.linalg.norm(said.gyro, axis=1).max() > 4.0  # rad/s
    assert np.abs(said.truth[:, 0:3]).max() < 100.0  # m
    assert np.allclose(np.linalg.norm(said.truth[:, 6:10], axis=1), 1.0, atol=1e-9)


def test_correlated_seconds_count_for_less() -> None:
    rng = np.random.default_rng(1)
    # The variance of 500 means is known to 6 %, one sigma.
    white = rng.chisquare(9, (500, 60))
    slow = np.repeat(white[:, ::5], 5, axis=1)  # five seconds alike: 12 independent ones
    assert judge("", Series("white", 9, white)).independent_s == pytest.approx(60.0, rel=0.2)
    assert judge("", Series("slow", 9, slow)).independent_s == pytest.approx(12.0, rel=0.2)


def test_a_covariance_that_is_not_positive_definite_is_never_consistent() -> None:
    values = np.full((20, 60), 9.0) + np.random.default_rng(1).normal(0.0, 1.0, (20, 60))
    values[3, 7] = np.nan
    assert not judge("", Series("NEES", 9, values)).consistent


def test_the_command_leaves_numbers_and_a_page(tmp_path: Path, found: Consistency) -> None:
    consistency.write(tmp_path / "out", found)
    numbers = json.loads((tmp_path / "out" / "consistency.json").read_text())
    assert numbers["consistent"] is True
    assert len(numbers["judgements"]) == 26
    page = (tmp_path / "out" / "consistency.html").read_text()
    for row in found.judgements:
        assert f"<td>{row.case}</td><td>{row.name}</td>" in page
    for chart in charts(found):
        go.Figure(data=chart.traces, layout=chart.layout)  # refuses what Plotly does not know
