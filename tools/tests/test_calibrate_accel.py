"""`strix calibrate accel` and `level`: known errors come back; a poor log is told what it lacks."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_bench import (
    ACCEL_NOISE,
    RATE_HZ,
    UP,
    Array,
    Errors,
    bench_imu,
    edges,
    imu_log,
    random_rotation,
    tilted,
)
from typer.testing import CliRunner
from ulog_writer import ULogWriter

from strix.calibrate import header
from strix.calibrate.accel import calibrate_accel
from strix.calibrate.cli import calibrate_app, parse_mounting
from strix.calibrate.level import calibrate_level
from strix.calibrate.outcome import Incomplete, angle_deg, rotation
from strix.calibrate.readings import Imu
from strix.errors import BadInput

runner = CliRunner()
STILL_S = 4.0
# One sigma of the mean of one axis in one position: white noise, STILL_S without the cut ends (2 x
# 0.3 s, and what the shaking before keeps of the low-pass: a second is generous).
MEAN_SIGMA = ACCEL_NOISE / np.sqrt((STILL_S - 1.6) * RATE_HZ)
FACES = [np.array(up) for up in UP.values()]


def test_six_square_positions_give_all_twelve_parameters() -> None:
    errors = Errors()
    found = calibrate_accel(bench_imu(FACES, errors))
    # Each number comes of means of at least two positions; 5 sigma of one position's mean.
    assert found.bias_m_s2 == pytest.approx(errors.bias, abs=5.0 * MEAN_SIGMA)
    assert found.scale == pytest.approx(errors.scale, abs=5.0 * MEAN_SIGMA / 9.8)
    assert found.before_m_s2 > 0.2
    assert found.after_m_s2 < 5.0 * MEAN_SIGMA


@given(
    seed=st.integers(0, 2**32 - 1),
    order=st.permutations(range(18)),
    known=st.booleans(),
)
@settings(max_examples=15, deadline=None)
def test_any_order_and_any_mounting_with_positions_on_edges(
    seed: int, order: list[int], known: bool
) -> None:
    random = np.random.default_rng(seed)
    mounting = random_rotation(random) if known else rotation(random.normal(0.0, 0.05, 3))
    asymmetric = random.uniform(-0.02, 0.02, (3, 3))
    errors = Errors(
        bias=random.uniform(-0.5, 0.5, 3),
        scale=np.eye(3) + (asymmetric + asymmetric.T) / 2.0,
        mounting=mounting,
    )
    # Put down by hand: nothing is square by 5 deg, so directions can tell nothing.
    ups = [tilted(up, random.uniform(0.0, 5.0), random) for up in [*FACES, *edges()]]
    imu = bench_imu([ups[i] for i in order], errors, seed, still_s=3.0)
    found = calibrate_accel(imu, mounting if known else None)
    # 18 equations for nine unknowns, worst direction about one position's mean; 6 sigma, as
    # many of 15 x 9 numbers are looked at.
    assert found.bias_m_s2 == pytest.approx(errors.bias, abs=6.0 * MEAN_SIGMA)
    assert found.scale == pytest.approx(errors.scale, abs=12.0 * MEAN_SIGMA / 9.8)


def test_crooked_faces_are_owned_up_to_and_more_positions_asked_for() -> None:
    random = np.random.default_rng(3)
    errors = Errors()
    found = calibrate_accel(bench_imu([tilted(up, 4.0, random) for up in FACES], errors))
    assert 1.0 < found.placing_deg < 8.0
    # Bias and scale come of lengths, to second order in the tilt: 0.5 (4 deg)^2 of the 2 % of
    # cross terms, and first order of the cross terms themselves: 0.07 x 0.011 x g.
    assert found.bias_m_s2 == pytest.approx(errors.bias, abs=0.03)
    off = np.abs(found.scale - errors.scale)
    assert (off < 4.0 * found.scale_sigma + 1e-12).all()
    assert "on edges" in "\n".join(found.sentences())


@pytest.mark.parametrize("missing", list(UP))
def test_a_missing_face_is_named(missing: str) -> None:
    ups = [np.array(up) for name, up in UP.items() if name != missing]
    with pytest.raises(Incomplete, match=f"missing: {missing} "):
        calibrate_accel(bench_imu(ups, Errors(), still_s=2.5))


def test_one_face_is_told_the_other_five() -> None:
    with pytest.raises(
        Incomplete, match="found 1 still positions: level; missing: upside down, nos"
    ):
        calibrate_accel(bench_imu(FACES[:1], Errors()))


def test_an_aircraft_in_motion_has_no_positions() -> None:
    imu = bench_imu(FACES, Errors(), tremble=15.0)  # 0.4 m/s^2 and 0.05 rad/s: held by hand
    with pytest.raises(Incomplete, match="found 0 still positions: none of them"):
        calibrate_accel(imu)


def test_a_scale_no_sensor_has_is_refused() -> None:
    with pytest.raises(Incomplete, match=r"a scale within 10 % .* found 12\.\d %"):
        calibrate_accel(bench_imu(FACES, Errors(scale=np.diag([1.12, 1.0, 1.0]))))


# ---- level ----


def heading_ups(mounting_trim: Array, table: Array, headings_deg: list[float]) -> list[Array]:
    """Up in the IMU's idea of body axes: the table's slope stays, the aircraft turns."""
    ups = []
    for heading in np.radians(headings_deg):
        in_world = rotation(table) @ np.array([0.0, 0.0, -1.0])
        true_body = rotation(np.array([0.0, 0.0, heading])).T @ in_world
        ups.append(rotation(mounting_trim).T @ true_body)
    return ups


def imu_on_table(trim: Array, table: Array, headings_deg: list[float], seed: int = 1) -> Imu:
    """Turned about z by the gyro's account, which the way between the positions must show."""
    imu = bench_imu(heading_ups(trim, table, headings_deg), Errors(), seed)
    gyro = imu.gyro_rad_s.copy()
    turn, rest = round(1.0 * RATE_HZ), round(4.0 * RATE_HZ)
    for i, change in enumerate(np.radians(np.diff(headings_deg))):
        begin = rest + i * (turn + rest)
        gyro[begin : begin + turn] = Errors().gyro_bias
        gyro[begin : begin + turn, 2] += change  # in one second
    return Imu(imu.where, imu.time_s, imu.accel_m_s2, gyro, imu.temperature_degc)


