"""Attitude errors as the BROAD benchmark defines them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from strix.errors import BadInput
from strix.recording import Array
from strix.score import interpolate_attitude, multiply, read_attitude, read_reference, score

T = np.arange(0.0, 10.0, 0.1)


def turn(axis: int, deg: float) -> Array:
    q = np.zeros((1, 4))
    q[0, 0] = np.cos(np.radians(deg) / 2)
    q[0, 1 + axis] = np.sin(np.radians(deg) / 2)
    return q


def table(q: Array) -> Array:
    return np.column_stack([T, np.broadcast_to(q, (len(T), 4))])


def reference(q: Array) -> Array:
    return np.column_stack([table(q), np.ones_like(T)])


@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, 180.0, -135.0])
def test_a_turn_about_the_vertical_is_all_heading(yaw_deg: float) -> None:
    truth = multiply(turn(2, yaw_deg), multiply(turn(1, 20.0), turn(0, -30.0)))
    found = score(table(multiply(turn(2, 10.0), truth)), reference(truth))
    assert found.heading_deg == pytest.approx(10.0)
    assert found.total_deg == pytest.approx(10.0)
    assert found.inclination_deg == pytest.approx(0.0, abs=1e-6)
    assert found.roll_deg == pytest.approx(0.0, abs=1e-6)
    assert found.pitch_deg == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, 180.0, -135.0])
def test_a_turn_about_the_body_x_axis_is_roll_and_inclination(yaw_deg: float) -> None:
    truth = turn(2, yaw_deg)
    found = score(table(multiply(truth, turn(0, 5.0))), reference(truth))
    assert found.inclination_deg == pytest.approx(5.0)
    assert found.roll_deg == pytest.approx(5.0)
    assert found.total_deg == pytest.approx(5.0)
    assert found.heading_deg == pytest.approx(0.0, abs=1e-6)


def test_heading_and_inclination_are_the_parts_of_the_earth_frame_error() -> None:
    error = multiply(turn(2, 40.0), turn(0, 25.0))
    w, _, _, z = error[0]
    found = score(table(error), reference(turn(0, 0.0)))
    assert found.total_deg == pytest.approx(np.degrees(2 * np.arccos(abs(w))))
    assert found.heading_deg == pytest.approx(np.degrees(2 * np.arctan(abs(z / w))))
    assert found.inclination_deg == pytest.approx(np.degrees(2 * np.arccos(np.hypot(w, z))))
    assert found.inclination_deg == pytest.approx(25.0)


def test_the_rms_is_over_all_rows_and_the_sign_of_a_quaternion_does_not_matter() -> None:
    estimate = table(turn(2, 3.0))
    estimate[:50, 1:] = -turn(2, 4.0)
    found = score(estimate, reference(turn(2, 0.0)))
    assert found.heading_deg == pytest.approx(np.sqrt((9.0 + 16.0) / 2))
    assert found.rows == 100


def test_rows_without_a_reference_do_not_count() -> None:
    truth = reference(turn(2, 0.0))
    truth[:30, 1:5] = turn(2, 90.0)
    truth[:30, 5] = 0.0
    truth[30:40, 1:5] = np.nan
    assert score(table(turn(2, 1.0)), truth).rows == 60
    assert score(table(turn(2, 1.0)), truth, after_s=5.0).rows == 50
    assert score(table(turn(2, 1.0))[:80], truth).rows == 40
    assert score(table(turn(2, 1.0)), truth).heading_deg == pytest.approx(1.0)


def test_the_estimate_is_interpolated_along_the_arc() -> None:
    estimate = np.column_stack([[0.0, 1.0], np.vstack([turn(2, 10.0), -turn(2, 50.0)])])
    found = interpolate_attitude(estimate, np.array([0.0, 0.25, 0.5, 1.0]))
    expected = np.vstack([turn(2, deg) for deg in (10.0, 20.0, 30.0, 50.0)])
    np.testing.assert_allclose(found * np.sign(found[:, :1]), expected, atol=1e-12)


def test_a_single_row_and_equal_times_can_be_scored() -> None:
    assert score(table(turn(2, 1.0))[:1], reference(turn(2, 0.0))).rows == 1
    twice = np.repeat(table(turn(2, 1.0)), 2, axis=0)
    assert score(twice, reference(turn(2, 0.0))).heading_deg == pytest.approx(1.0)


def test_nothing_to_compare_is_refused() -> None:
    with pytest.raises(BadInput, match="found none"):
        score(table(turn(2, 1.0)), reference(turn(2, 0.0)), after_s=100.0)
    for bad in (-1.0, np.nan):
        with pytest.raises(BadInput, match="--after"):
            score(table(turn(2, 1.0)), reference(turn(2, 0.0)), after_s=bad)


def test_files_are_read_and_their_quaternions_checked(tmp_path: Path) -> None:
    path = tmp_path / "ref_att.csv"
    path.write_text("t_s,qw,qx,qy,qz,scored\n0,nan,nan,nan,nan,0\n1,1,0,0,0,1\n")
    assert np.isnan(read_reference(path)[0, 1:5]).all()
    with pytest.raises(BadInput, match="line 2, column qw: expected a finite number"):
        read_attitude(path)
    path.write_text("t_s,qw,qx,qy,qz,scored\n0,1,0,0,0,1\n1,0,0,0,0,1\n")
    with pytest.raises(BadInput, match=r"line 3.*length 1, found length 0"):
        read_reference(path)
