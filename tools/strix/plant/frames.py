"""Frames, and the one place where MuJoCo's are converted to the project's.

MuJoCo's world has z up; here its x is north, so y is west (NWU), and its body is x forward,
y left, z up (FLU). The project uses NED and FRD (DESIGN.md section 2). Both pairs differ by the
same half turn about x, so one function converts vectors, in either frame and either direction.

Quaternions are Hamilton, [w x y z], and rotate body vectors into the world: v_w = q v_b q*.
Plain tuples instead of arrays: for three numbers NumPy's call overhead exceeds the arithmetic.
"""

from __future__ import annotations

import math

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]

ZERO: Vector = (0.0, 0.0, 0.0)
IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def turn_vector(v: Vector) -> Vector:
    """NED <-> NWU (world) and FRD <-> FLU (body): half a turn about x, its own inverse."""
    return (v[0], -v[1], -v[2])


def turn_quaternion(q: Quaternion) -> Quaternion:
    """FRD-to-NED <-> FLU-to-NWU: r q r* with r = [0 1 0 0], its own inverse."""
    return (q[0], q[1], -q[2], -q[3])


def rotate_to_world(q: Quaternion, v: Vector) -> Vector:
    """The product q v q* as v + 2 w (u x v) + 2 u x (u x v), u the vector part of q."""
    w, x, y, z = q
    tx = 2.0 * (y * v[2] - z * v[1])
    ty = 2.0 * (z * v[0] - x * v[2])
    tz = 2.0 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )


def rotate_to_body(q: Quaternion, v: Vector) -> Vector:
    """q* v q, the inverse of rotate_to_world."""
    return rotate_to_world((q[0], -q[1], -q[2], -q[3]), v)


def between(a: Quaternion, b: Quaternion) -> Quaternion:
    """The attitude halfway from a to b, for two attitudes one integration step apart."""
    w, x, y, z = a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]
    scale = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return (w * scale, x * scale, y * scale, z * scale)


def level_at_heading(heading_rad: float) -> Quaternion:
    """Level attitude; heading is positive from north towards east (clockwise from above)."""
    return (math.cos(heading_rad / 2.0), 0.0, 0.0, math.sin(heading_rad / 2.0))
