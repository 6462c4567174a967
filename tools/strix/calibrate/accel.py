"""Accelerometer: bias and scale from still positions on all six faces.

    specific force = A (raw - b),  A symmetric: six numbers, b three; the other three of the twelve
    are how the sensor sits in the body, and stay in the mounting matrix.

At rest |A (raw - b)| = g, however the aircraft lies: exact, but six positions are six equations.
What else they tell is that the faces of a body are square. Nobody puts an aircraft down as exactly
as an accelerometer measures, so each position's direction is believed as far as the six agree with
each other, and the cross-axis terms have the datasheet's tolerance as their prior. More positions,
on edges, add more equations of the first kind: then the directions no longer matter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import least_squares

from strix.calibrate.outcome import (
    GRAVITY_M_S2,
    Incomplete,
    angle_deg,
    numbers,
    rotation,
    sizes,
    unit,
)
from strix.calibrate.readings import Imu
from strix.calibrate.standstill import mean_and_sigma, still_stretches
from strix.flightlog import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Where the body axes point up. The specific force at rest points up too.
FACES = {
    "level": (0.0, 0.0, -1.0),
    "upside down": (0.0, 0.0, 1.0),
    "nose up": (1.0, 0.0, 0.0),
    "nose down": (-1.0, 0.0, 0.0),
    "on its left side": (0.0, 1.0, 0.0),
    "on its right side": (0.0, -1.0, 0.0),
}
FACE_DEG = 25.0  # from the face's direction: what leans more is a position on an edge
LEAST_POSITION_S = 1.0  # what is left of a stretch after its ends are cut off
# Cross-axis sensitivity, 2 %: TDK's datasheets of this family (ICM-20948, table 2).
CROSS_AXIS_SIGMA = 0.02
FIRST_PLACING_RAD = 0.02  # one degree, until the six positions tell
LEAST_PLACING_RAD = 1e-4
ROUNDS = 5
# Beyond these a sensor is broken or the range is another one (ArduPilot's limits).
MOST_SCALE_ERROR = 0.1
MOST_BIAS_M_S2 = 3.5
GOOD_CROSS_SIGMA = 0.002  # 1 g on one axis then shows as 0.02 m/s^2 on another

OFF_DIAGONAL = np.array([[0, 1], [0, 2], [1, 2]])


@dataclass(frozen=True)
class Position:
    """The aircraft at rest."""

    begin_s: float
    duration_s: float
    mean_m_s2: Array
    sigma_m_s2: float  # of the mean's length
    face: str  # of FACES, or empty on an edge


@dataclass(frozen=True)
class AccelResult:
    where: str
    gravity_m_s2: float
    positions: list[Position]
    bias_m_s2: Array
    bias_sigma_m_s2: Array
    scale: Array  # 3x3, symmetric
    scale_sigma: Array  # 3x3
    placing_deg: float  # RMS by which faces are not square, given that the body's are
    before_m_s2: float  # RMS of |raw| - g over the positions
    after_m_s2: float
    spare: int  # equations beyond the unknowns: with few `after` says little

    @property
    def cross_sigma(self) -> float:
        return float(max(self.scale_sigma[i, j] for i, j in OFF_DIAGONAL))

    def sentences(self) -> list[str]:
        edges = sum(not p.face for p in self.positions)
        lines = [
            f"accelerometer from {len(self.positions)} still positions, {edges} of them on edges"
        ]
        lines += [
            f"  {p.begin_s:7.1f} s  {p.duration_s:5.1f} s  {p.face or 'on an edge':18}"
            f"{numbers(p.mean_m_s2, 3)} m/s^2, |raw| - g {self._left(p):+.3f}"
            for p in self.positions
        ]
        lines += [
            f"  bias   {numbers(self.bias_m_s2, 4)} m/s^2, +- {sizes(self.bias_sigma_m_s2, 4)}",
            *(
                f"  scale  {numbers(row)}   +- {sizes(sigma)}"
                for row, sigma in zip(self.scale, self.scale_sigma, strict=True)
            ),
            f"  faces square within {self.placing_deg:.2f} deg",
            f"  |specific force| - g: {self.before_m_s2:.4f} m/s^2 RMS before, "
            f"{self.after_m_s2:.4f} after, {self.spare} positions more than the fit needs",
        ]
        if self.cross_sigma > GOOD_CROSS_SIGMA:
            lines.append(
                f"  next: the cross-axis terms are known to +-{100 * self.cross_sigma:.2f} % "
                "only: log again with six more positions, on edges at about 45 deg (nose up and "
                "left, nose up and right, ...), and they no longer depend on how square it stood"
            )
        return lines

    def _left(self, position: Position) -> float:
        return float(np.linalg.norm(position.mean_m_s2)) - self.gravity_m_s2

    def to_dict(self) -> dict[str, Any]:
        return {
            "calibration": "accel",
            "gravity_m_s2": self.gravity_m_s2,
            "positions": [
                {
                    "begin_s": p.begin_s,
                    "duration_s": p.duration_s,
                    "mean_m_s2": p.mean_m_s2.tolist(),
                    "face": p.face or None,
                }
                for p in self.positions
            ],
            "bias_m_s2": self.bias_m_s2.tolist(),
            "bias_sigma_m_s2": self.bias_sigma_m_s2.tolist(),
            "scale": self.scale.tolist(),
            "scale_sigma": self.scale_sigma.tolist(),
            "placing_deg": self.placing_deg,
            "norm_rms_before_m_s2": self.before_m_s2,
            "norm_rms_after_m_s2": self.after_m_s2,
        }

    def members(self) -> Mapping[str, Array]:
        return {"accelBias": self.bias_m_s2, "accelScale": self.scale}

    def draw(self, figure: Figure) -> None:
        axis = figure.subplots()
        raw = np.array([p.mean_m_s2 for p in self.positions])
        corrected = (raw - self.bias_m_s2) @ self.scale.T
        rows = np.arange(len(raw))
        left = (np.linalg.norm(v, axis=1) - self.gravity_m_s2 for v in (raw, corrected))
        for values, name, shift in zip(left, ("before", "after"), (-0.2, 0.2), strict=True):
            axis.barh(rows + shift, values, height=0.38, label=name)
        axis.set_yticks(rows, [f"{p.face or 'edge'}, {p.begin_s:.0f} s" for p in self.positions])
        axis.invert_yaxis()
        axis.axvline(0.0, color="black", linewidth=0.8)
        axis.set_xlabel("|specific force| - g, m/s^2")
        axis.set_title(
            f"At rest: RMS {self.before_m_s2:.4f} before, {self.after_m_s2:.4f} after",
            loc="left",
        )
        axis.grid(visible=True, axis="x", alpha=0.3)
        axis.legend()


def calibrate_accel(
    imu: Imu, mounting: Array | None = None, gravity_m_s2: float = GRAVITY_M_S2
) -> AccelResult:
    """From the still stretches of a log.

    `mounting` is sensorToBody: it gives the faces their names and says where they are in sensor
    axes.
    """
    mounting = np.eye(3) if mounting is None else mounting
    positions = find_positions(imu, mounting)
    _refuse_missing_faces(imu, positions)
    raw = np.array([p.mean_m_s2 for p in positions])
    scale, bias, covariance, placing = _fit(positions, mounting, gravity_m_s2)
    after = np.linalg.norm((raw - bias) @ scale.T, axis=1) - gravity_m_s2
    before = np.linalg.norm(raw, axis=1) - gravity_m_s2
    sigma = np.sqrt(np.diag(covariance))
    result = AccelResult(
        where=imu.where,
        gravity_m_s2=gravity_m_s2,
        positions=positions,
        bias_m_s2=bias,
        bias_sigma_m_s2=sigma[6:9],
        scale=scale,
        scale_sigma=symmetric(sigma[:6]),
        placing_deg=float(np.degrees(placing)),
        before_m_s2=float(np.sqrt(np.mean(before**2))),
        after_m_s2=float(np.sqrt(np.mean(after**2))),
        spare=max(0, len(positions) - 9),
    )
    _refuse_implausible(result)
    return result


def find_positions(imu: Imu, mounting: Array) -> list[Position]:
    """A row each standstill that is long enough."""
    found = []
    for stretch in still_stretches(imu):
        if stretch.duration_s < LEAST_POSITION_S:
            continue
        part = imu.part(stretch.begin, stretch.end)
        mean, sigma = mean_and_sigma(part.time_s, part.accel_m_s2, 0.25)
        up = mounting @ unit(mean)
        face = next(
            (name for name, way in FACES.items() if angle_deg(up, np.array(way)) < FACE_DEG), ""
        )
        size_sigma = float(np.linalg.norm(sigma * unit(mean)))
        found.append(Position(stretch.begin_s, stretch.duration_s, mean, size_sigma, face))
    return found


def _refuse_missing_faces(imu: Imu, positions: list[Position]) -> None:
    seen = {p.face for p in positions}
    missing = [face for face in FACES if face not in seen]
    if not missing:
        return
    there = ", ".join(face for face in FACES if face in seen) or "none of them"
    edges = sum(not p.face for p in positions)
    raise Incomplete(
        f"{imu.where}: expected all six faces at rest for 3 s each, found {len(positions)} still "
        f"positions: {there}{f', {edges} on edges' if edges else ''}; missing: "
        f"{', '.join(missing)} (body axes as --mounting says)"
    )


def _fit(
    positions: list[Position], mounting: Array, gravity_m_s2: float
) -> tuple[Array, Array, Array, float]:
    """A, b, covariance of (A's six, b, common rotation), and how square the faces are, rad."""
    raw = np.array([p.mean_m_s2 for p in positions])
    # The log is in single precision: nothing is known better than that.
    size_sigma = np.maximum([p.sigma_m_s2 / gravity_m_s2 for p in positions], 1e-7)
    faces = np.flatnonzero([bool(p.face) for p in positions])
    ways = np.array([mounting.T @ np.array(FACES[positions[i].face]) for i in faces])

    def tangential(x: Array) -> Array:
        """Where the faces are seen minus where they are, rad, across their directions."""
        seen = unit((raw[faces] - x[6:9]) @ symmetric(x[:6]).T)
        return np.asarray(np.cross(seen, ways @ rotation(x[9:]).T))

    def residuals(x: Array, placing: float) -> Array:
        lengths = np.linalg.norm((raw - x[6:9]) @ symmetric(x[:6]).T, axis=1) / gravity_m_s2
        return np.concatenate(
            [
                (lengths - 1.0) / size_sigma,
                tangential(x).ravel() / placing,
                x[3:6] / CROSS_AXIS_SIGMA,
            ]
        )

    x = np.concatenate([np.ones(3), np.zeros(9)])
    placing = FIRST_PLACING_RAD
    for _ in range(ROUNDS):
        found = least_squares(residuals, x, args=(placing,), x_scale="jac", xtol=1e-14, ftol=1e-14)
        x = found.x
        # Two components a face; six unknowns (cross-axis and rotation) have no other source where
        # there are six positions.
        left = tangential(x)
        freedom = 2 * len(faces) - 6
        placing = max(float(np.sqrt((left**2).sum() / freedom)), LEAST_PLACING_RAD)
    J = found.jac
    covariance = np.linalg.inv(J.T @ J)
    # Positions to spare tell whether lengths are as good as their noise (nonlinearity).
    spare = len(positions) - 9
    if spare > 0:
        lengths = residuals(x, placing)[: len(positions)]
        covariance = covariance * max(1.0, float((lengths**2).sum()) / spare)
    return symmetric(x[:6]), x[6:9], covariance, placing


def symmetric(six: Array) -> Array:
    """Diagonal, then xy, xz, yz."""
    matrix = np.diag(six[:3])
    for (i, j), value in zip(OFF_DIAGONAL, six[3:], strict=True):
        matrix[i, j] = matrix[j, i] = value
    return matrix


def _refuse_implausible(result: AccelResult) -> None:
    scale_error = float(np.abs(np.diag(result.scale) - 1.0).max())
    bias = float(np.abs(result.bias_m_s2).max())
    if scale_error > MOST_SCALE_ERROR or bias > MOST_BIAS_M_S2:
        raise Incomplete(
            f"{result.where}: expected a scale within {100 * MOST_SCALE_ERROR:.0f} % and a bias "
            f"below {MOST_BIAS_M_S2} m/s^2, found {100 * scale_error:.1f} % and {bias:.2f} m/s^2: "
            "a broken sensor, or a range other than the driver's"
        )
