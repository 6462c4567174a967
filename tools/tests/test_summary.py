"""The numbers of a flight, on flights whose numbers are known beforehand."""

from __future__ import annotations

import io
import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rich.console import Console
from synthetic_flight import ARMED, HOLD, IDLE, LAND, SAFE, TAKEOFF
from ulog_writer import ULogWriter

from strix.flightlog import read_flight_log
from strix.summary import Summary, print_summary, summarise, verdict
from strix.track import TruthTrack

Array = NDArray[np.float64]

TIME_S = np.arange(1001) / 100.0  # 0 to 10 s
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
FLYING_S = (3.0, 8.5)  # off the ground; the motors are on from 2 to 9 s, the controller from 3 s
STATES = ((0.0, IDLE), (2.0, ARMED), (3.0, TAKEOFF), (5.0, HOLD), (7.0, LAND), (9.0, IDLE))
KEYS = (
    "landed disarmed duration_s wall_s landing_error_m max_tilt_deg rms_attitude_deg "
    "rms_position_m rms_tracking_m log_drops loop_overruns"
)


def during(begin_s: float, end_s: float) -> NDArray[np.bool_]:
    return (begin_s < TIME_S) & (end_s >= TIME_S)


def rotation(angle_deg: float, axis: tuple[float, float, float]) -> Array:
    half = math.radians(angle_deg) / 2.0
    unit = np.array(axis) / np.linalg.norm(axis)
    return np.array([math.cos(half), *(math.sin(half) * unit)])


@dataclass
class Case:
    """A flight on which nothing moves and nothing is wrong, until a test changes it."""

    def __post_init__(self) -> None:
        n = len(TIME_S)
        self.states: tuple[tuple[float, int], ...] = STATES
        self.estimate_ned_m = np.zeros((n, 3))
        self.estimate_q = np.tile(LEVEL, (n, 1))
        self.reference_ned_m = np.zeros((n, 3))
        self.drops = np.zeros(n)
        self.overruns = np.zeros(n)
        self.truth = TruthTrack(
            time_s=TIME_S,
            position_ned_m=np.zeros((n, 3)),
            velocity_ned_m_s=np.zeros((n, 3)),
            attitude=np.tile(LEVEL, (n, 1)),
            rate_body_rad_s=np.zeros((n, 3)),
            rotor_speed=np.zeros((n, 4)),
            on_ground=~during(*FLYING_S),
        )

    def summary(self, folder: Path, *, real: bool = False) -> Summary:
        log = ULogWriter()
        x, y, z = self.estimate_ned_m.T
        log.topic("vehicle_local_position", TIME_S, {"x": x, "y": y, "z": z})
        log.topic("vehicle_attitude", TIME_S, {"q": self.estimate_q})
        log.topic("trajectory_setpoint", TIME_S, {"position": self.reference_ned_m})
        states = np.array([state for _, state in self.states])
        flags = {
            "state": states,
            "motors_on": (states >= ARMED) & (states <= LAND),
            "controller_on": (states >= TAKEOFF) & (states <= LAND),
            "critical": states == SAFE,
        }
        log.topic("flight_state", [begin_s for begin_s, _ in self.states], flags)
        log.topic("log_status", TIME_S, {"dropped": self.drops})
        log.topic("control_tick", TIME_S, {"overruns": self.overruns})
        path = log.write(folder / "flight.ulg")
        return summarise(read_flight_log(path), None if real else self.truth, 1.25)


@pytest.fixture
def case() -> Case:
    return Case()


def test_a_perfect_flight(case: Case, tmp_path: Path) -> None:
    assert case.summary(tmp_path).to_dict() == {
        "landed": True,
        "disarmed": True,
        "duration_s": pytest.approx(10.0),
        "wall_s": 1.25,
        "landing_error_m": 0.0,
        "max_tilt_deg": 0.0,
        "rms_attitude_deg": 0.0,
        "rms_position_m": 0.0,
        "rms_tracking_m": 0.0,
        "log_drops": 0,
        "loop_overruns": 0,
    }


def test_an_estimate_turned_by_two_degrees_is_two_degrees_off(case: Case, tmp_path: Path) -> None:
    case.truth.attitude[:] = rotation(120.0, (0.0, 0.3, 1.0))
    w, x, y, z = case.truth.attitude[0]
    matrix = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    case.estimate_q[:] = matrix @ rotation(2.0, (1.0, 2.0, 2.0))
    case.estimate_q[during(4.0, 5.0)] *= -1.0  # the same attitude
    case.estimate_q[during(0.0, 1.9) | during(9.1, 10.0)] = LEVEL  # motors off: not counted
    summary = case.summary(tmp_path)
    assert summary.rms_attitude_deg == pytest.approx(2.0, abs=1e-4)  # the log has 24 bit


def test_the_attitude_error_is_an_rms_over_the_time_the_motors_are_on(
    case: Case, tmp_path: Path
) -> None:
    case.estimate_q[during(2.0, 3.75)] = rotation(4.0, (0.0, 1.0, 0.0))  # a quarter of 2 to 9 s
    assert case.summary(tmp_path).rms_attitude_deg == pytest.approx(2.0, rel=1e-2)


def test_position_error_counts_all_three_axes_in_flight(case: Case, tmp_path: Path) -> None:
    case.estimate_ned_m[:] = (100.0, 0.0, 0.0)
    case.estimate_ned_m[during(*FLYING_S)] = (0.3, -0.4, 1.2)
    assert case.summary(tmp_path).rms_position_m == pytest.approx(1.3, rel=1e-5)