@pytest.mark.parametrize("headings", [[0.0, 180.0], [30.0, 130.0, 290.0], [0.0, -90.0]])
def test_level_tells_the_mounting_from_the_table(headings: list[float]) -> None:
    trim, table = np.radians([1.5, -0.8, 0.0]), np.radians([0.6, 0.9, 0.0])
    imu = imu_on_table(trim, table, headings)
    found = calibrate_level(imu, np.eye(3), Errors().bias, Errors().scale)
    # Directions are known to MEAN_SIGMA / g, 0.0046 deg; products of the two tilts, 0.02 deg.
    assert np.degrees([found.roll_rad, found.pitch_rad]) == pytest.approx([1.5, -0.8], abs=0.06)
    assert found.table_deg == pytest.approx(np.hypot(0.6, 0.9), abs=0.06)


def test_level_turns_what_the_imu_sees_upright() -> None:
    trim = np.radians([-2.0, 3.0, 0.0])
    up = heading_ups(trim, np.zeros(3), [0.0])[0]
    found = calibrate_level(bench_imu([up], Errors()), np.eye(3), Errors().bias, Errors().scale)
    assert angle_deg(found.matrix @ up, np.array([0.0, 0.0, -1.0])) < 0.03  # 6 of 0.0046 deg
    assert found.table_deg is None
    assert "turn the aircraft by 180 deg" in "\n".join(found.sentences())


def test_level_refuses_what_is_another_mounting() -> None:
    with pytest.raises(Incomplete, match=r"found 180\.\d deg"):
        calibrate_level(bench_imu([FACES[1]], Errors()), np.eye(3), Errors().bias, Errors().scale)


