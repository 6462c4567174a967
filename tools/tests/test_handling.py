"""`strix handling`: its measures on responses that are known, and a small part of what it flies."""

import json
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from strix.handling.figures import write_figures
from strix.handling.flights import (
    Job,
    Kind,
    Measured,
    fly_into,
    grid,
    mission_of,
    moves_of,
)
from strix.handling.measure import first_passed, spread, step_numbers
from strix.handling.montecarlo import (
    MOTOR_LAG_S,
    SHARE,
    by_badness,
    draw,
    robust,
    robust_job,
)
from strix.handling.run import Handling, fly_all, print_handling
from strix.handling.targets import HEADINGS_DEG, Line, handling_jobs, table
from strix.scenarios import Outcome
from strix.vehicles import plant_numbers

TIME_S = grid(2.0)


def second_order(damping: float, frequency: float) -> np.ndarray:
    """Step response, rad/s, underdamped."""
    damped = frequency * math.sqrt(1.0 - damping**2)
    decay = np.exp(-damping * frequency * TIME_S)
    turn = damped * TIME_S
    return 1.0 - decay * (np.cos(turn) + damping * frequency / damped * np.sin(turn))


def test_a_first_order_lag_rises_in_ln_9_of_its_time_constants() -> None:
    step = step_numbers(TIME_S, 1.0 - np.exp(-TIME_S / 0.1), 0.1)
    # Straight lines between samples 0.1 time constants apart: a thousandth of one.
    assert step.rise_s == pytest.approx(0.1 * math.log(9.0), abs=3e-4)
    assert step.settled_s == pytest.approx(0.1 * math.log(10.0), abs=0.01)  # a sample
    assert step.overshoot < 0.0


@pytest.mark.parametrize("damping", [0.3, 0.5, 0.7])
def test_overshoot_is_that_of_the_formula(damping: float) -> None:
    expected = math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
    found = step_numbers(TIME_S, second_order(damping, 10.0), 0.05).overshoot
    # The peak lies at most half a sample from one: (w dt / 2)^2 / 2 of it.
    assert found == pytest.approx(expected, abs=2e-3)


def test_what_never_arrives_has_no_rise_and_meets_no_target() -> None:
    step = step_numbers(TIME_S, 0.5 * TIME_S / TIME_S[-1], 0.1)
    assert math.isnan(step.rise_s)
    assert math.isnan(step.settled_s)
    assert not Line("v", "rise", step.rise_s, "s", 0.2, "").met


def test_what_leaves_the_band_at_the_end_has_not_settled() -> None:
    response = np.ones_like(TIME_S)
    response[-1] = 1.2
    assert math.isnan(step_numbers(TIME_S, response, 0.1).settled_s)


def test_the_first_passing_counts() -> None:
    time_s = np.arange(4.0)
    assert first_passed(time_s, np.array([0.0, 1.0, 0.0, 1.0]), 0.5) == 0.5
    assert spread(np.array([0.9, 1.0, 1.1])) == pytest.approx(0.1)


def test_every_mission_can_be_flown_at_every_heading() -> None:
    for kind in Kind:
        for heading_deg in (*HEADINGS_DEG, 33.3):
            takeoff, moves = moves_of(Job(kind, "Quad5in", heading_deg, 1))
            assert len(mission_of(takeoff, moves).items) == len(moves)


def test_the_step_forward_is_forward_at_every_heading() -> None:
    for heading_deg in (0.0, 90.0, 213.0):
        takeoff, moves = moves_of(Job(Kind.PLACE, "Quad5in", heading_deg, 1))
        step = mission_of(takeoff, moves).items[0]
        assert math.hypot(step.north_m, step.east_m) == pytest.approx(1.0, abs=1e-5)
        heading = math.degrees(math.atan2(step.east_m, step.north_m)) % 360.0
        assert heading == pytest.approx(heading_deg, abs=1e-3)


def test_draws_fill_what_they_are_said_to_fill_and_a_seed_is_one_aircraft() -> None:
    draws = [draw(seed) for seed in range(1000)]
    assert draws[7] == draw(7)
    for values, low, high in (
        ([d.variation.mass for d in draws], 1.0 - SHARE, 1.0 + SHARE),
        ([d.variation.thrust for d in draws], 1.0 - SHARE, 1.0 + SHARE),
        ([d.motor_lag_s for d in draws], *MOTOR_LAG_S),
        ([d.heading_deg for d in draws], 0.0, 360.0),
    ):
        width = high - low
        assert low <= min(values) < low + 0.01 * width  # missed by 1000 in 1 of 20000 runs,
        assert high - 0.01 * width < max(values) <= high
        # of a uniform mean 4 standard errors: 4 / sqrt(12 x 1000) of the width
        assert abs(np.mean(values) - 0.5 * (low + high)) < 0.037 * width


