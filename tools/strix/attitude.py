"""Attitudes as quaternions, [w x y z], body to NED, one a row."""

from __future__ import annotations

import numpy as np

from strix.flightlog import Array
from strix.score import conjugate, multiply


def roll_pitch_yaw(q: Array) -> Array:
    """Angles in rad, columns roll, pitch, yaw: yaw is turned first, then pitch, then roll."""
    w, x, y, z = q.T
    return np.column_stack(
        [
            np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)),
            np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        ]
    )


def rotation_between(q_from: Array, q_to: Array) -> Array:
    """Rotation vectors in rad, body frame, the short way: q_to = q_from (x) exp(vector)."""
    q = multiply(conjugate(q_from), q_to)
    q = np.where(q[:, :1] < 0.0, -q, q)
    sine = np.linalg.norm(q[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[:, :1])
    factor = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 0.0)
    return np.asarray(q[:, 1:] * factor)


def tilt(q: Array) -> Array:
    """Angle in rad from the world's vertical to the body's."""
    return np.asarray(2.0 * np.arcsin(np.minimum(np.hypot(q[:, 1], q[:, 2]), 1.0)))


def wrap(angle_rad: Array) -> Array:
    """The same angle from -pi up to pi."""
    return np.asarray((angle_rad + np.pi) % (2.0 * np.pi) - np.pi)
