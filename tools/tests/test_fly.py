"""Whole flights: the flight software against the plant, as `strix fly` runs them."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from pyulog import ULog
from typer.testing import CliRunner

from strix.cli import app
from strix.flightlog import FlightLog, read_flight_log
from strix.fly import make_plan
from strix.plant.sensors import DEFAULT_CONSTANTS
from strix.simulation import FlightPlan, fly
from strix.summary import Summary, summarise
from strix.track import TruthTrack

HEADINGS_DEG = (0.0, 90.0, 180.0, -135.0)

# Sensors without noise or bias: what is left to differ between two flights is the flight itself.
IDEAL = replace(
    DEFAULT_CONSTANTS,
    accel_sigma_m_s2=0.0,
    gyro_sigma_rad_s=0.0,
    accel_bias_sigma_m_s2=0.0,
    gyro_bias_sigma_rad_s=0.0,
    gyro_bias_walk_rad_s_sqrt_s=0.0,
    mag_sigma_ut=0.0,
    baro_sigma_pa=0.0,
    gps_position_sigma_m=0.0,
    gps_altitude_sigma_m=0.0,
    gps_velocity_sigma_m_s=0.0,
)


@dataclass(frozen=True)
class Flown:
    """A flight that was flown once and is looked at by several tests."""

    track: TruthTrack
    log: FlightLog
    path: Path

    @property
    def summary(self) -> Summary:
        return summarise(self.log, self.track, 0.0)


def _plans() -> dict[str, FlightPlan]:
    noisy = {
        f"noisy {heading:g}": make_plan("Quad5in", "first-flight", "calm", heading, seed=11 + i)
        for i, heading in enumerate(HEADINGS_DEG)
    }
    ideal = {
        f"ideal {heading:g}": replace(
            make_plan("Quad5in", "first-flight", "calm", heading, seed=1),
            sensors=IDEAL,
            arm_at_s=8.0,  # without noise there is nothing to average for long
        )
        for heading in HEADINGS_DEG
    }
    others = {
        "wind": make_plan("Quad5in", "first-flight", "wind", 30.0, seed=3),
        "ugglan": make_plan("UgglanQ450", "first-flight", "calm", 45.0, seed=4),
    }
    return noisy | ideal | others


def _fly(plan: FlightPlan, path: Path) -> TruthTrack:
    return fly(plan, path, lambda _time_s, _state: None)


@pytest.fixture(scope="session")
def flights(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Flown]:
    """All flights of this file, flown side by side."""
    folder = tmp_path_factory.mktemp("flights")
    plans = _plans()
    paths = {name: folder / f"{name.replace(' ', '_')}.ulg" for name in plans}
    with ProcessPoolExecutor() as pool:
        tracks = dict(zip(plans, pool.map(_fly, plans.values(), paths.values()), strict=True))
    return {name: Flown(tracks[name], read_flight_log(paths[name]), paths[name]) for name in plans}


def at_waypoints(flown: Flown) -> list[np.ndarray]:
    """Truth in NED at the end of each stay: when the state leaves HOLD."""
    states = flown.log.topic("flight_state")
    hold = 4.0  # FlightState::Hold
    leaves = np.flatnonzero((states["state"][:-1] == hold) & (states["state"][1:] != hold)) + 1
    times = states.time_s[leaves]
    return list(flown.track.at(times, flown.track.position_ned_m))


NOISY = tuple(f"noisy {heading:g}" for heading in HEADINGS_DEG)


@pytest.mark.parametrize("name", [*NOISY, "wind", "ugglan"])
def test_every_flight_lands_and_disarms(flights: Mapping[str, Flown], name: str) -> None:
    summary = flights[name].summary
    assert summary.landed
    assert summary.disarmed


@pytest.mark.parametrize("name", NOISY)
def test_the_aircraft_lands_within_a_metre_of_home(flights: Mapping[str, Flown], name: str) -> None:
    summary = flights[name].summary
    assert summary.landing_error_m is not None
    assert summary.landing_error_m < 1.0  # what the first flight is asked to do


@pytest.mark.parametrize("name", NOISY)
def test_the_aircraft_holds_each_leg(flights: Mapping[str, Flown], name: str) -> None:
    # 1.5 m horizontally: the estimate's own 3 sigma (0.35 m) for two axes, plus the arrival radius.
    expected = [(0.0, 0.0, -2.0), (5.0, 3.0, -2.0), (5.0, 3.0, -2.0), (0.0, 0.0, -2.0)]
    stays = at_waypoints(flights[name])
    assert len(stays) == len(expected)
    for stay, wanted in zip(stays, expected, strict=True):
        assert np.linalg.norm(stay[:2] - wanted[:2]) < 1.5
        assert abs(stay[2] - wanted[2]) < 0.3  # 3 sigma of the altimeter's white noise is 0.5 m


@pytest.mark.parametrize("heading", HEADINGS_DEG)
def test_the_aircraft_turns_a_quarter_to_the_right(
    flights: Mapping[str, Flown], heading: float
) -> None:
    track = flights[f"ideal {heading:g}"].track
    w, x, y, z = track.attitude.T
    yaw_deg = np.degrees(np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))
    assert yaw_deg[-1] - yaw_deg[0] == pytest.approx(90.0, abs=3.0)


@pytest.mark.parametrize("heading", HEADINGS_DEG[1:])
def test_the_response_is_the_same_at_every_heading(
    flights: Mapping[str, Flown], heading: float
) -> None:
    # The same way over ground, whichever way the nose points. 0.15 m: pitch and roll inertia differ
    # by a quarter, and GPS readings come in steps of 0.19 m.
    north = flights["ideal 0"].track
    other = flights[f"ideal {heading:g}"].track
    end_s = min(north.time_s[-1], other.time_s[-1])
    assert abs(north.time_s[-1] - other.time_s[-1]) < 1.0
    time_s = np.arange(0.0, end_s, 0.1)
    apart = north.at(time_s, north.position_ned_m) - other.at(time_s, other.position_ned_m)
    assert np.abs(apart).max() < 0.15


def test_every_sample_of_every_sensor_is_in_the_log(flights: Mapping[str, Flown]) -> None:
    log = flights["noisy 0"].log
    assert flights["noisy 0"].summary.log_drops == 0
    for topic, rate_hz in (
        ("sensor_combined", 1000),
        ("sensor_mag", 100),
        ("sensor_baro", 50),
        ("vehicle_gps_position", 10),
        ("actuator_outputs", 500),
    ):
        records = log.topic(topic)
        expected = rate_hz * log.duration_s
        assert len(records.time_s) == pytest.approx(expected, abs=0.01 * rate_hz + 2)


def test_pyulog_reads_the_log_without_a_word(
    flights: Mapping[str, Flown], capsys: pytest.CaptureFixture[str]
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        log = ULog(str(flights["noisy 0"].path))
    assert not log.file_corruption
    assert log.dropouts == []
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == ""


def test_motors_are_off_whenever_the_state_says_so(flights: Mapping[str, Flown]) -> None:
    flown = flights["noisy 0"]
    outputs = flown.log.topic("actuator_outputs")
    states = flown.log.topic("flight_state")
    motors_on = states["motors_on"][
        np.maximum(np.searchsorted(states.time_s, outputs.time_s, side="right") - 1, 0)
    ]
    off_us, cap_us = 1150.0, 1700.0  # Quad5in.h
    assert np.all(outputs["output"][motors_on == 0] == off_us)
    assert np.all(outputs["output"][motors_on == 1] > off_us)
    assert np.all(outputs["output"] <= cap_us)


def test_the_same_seed_gives_the_same_log(flights: Mapping[str, Flown], tmp_path: Path) -> None:
    again = tmp_path / "again.ulg"
    _fly(_plans()["noisy 0"], again)
    assert again.read_bytes() == flights["noisy 0"].path.read_bytes()


def test_fly_leaves_its_three_files_and_the_summary(tmp_path: Path) -> None:
    mission = tmp_path / "hop.txt"
    mission.write_text("takeoff 1 0.5  # up and down\n", encoding="utf-8")
    out = tmp_path / "out"
    result = CliRunner().invoke(
        app, ["fly", "--mission", str(mission), "--out", str(out), "--json"]
    )
    assert result.exit_code == 0, result.output
    printed = json.loads(result.stdout)
    assert set(printed) == {
        "landed",
        "disarmed",
        "duration_s",
        "wall_s",
        "landing_error_m",
        "max_tilt_deg",
        "rms_attitude_deg",
        "rms_position_m",
        "rms_tracking_m",
        "log_drops",
        "loop_overruns",
        "scenario",
        "expected",
        "outcome",
    }
    assert printed["outcome"] == printed["expected"] == "lands"
    assert json.loads((out / "summary.json").read_text(encoding="utf-8")) == printed
    assert (out / "flight.ulg").stat().st_size > 1_000_000
    assert "<html" in (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("controller", ["ugglan", "sticks"])
def test_ugglan_flies_with_its_own_law_and_with_its_own_pipeline(
    controller: str, tmp_path: Path
) -> None:
    """The law at 500 Hz under the LQR's positions; and 50 Hz with a pilot at the sticks."""
    line = f"fly --vehicle UgglanQ450 --controller {controller} --scenario wind --json --out"
    result = CliRunner().invoke(app, [*line.split(), str(tmp_path)])
    assert result.exit_code == 0, result.output
    printed = json.loads(result.stdout)
    assert printed["outcome"] == "lands"
    assert printed["max_tilt_deg"] < 20.0  # 10 deg are asked for, in a wind that asks for 2
    assert printed["loop_overruns"] == printed["log_drops"] == 0
    # Without GPS in it the published pipeline knows no place.
    assert (printed["rms_position_m"] is None) == (controller == "sticks")
    assert "<html" in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--vehicle", "Quad6in"], "expected one of Quad5in, UgglanQ450, found 'Quad6in'"),
        (["--mission", "nowhere"], "expected a file or one of first-flight, "),
        (["--scenario", "storm"], "unknown scenario 'storm'"),
        (["--heading", "nan"], "--heading: expected degrees"),
        (["--controller", "pid"], "--controller: expected one of lqr, ugglan, sticks, found 'pid'"),
        (["--controller", "ugglan"], "expected --vehicle UgglanQ450"),
        (
            ["--vehicle", "UgglanQ450", "--controller", "sticks", "--mission", "square"],
            "expected no mission",
        ),
        (
            ["--vehicle", "UgglanQ450", "--controller", "sticks", "--scenario", "heavy"],
            "a scenario of the air alone",
        ),
    ],
)
def test_a_wrong_option_is_told_in_one_line(
    arguments: list[str], told: str, tmp_path: Path
) -> None:
    result = CliRunner().invoke(app, ["fly", *arguments, "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert told in result.stderr
    assert result.stderr.count("\n") == 1


def test_an_out_folder_that_cannot_be_written_is_told_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    result = CliRunner().invoke(app, ["fly", "--out", str(file / "out")])
    assert result.exit_code == 2
    assert "expected a folder that can be written" in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("leg 1 2 x 0 1", "HEIGHT_M: expected a number, found 'x'"),
        ("leg 100 0 2 0 1", "NORTH_M: expected -30 to 30 m, found '100'"),  # out of the fence
    ],
)
def test_a_wrong_mission_file_is_told_with_its_line(line: str, told: str, tmp_path: Path) -> None:
    mission = tmp_path / "mission.txt"  # what else can be wrong in one: test_missions.py
    mission.write_text(f"takeoff 2 1\n{line}\n", encoding="utf-8")
    result = CliRunner().invoke(
        app, ["fly", "--mission", str(mission), "--out", str(tmp_path / "out")]
    )
    assert result.exit_code == 2
    assert f"{mission}, line 2, {told}" in result.stderr
    assert result.stderr.count("\n") == 1
