"""The flight filter on recordings: made-up ones with known truth, and real ones."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import synthetic_recording as synthetic
from typer.testing import CliRunner

from strix.cli import app
from strix.errors import BadInput
from strix.estimate import EST_COLUMNS, Estimate, estimate, micros, parse_delays, write_estimate
from strix.recording import Array, read_recording
from strix.score import Score, read_attitude, read_reference, score

DATA = Path(os.environ.get("STRIX_DATA", Path(__file__).parents[3] / "shared" / "data"))
# The autopilot of quad123 and quad_optflow stamped readings when it logged them.
DELAYS = {"gps": 0.22, "baro": 0.35, "mag": 0.03}
MELBOURNE_DEG = 11.7  # declination

CASE = synthetic.Case()


def run(folder: Path, case: synthetic.Case, sensors: tuple[str, ...] = ()) -> Estimate:
    """Write the case (some sensors only), read it and estimate with what is known of it."""
    tables = synthetic.make(case).tables
    kept = {name: table for name, table in tables.items() if not sensors or name in sensors}
    recording = read_recording(synthetic.write(folder, kept))
    return estimate(recording, np.radians(case.declination_deg), case.delays_s)


def scored(result: Estimate, case: synthetic.Case, after_s: float = 0.0) -> Score:
    return score(result.table, synthetic.make(case).tables["ref_att"], after_s)


@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, 180.0, -135.0])
def test_a_flight_is_recovered_at_every_heading(tmp_path: Path, yaw_deg: float) -> None:
    case = replace(CASE, yaw_deg=yaw_deg)
    truth = synthetic.make(case)
    result = run(tmp_path, case)
    assert result.start.note == ""
    np.testing.assert_allclose(result.start.gyro_bias_rad_s, case.gyro_bias_rad_s, atol=1e-3)
    found = scored(result, case)
    # Accelerations up to 1.8 m/s^2 pass for gravity now and then.
    assert found.inclination_deg < 1.0
    assert found.heading_deg < 2.0
    assert np.sqrt(np.mean((result.table[:, 5:8] - truth.position_m) ** 2)) < 0.5
    assert np.sqrt(np.mean((result.table[:, 8:11] - truth.velocity_m_s) ** 2)) < 0.2


def test_declination_turns_the_heading_to_true_north(tmp_path: Path) -> None:
    case = replace(CASE, declination_deg=15.0)
    assert scored(run(tmp_path, case), case).heading_deg < 2.0
    recording = read_recording(tmp_path)
    # The heading of the start shows the declination that was left out.
    wrong = estimate(recording, 0.0)
    right = estimate(recording, np.radians(15.0))
    truth = synthetic.make(case).tables["ref_att"]
    assert score(wrong.table[:400], truth).heading_deg == pytest.approx(15.0, abs=1.0)
    assert score(right.table[:400], truth).heading_deg < 1.0


def test_a_known_delay_costs_little_and_an_unknown_one_much(tmp_path: Path) -> None:
    late = replace(CASE, delays_s={"mag": 0.03, "baro": 0.35, "gps": 0.22})
    known = run(tmp_path / "late", late)
    prompt = run(tmp_path / "prompt", CASE)
    unknown = estimate(read_recording(tmp_path / "late"))
    truth = synthetic.make(late).position_m
    known_m, prompt_m, unknown_m = (
        np.sqrt(np.mean((result.table[:, 5:8] - truth) ** 2)) for result in (known, prompt, unknown)
    )
    # Up to 3 m/s and 0.22 s: an unknown delay is an error of up to 0.7 m.
    assert known_m < 1.2 * prompt_m
    assert known_m < 0.8 * unknown_m


def test_every_sensor_but_the_imu_may_be_missing(tmp_path: Path) -> None:
    with_mag = run(tmp_path / "mag", CASE, ("imu", "mag"))
    # Nothing knows the accelerations, of up to 1.8 m/s^2: taken for gravity they are 10 deg.
    assert scored(with_mag, CASE).total_deg < 4.0
    alone = run(tmp_path / "imu", CASE, ("imu",))
    assert np.isfinite(alone.table).all()
    assert scored(alone, CASE).inclination_deg < 4.0
    assert abs(alone.table[0, 4]) < 1e-3  # no field, no heading: it starts at 0


def test_the_loop_clock_may_wrap_within_a_recording(tmp_path: Path) -> None:
    begin = 4294.967296 - 20.0025
    wrapped = run(tmp_path / "wrapped", replace(CASE, begin_s=begin))
    plain = run(tmp_path / "plain", CASE)
    assert min(micros(wrapped.table[:, 0])) < 5000
    np.testing.assert_allclose(wrapped.table[:, 0] - begin, plain.table[:, 0], atol=1e-6)
    np.testing.assert_allclose(wrapped.table[:, 1:], plain.table[:, 1:], atol=1e-3)


def test_a_start_in_motion_is_told(tmp_path: Path) -> None:
    case = replace(CASE, moving_at_start=True, gyro_bias_rad_s=(0.001, -0.001, 0.0))
    result = run(tmp_path, case)
    assert result.start.note.startswith("not at rest at the start")
    assert result.table[0, 0] == result.start.begin_s
    found = scored(result, case, after_s=20.0)
    # The field's dip was measured with a tilted level, and stays the reference.
    assert found.inclination_deg < 6.0
    assert found.heading_deg < 4.0


@pytest.mark.parametrize("rows", [1, 2, 30])
def test_a_recording_shorter_than_the_still_window_is_estimated(tmp_path: Path, rows: int) -> None:
    tables = {name: table[:rows] for name, table in synthetic.make(CASE).tables.items()}
    result = estimate(read_recording(synthetic.write(tmp_path, tables)))
    assert len(result.table) == rows
    assert np.isfinite(result.table).all()


def test_the_clock_counts_microseconds_in_32_bits() -> None:
    t_s = np.array([0.0, 1e-6, 4294.967295, 4294.967296, 1.7e9, -1e-6])
    expected = [0, 1, 2**32 - 1, 0, 1_700_000_000_000_000 % 2**32, 2**32 - 1]
    assert micros(t_s) == expected


def test_delays_are_read() -> None:
    assert parse_delays("") == {}
    assert parse_delays("gps=0.22, baro=0.35,mag=.03") == DELAYS
    for bad in ("gsp=0.2", "imu=0.1", "gps", "gps=", "gps=x", "gps=nan", "gps=-1", "mag=99", "=1"):
        with pytest.raises(BadInput, match=r"^--delay: expected .*found"):
            parse_delays(bad)


def test_a_declination_that_is_no_number_is_refused(tmp_path: Path) -> None:
    recording = read_recording(synthetic.write(tmp_path, synthetic.make(CASE).tables))
    with pytest.raises(BadInput, match="--declination"):
        estimate(recording, float("nan"))


def test_the_estimate_is_written_with_its_columns(tmp_path: Path) -> None:
    result = run(tmp_path / "flight", replace(CASE, duration_s=4.0))
    path = tmp_path / "new" / "est.csv"
    write_estimate(path, result)
    assert path.read_text().split("\n")[0] == "t_s,qw,qx,qy,qz,pn,pe,pd,vn,ve,vd"
    np.testing.assert_allclose(read_attitude(path), result.table[:, :5], atol=1e-6)
    written: Array = np.loadtxt(path, delimiter=",", skiprows=1)
    assert written.shape == (800, len(EST_COLUMNS))


def test_an_output_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    result = run(tmp_path / "flight", replace(CASE, duration_s=3.0))
    (tmp_path / "file").touch()
    for path in (tmp_path / "file" / "est.csv", tmp_path / "flight"):
        with pytest.raises(BadInput, match="can be written"):
            write_estimate(path, result)


def test_the_commands_estimate_and_score(tmp_path: Path) -> None:
    case = replace(CASE, duration_s=10.0)
    folder = synthetic.write(tmp_path / "flight", synthetic.make(case).tables)
    out = tmp_path / "est.csv"
    done = CliRunner().invoke(app, ["estimate", str(folder), "--out", str(out)])
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(app, ["score", str(out), str(folder / "ref_att.csv")])
    assert done.exit_code == 0, done.output
    for word in ("total", "heading", "inclination"):
        assert word in done.output


def test_bad_input_to_a_command_is_one_line_and_status_2(tmp_path: Path) -> None:
    folder = synthetic.write(tmp_path / "flight", synthetic.make(CASE).tables)
    (folder / "mag.csv").write_text("t_s,mx_uT,my_uT,mz_uT\n0,1,2,3\n0.1,1,nan,3\n")
    done = CliRunner().invoke(app, ["estimate", str(folder), "--out", str(tmp_path / "e.csv")])
    assert done.exit_code == 2
    assert done.stderr.count("\n") == 1
    assert f"{folder / 'mag.csv'}: line 3, column my_uT: " in done.stderr
    assert not (tmp_path / "e.csv").exists()


def score_of_real(name: str, after_s: float = 0.0) -> Score:
    folder = DATA / name
    if not folder.is_dir():
        pytest.skip(f"no recordings in {DATA} (set STRIX_DATA)")
    flight = name.startswith("quad")
    declination = np.radians(MELBOURNE_DEG) if flight else 0.0
    result = estimate(read_recording(folder), declination, DELAYS if flight else {})
    return score(result.table, read_reference(folder / "ref_att.csv.gz"), after_s)


# What the first-flight issue asks.
@pytest.mark.parametrize("name", ["quad123", "quad_optflow"])
def test_real_flights_agree_with_their_autopilot(name: str) -> None:
    found = score_of_real(name, after_s=30.0)
    assert found.roll_deg < 2.0
    assert found.pitch_deg < 2.0
    assert found.heading_deg < 5.0


def test_a_slow_broad_trial_agrees_with_optical_tracking() -> None:
    found = score_of_real("broad_02")
    assert found.inclination_deg < 2.5
    assert found.total_deg < 6.0


# Not asked for yet: bounds that a worse tuning would break. Trials 15 and 21 are the fastest, with
# rates of 8 rad/s and hardly a sample that tilt can use.
@pytest.mark.parametrize(
    ("name", "inclination_deg", "total_deg"),
    [
        ("px4_hover", 2.0, 15.0),
        ("broad_04", 3.0, 4.0),
        ("broad_07", 3.0, 6.0),
        ("broad_09", 2.0, 4.0),
        ("broad_11", 1.5, 2.0),
        ("broad_15", 6.0, 16.0),
        ("broad_21", 8.0, 25.0),
        ("broad_24", 1.5, 2.0),
        ("broad_29", 4.0, 8.0),
        ("broad_34", 4.0, 8.0),
    ],
)
def test_other_recordings_stay_within_bounds(
    name: str, inclination_deg: float, total_deg: float
) -> None:
    found = score_of_real(name)
    assert found.inclination_deg < inclination_deg
    assert found.total_deg < total_deg
