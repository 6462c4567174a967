"""Each option of the navigation buys what docs/navigation.md says: off and on, in the same flights.

Limits hold for the worst seed with the option on and for the mean with it off. They lie about twice
as far off as what was found, so that tuning may change, and well apart from each other.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from strix import options
from strix.options import aiding_options, attitude_options, health_options


def test_tilt_noise_from_vibration_keeps_level_where_the_gate_is_deceived() -> None:
    result = attitude_options.vibration().result
    # 1 m/s^2 to the side is 5.8 deg, which the gate adopts and more.
    assert result.mean["gate"]["tilt (deg)"] > 4.0
    assert result.worst["noise from vibration"]["tilt (deg)"] < 2.0
    assert result.worst["gate, inflated with motors"]["tilt (deg)"] < 4.0
    assert result.worst["gate, off with motors"]["tilt (deg)"] < 1.0
    for variant in result.worst.values():  # all alike while nothing shakes
        assert variant["tilt before (deg)"] < 0.2


def test_the_magnetometer_beside_running_motors_does_not_turn_the_heading() -> None:
    result = attitude_options.motor_iron().result
    # 10 uT across the 19 uT of the horizontal field would be 28 deg in the end.
    assert result.mean["on"]["heading (deg)"] > 7.0
    for variant in ("inflated", "hover only", "off"):
        assert result.worst[variant]["heading (deg)"] < 1.0
    # With a hover calibration the magnetometer is still of use.
    mean = result.mean
    assert mean["hover only"]["heading (deg)"] < mean["off"]["heading (deg)"]


def test_a_bent_field_cannot_tilt_the_attitude_through_the_heading() -> None:
    result = attitude_options.bent_field().result
    assert result.mean["three axes"]["tilt (deg)"] > 1.5
    assert result.worst["heading only"]["tilt (deg)"] < 0.3
    assert result.worst["heading only"]["heading (deg)"] < 1.0


def test_bounded_motion_keeps_level_in_lively_motion() -> None:
    result = attitude_options.bounded_motion().result
    assert result.mean["published tilt gate"]["tilt (deg)"] > 3.0
    assert result.worst["bounded motion"]["tilt (deg)"] < 1.5
    assert result.worst["bounded motion"]["heading (deg)"] < 1.0


def test_three_rapid_turns_leave_heading_and_biases_where_they_were() -> None:
    result = attitude_options.yaw_turns().result
    for variant in result.worst.values():
        # Issue 3. Turns show a bias, so that it may move to the truth, but not away from it.
        assert variant["magnetometer bias moves off by (uT)"] < 1.0
        assert variant["magnetometer bias at the end (uT)"] < 1.0
        assert variant["yaw at the end (deg)"] < 2.0  # issue 3
        # As far as 0.003 rad/s at alignment leave it free to move: never the 0.031 rad/s of the
        # scale error in the turns.
        assert variant["gyro bias moves by (rad/s)"] < 0.003


def test_gps_that_has_jumped_for_good_is_taken_in_again() -> None:
    result = aiding_options.gps_jump().result
    assert result.mean["never"]["position at the end (m)"] > 25.0
    assert result.worst["never"]["readmissions"] == 0.0
    assert 1.0 <= result.worst["after 1 s"]["readmissions"] <= 2.0
    assert result.worst["after 1 s"]["position 5 s after (m)"] < 1.0
    # The jump is one of position: it must not shake velocity and attitude.
    assert result.worst["after 1 s"]["velocity (m/s)"] < 1.0
    assert result.worst["after 1 s"]["tilt (deg)"] < 1.0


def test_a_late_fix_is_compared_with_the_state_of_its_own_time() -> None:
    result = aiding_options.delays().result
    off, on = result.mean["taken as new"], result.worst["age known"]
    # 0.2 s at 5.6 m/s RMS are 1.1 m; at 4.4 m/s^2 RMS they are 0.9 m/s.
    assert off["position (m)"] > 0.8
    assert off["velocity (m/s)"] > 0.6
    assert off["tilt (deg)"] > 0.7
    assert on["position (m)"] < 0.3
    assert on["velocity (m/s)"] < 0.2
    assert on["tilt (deg)"] < 0.3
    assert on["height (m)"] < 0.1 < 0.3 < off["height (m)"]


@pytest.mark.parametrize("states", [9, 18])
def test_an_aircraft_on_the_ground_stays_where_it_is(states: int) -> None:
    result = aiding_options.standstill(states).result
    assert result.mean["off"]["drift (m)"] > 5.0
    assert result.worst["on"]["drift (m)"] < 0.05  # issue 3


def test_dead_reckoning_knows_how_wrong_it_is() -> None:
    outage = aiding_options.outage()
    for nees in outage.nees.values():
        expected = 4 * len(nees)
        # 97.5 % from above; from below it may allow for what this truth has not, but not much.
        assert 0.5 * expected < nees.sum() < chi2.ppf(0.975, expected)
    # 0.3 % of a normal error lie beyond 3 sigma; one outage that does so stays there for long.
    assert max(outage.beyond.values()) < 0.03
    mean = outage.comparison.result.mean
    position = "position at the end (m)"
    assert mean["bounded motion"][position] < mean["dead reckoning"][position]


def test_a_silent_sensor_raises_its_flag_and_clears_it_when_it_speaks_again() -> None:
    result = health_options.silent_sensors().result.mean
    limits_s = {"no GPS": 5.0, "no altimeter": 2.0, "no magnetometer": 30.0}  # NavigationConfig.h
    for flag, limit_s in limits_s.items():
        assert result[flag]["raised (s after)"] == pytest.approx(limit_s, abs=0.2)
        assert result[flag]["cleared (s after)"] == pytest.approx(0.0, abs=0.2)


@pytest.mark.parametrize("accel_m_s2", [np.nan, np.inf, 1e30])
def test_a_lost_filter_starts_anew_within_one_pass_and_flies_on(accel_m_s2: float) -> None:
    loss = health_options.lost(accel_m_s2)
    track = loss.track
    assert track.navigation.restarts() == 1
    assert not np.any(track.health & health_options.LOST)
    assert np.all(track.health[loss.record :] & health_options.RESTARTED)
    # The complementary filter's attitude, in the pass of the loss.
    assert track.tilt_deg[loss.record] < 2.0
    # Its 0.2 rad of doubt let the first fixes tilt it; half a minute later all is as before.
    assert track.tilt_deg[loss.record :].max() < 15.0
    assert track.tilt_deg[-1] < 0.5
    assert np.linalg.norm(track.position_m[-1]) < 1.0


def test_the_complementary_filter_tells_a_wrong_attitude() -> None:
    result = health_options.disagreement().result.mean
    assert result["0 deg wrong"]["flagged from (s)"] == np.inf
    for wrong in ("60 deg wrong", "170 deg wrong"):
        assert result[wrong]["flagged from (s)"] < 15.0
        assert result[wrong]["told when wrong"] == 1.0
        assert result[wrong]["told when right"] < 0.05


def test_every_scenario_has_its_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    few = {name: options.SCENARIOS[name] for name in ("silent_sensors", "disagreement")}
    monkeypatch.setattr(options, "SCENARIOS", few)
    tables = list(options.write_figures(tmp_path))
    assert [path.name for path in sorted(tmp_path.iterdir())] == [
        "option_disagreement.png",
        "option_silent_sensors.png",
    ]
    assert "no altimeter" in tables[0]
