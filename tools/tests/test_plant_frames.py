"""Frames: each conversion undoes itself, and agrees with the matrices it stands for."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from strix.plant.frames import (
    Quaternion,
    Vector,
    between,
    level_at_heading,
    rotate_to_body,
    rotate_to_world,
    turn_quaternion,
    turn_vector,
)

component = st.floats(-100.0, 100.0)
vectors = st.tuples(component, component, component)
HALF_TURN_ABOUT_X = np.diag([1.0, -1.0, -1.0])
# Rotating a vector of up to 170 costs some ten roundings of 1e-16 each.
ROUNDING = 1e-12


@st.composite
def quaternions(draw: st.DrawFn) -> Quaternion:
    parts = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4))
    norm = math.sqrt(sum(part * part for part in parts))
    assume(norm > 0.1)
    w, x, y, z = (part / norm for part in parts)
    return (w, x, y, z)


def matrix(q: Quaternion) -> np.ndarray:
    """SciPy's, which stores the scalar last."""
    result: np.ndarray = Rotation.from_quat([q[1], q[2], q[3], q[0]]).as_matrix()
    return result


@given(vectors, quaternions())
def test_the_half_turn_undoes_itself(v: Vector, q: Quaternion) -> None:
    assert turn_vector(turn_vector(v)) == v
    assert turn_quaternion(turn_quaternion(q)) == q


@given(quaternions())
def test_the_quaternion_turns_as_both_its_frames_do(q: Quaternion) -> None:
    expected = HALF_TURN_ABOUT_X @ matrix(q) @ HALF_TURN_ABOUT_X
    np.testing.assert_allclose(matrix(turn_quaternion(q)), expected, atol=ROUNDING)


@given(vectors, quaternions())
def test_rotation_agrees_with_scipy_and_its_inverse_undoes_it(v: Vector, q: Quaternion) -> None:
    world = rotate_to_world(q, v)
    np.testing.assert_allclose(world, matrix(q) @ np.array(v), atol=ROUNDING)
    np.testing.assert_allclose(rotate_to_body(q, world), v, atol=ROUNDING)


def test_east_is_mujocos_negative_y_and_up_its_positive_z() -> None:
    assert turn_vector((1.0, 2.0, -3.0)) == (1.0, -2.0, 3.0)


def test_heading_90_degrees_points_the_nose_east() -> None:
    nose = rotate_to_world(level_at_heading(math.radians(90.0)), (1.0, 0.0, 0.0))
    assert nose == pytest.approx((0.0, 1.0, 0.0), abs=ROUNDING)


def test_between_two_headings_is_their_middle() -> None:
    middle = between(level_at_heading(1.0), level_at_heading(1.2))
    assert middle == pytest.approx(level_at_heading(1.1), abs=ROUNDING)