def test_tracking_error_is_truth_minus_reference_in_flight(case: Case, tmp_path: Path) -> None:
    case.truth.position_ned_m[:] = (0.0, 1.6, 0.0)
    case.reference_ned_m[:] = (0.0, 1.0, -0.8)
    case.reference_ned_m[TIME_S > 8.5] = (0.0, 0.0, 3.0)  # below the ground, after touch-down
    case.estimate_ned_m[:] = (9.0, 9.0, 9.0)  # plays no part
    assert case.summary(tmp_path).rms_tracking_m == pytest.approx(1.0, rel=1e-5)


def test_landing_error_is_the_horizontal_distance_at_the_end(case: Case, tmp_path: Path) -> None:
    case.truth.position_ned_m[:] = (1.0, 1.0, -7.0)
    case.truth.position_ned_m[-1] = (3.0, -4.0, 0.5)
    summary = case.summary(tmp_path)
    assert summary.landing_error_m == pytest.approx(5.0)
    assert verdict(summary) == "Landed 5.00 m from the start, disarmed"


def test_tilt_is_the_angle_from_the_vertical_in_flight(case: Case, tmp_path: Path) -> None:
    case.truth.attitude[during(4.0, 5.0)] = rotation(30.0, (3.0, 4.0, 0.0))
    case.truth.attitude[during(5.0, 6.0)] = rotation(170.0, (0.0, 0.0, 1.0))  # yaw is no tilt
    case.truth.attitude[during(0.0, 1.0)] = rotation(80.0, (1.0, 0.0, 0.0))  # carried by hand
    assert case.summary(tmp_path).max_tilt_deg == pytest.approx(30.0)


def test_a_flight_that_starts_off_the_ground_is_not_in_flight_before_it_is_armed(
    case: Case, tmp_path: Path
) -> None:
    case.truth.on_ground[:100] = False
    case.truth.attitude[:100] = rotation(80.0, (1.0, 0.0, 0.0))
    assert case.summary(tmp_path).max_tilt_deg == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("states", "landed", "disarmed"),
    [
        (STATES, True, True),
        ((*STATES, (9.5, ARMED)), True, False),
        (STATES[:-1], False, False),  # the log ends in LAND
        ((*STATES[:-1], (9.0, SAFE)), False, True),  # switched off on the way down
        ((*STATES[:4], (6.0, SAFE)), False, True),
        (((0.0, IDLE), (2.0, ARMED), (9.0, IDLE)), False, True),  # never took off
        (((0.0, IDLE),), False, True),
    ],
)
def test_landed_and_disarmed_are_what_the_states_say(
    case: Case, tmp_path: Path, states: tuple[tuple[float, int], ...], landed: bool, disarmed: bool
) -> None:
    case.states = states
    summary = case.summary(tmp_path)
    assert (summary.landed, summary.disarmed) == (landed, disarmed)
    assert verdict(summary).startswith("Landed" if landed else "Did not land")


def test_an_aircraft_that_hangs_in_a_tree_has_not_landed(case: Case, tmp_path: Path) -> None:
    case.truth.on_ground[-50:] = False
    assert not case.summary(tmp_path).landed


def test_losses_are_counted_to_the_end(case: Case, tmp_path: Path) -> None:
    case.drops[500:] = 3.0
    case.overruns[-1] = 7.0
    summary = case.summary(tmp_path)
    assert (summary.log_drops, summary.loop_overruns) == (3, 7)


def test_a_real_flight_is_measured_by_its_estimate(case: Case, tmp_path: Path) -> None:
    case.estimate_ned_m[:] = (0.6, 0.8, 0.0)
    case.estimate_q[during(4.0, 5.0)] = rotation(20.0, (0.0, 1.0, 0.0))
    summary = case.summary(tmp_path, real=True)
    assert summary.landed
    assert summary.rms_attitude_deg is None
    assert summary.rms_position_m is None
    assert summary.rms_tracking_m == pytest.approx(1.0)
    assert summary.landing_error_m == pytest.approx(1.0)
    assert summary.max_tilt_deg == pytest.approx(20.0, abs=1e-4)


def test_a_flight_that_never_was_has_no_errors(case: Case, tmp_path: Path) -> None:
    case.states = ((0.0, IDLE),)
    summary = case.summary(tmp_path)
    unknown = (summary.max_tilt_deg, summary.rms_attitude_deg, summary.rms_position_m)
    assert unknown == (None, None, None)
    assert summary.rms_tracking_m is None


def test_summary_json_has_exactly_the_agreed_keys_and_is_json(case: Case, tmp_path: Path) -> None:
    case.estimate_q[500] = math.nan  # a filter that broke down
    summary = case.summary(tmp_path)
    written = json.dumps(summary.to_dict(), allow_nan=False)
    assert list(json.loads(written)) == KEYS.split()
    assert json.loads(written)["rms_attitude_deg"] is None


def test_the_table_is_plain_lines_in_a_pipe(case: Case, tmp_path: Path) -> None:
    def printed(summary: Summary, **options: Any) -> str:
        out = io.StringIO()
        print_summary(summary, Console(file=out, width=80, **options))
        return out.getvalue()

    summary = replace(case.summary(tmp_path), landing_error_m=0.126, rms_position_m=None)
    lines = printed(summary).splitlines()
    assert len(lines) == len(KEYS.split())
    assert lines[0].split()[:2] == ["landed", "yes"]
    assert lines[4].split()[:4] == ["landing", "error", "0.13", "m"]
    assert lines[7].split()[:4] == ["position", "error", "-", "RMS,"]
    assert max(map(len, lines)) <= 80
    assert "\x1b" not in printed(summary)
    assert "\x1b" in printed(summary, force_terminal=True, color_system="standard")