# ---- the commands ----


def test_accel_writes_the_header_and_level_reads_it(tmp_path: Path) -> None:
    target = tmp_path / "Calibration.h"
    log = imu_log(tmp_path / "six.ulg", bench_imu(FACES, Errors()))
    done = runner.invoke(
        calibrate_app, ["accel", str(log), "--write", str(target), "--out", str(tmp_path)]
    )
    assert done.exit_code == 0, done.output
    assert (tmp_path / "calibrate_accel.png").stat().st_size > 10_000
    written = header.read_header(target)
    assert written.values["accelBias"] == pytest.approx(Errors().bias, abs=5.0 * MEAN_SIGMA)
    assert written.sources["accelScale"] == "strix calibrate accel six.ulg"

    # The bias of 0.4 m/s^2 would be 2.3 deg of roll.
    table = imu_log(tmp_path / "table.ulg", bench_imu(FACES[:1], Errors(), seed=2))
    done = runner.invoke(
        calibrate_app,
        ["level", str(table), "--calibration", str(target), "--json", "--out", str(tmp_path)],
    )
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert np.degrees([found["roll_rad"], found["pitch_rad"]]) == pytest.approx([0, 0], abs=0.05)


def test_a_log_that_does_not_suffice_is_status_1(tmp_path: Path) -> None:
    log = imu_log(tmp_path / "two.ulg", bench_imu(FACES[:2], Errors()))
    done = runner.invoke(calibrate_app, ["accel", str(log), "--out", str(tmp_path)])
    assert done.exit_code == 1
    assert "missing: nose up, nose down" in done.stderr
    assert not list(tmp_path.glob("*.png"))


def spoiled(kind: str) -> Imu:
    imu = bench_imu(FACES, Errors(), still_s=2.0)
    accel = imu.accel_m_s2.copy()
    if kind == "nan":
        accel[500, 1] = np.nan
    elif kind == "clipped":
        shaken = np.abs(accel[:, 0]) > 11.0
        accel[shaken, 0] = np.sign(accel[shaken, 0]) * 15.69  # 1.6 g, and no more
        accel[1100:1140, 0] = 15.69
    elif kind == "full scale":
        accel[100, 2] = 30.0 * 9.80665
    elif kind == "stuck":
        accel[600:1200] = accel[600]
    return Imu(imu.where, imu.time_s, accel, imu.gyro_rad_s, imu.temperature_degc)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("nan", "record 501, accelerometer: expected finite numbers, found"),
        ("clipped", "accelerometer: expected readings within the sensor's range, found"),
        ("full scale", "found 1 of"),
        ("stuck", "the same value for 1.2 s"),
    ],
)
def test_bad_readings_are_status_2(kind: str, words: str, tmp_path: Path) -> None:
    log = imu_log(tmp_path / "bad.ulg", spoiled(kind))
    done = runner.invoke(calibrate_app, ["accel", str(log), "--out", str(tmp_path)])
    assert done.exit_code == 2, done.output
    assert words in done.stderr
    assert done.stderr.startswith("strix: ")
    assert done.stderr.count("\n") == 1


def test_a_log_without_the_topic_is_status_2(tmp_path: Path) -> None:
    log = ULogWriter()
    log.topic("sensor_baro", np.arange(10.0), {"pressure": 1e5 + np.arange(10.0)})
    path = log.write(tmp_path / "baro.ulg")
    done = runner.invoke(calibrate_app, ["accel", str(path)])
    assert done.exit_code == 2
    assert "topic sensor_combined: expected records, found only those of sensor_baro" in done.stderr


@pytest.mark.parametrize(
    "text", ["1,0,0", "1 0 0 0 1 0 0 0 x", "1,0,0,0,1,0,0,0,-1", "1,0,0,0,1,0,0,0,1.1", "nan " * 9]
)
def test_a_mounting_that_is_no_rotation_is_refused(text: str) -> None:
    with pytest.raises(BadInput, match="--mounting: expected"):
        parse_mounting(text)