def test_every_drawn_body_can_exist() -> None:
    """No moment of inertia is larger than the two others together."""
    inertia = np.array(plant_numbers("Quad5in").inertia_kg_m2)
    for seed in range(1000):
        shares = np.array(draw(seed).variation.inertia)
        assert np.all(np.abs(shares - 1.0) <= SHARE)
        moments = shares * inertia
        assert 2.0 * moments.max() <= moments.sum()


@pytest.fixture(scope="module")
def flown() -> list[Measured]:
    """Eight draws of the Monte Carlo; attitude steps at two headings, the noise the same."""
    robust_jobs = [robust_job(seed) for seed in range(1, 9)]
    steps = [
        job for job in handling_jobs("Quad5in", 1) if job.quiet_gps and job.kind is Kind.ATTITUDE
    ][:2]
    return fly_all(robust_jobs + steps, os.cpu_count() or 1)


def test_eight_aircraft_off_by_a_fifth_fly_their_steps_and_land(flown: list[Measured]) -> None:
    found = by_badness(flown)
    assert len(found) == 8
    assert [r.draw.seed for r in found if not r.passes] == []
    assert all(len(r.ratios) == 10 for r in found)  # every step of every flight was measured


def test_the_attitude_targets_are_met(flown: list[Measured]) -> None:
    # The lines of the attitude take flights with GPS noise; these are without.
    noisy = [replace(m, job=replace(m.job, quiet_gps=False)) for m in flown]
    lines = {line.name: line for line in table("Quad5in", noisy, targets=True)}
    names = [
        f"{axis} 30 deg, {what}" for axis in ("roll", "pitch") for what in ("rise", "overshoot")
    ]
    for name in (*names, "yaw 30 deg, to within 10 %", "flights that did not land"):
        assert lines[name].met, f"{name}: {lines[name].measured}"


def test_the_response_is_the_same_at_two_headings(flown: list[Measured]) -> None:
    lines = [line for line in table("Quad5in", flown, targets=True) if "headings" in line.name]
    assert len(lines) == 6
    for line in lines:
        assert line.met, f"{line.name}: {line.measured}"


def test_a_flight_flown_again_by_its_seed_is_the_same_flight(
    flown: list[Measured], tmp_path: Path
) -> None:
    again, _, _ = fly_into(robust_job(3), tmp_path / "flight.ulg")
    first = next(m for m in flown if m.job.kind is Kind.ROBUST and m.job.seed == 3)
    assert robust(again) == robust(first)
    assert again.largest_rate_rad_s == first.largest_rate_rad_s


def test_a_flight_that_was_cut_fails_whatever_it_did_before(flown: list[Measured]) -> None:
    first = flown[0]
    assert not robust(replace(first, cut=True)).passes
    assert not robust(replace(first, outcome=Outcome.FAILS)).passes


def test_a_step_that_swings_on_fails(flown: list[Measured]) -> None:
    swinging = [1.0 + 0.2 * np.sin(30.0 * grid(1.0))]
    spoilt = replace(flown[0], responses={**flown[0].responses, "roll": swinging})
    found = robust(spoilt)
    assert found.worst[0] == "roll settling"
    assert not found.passes


def test_the_file_has_null_for_what_was_not_measured(
    flown: list[Measured], capsys: pytest.CaptureFixture[str]
) -> None:
    cut = replace(flown[0], cut=True, responses={})
    lines = table("Quad5in", [], targets=True)
    assert not any(line.met for line in lines)  # nothing was flown
    found = Handling(1, lines, by_badness([cut, *flown[1:]]))
    said = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert not said["met"]
    assert said["robust"]["passed"] == 7
    assert said["robust"]["worst"][0]["seed"] == 1
    assert said["robust"]["worst"][0]["of_limit"] is None
    print_handling(found)
    printed = capsys.readouterr().out
    assert "7 of 8 flights pass" in printed
    assert "MISSED" in printed


def test_the_figures_are_drawn_the_same_each_time(flown: list[Measured], tmp_path: Path) -> None:
    first = write_figures(flown, tmp_path / "first")
    assert [path.name for path in first] == ["control_headings_Quad5in.png", "control_robust.png"]
    for path in first:
        again = tmp_path / "again" / path.name
        write_figures(flown, again.parent)
        assert path.read_bytes() == again.read_bytes()
