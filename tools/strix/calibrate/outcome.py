"""What every calibration gives back, and what it says when a log does not carry one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from strix.flightlog import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GRAVITY_M_S2 = 9.80665
AXES = "xyz"


class Incomplete(Exception):  # noqa: N818 - nothing failed: the bench work is not finished
    """The log is sound and says too little. The message tells what to do; the status is 1."""


class Result(Protocol):
    """One calibration."""

    def sentences(self) -> Sequence[str]:
        """The result and its uncertainty, for a person, and what to do next."""

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""

    def members(self) -> Mapping[str, Array]:
        """Members of include/Calibration.h; none where the values belong elsewhere."""

    def draw(self, figure: Figure) -> None:
        """The figure."""


def numbers(values: Array, digits: int = 5) -> str:
    """As a person reads a vector."""
    return " ".join(f"{value:+.{digits}f}" for value in np.ravel(values))


def sizes(values: Array, digits: int = 5) -> str:
    """Of sigmas: no sign."""
    return " ".join(f"{value:.{digits}f}" for value in np.ravel(values))


def unit(vectors: Array) -> Array:
    """Each row at length one."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def angle_deg(a: Array, b: Array) -> float:
    """Between two vectors; exact for small angles, where an arc cosine is not."""
    a, b = unit(a), unit(b)
    return float(np.degrees(2.0 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b))))


def rotation(vector: Array) -> Array:
    """Rotation vector, rad, to matrix (Rodrigues)."""
    size = float(np.linalg.norm(vector))
    x, y, z = vector
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # np.sinc(x) is sin(pi x) / (pi x)
    first, second = np.sinc(size / np.pi), 0.5 * np.sinc(size / (2.0 * np.pi)) ** 2
    return np.asarray(np.eye(3) + first * K + second * (K @ K))
