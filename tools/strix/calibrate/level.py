"""Level trim: the small roll and pitch by which the IMU's mounting is off.

The table's own slope is in every reading. It stays where it is when the aircraft is turned about
the vertical, and the mounting turns with it: positions at two headings tell them apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from strix.calibrate.accel import LEAST_POSITION_S
from strix.calibrate.outcome import Incomplete, numbers, rotation, unit
from strix.calibrate.readings import Imu
from strix.calibrate.standstill import mean_and_sigma, still_stretches
from strix.flightlog import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_TRIM_DEG = 10.0  # more is another mounting, not a trim
LEAST_TURN_DEG = 60.0  # between headings, to tell table and mounting apart


@dataclass(frozen=True)
class LevelResult:
    where: str
    heading_deg: Array  # of each position, from the first, clockwise
    tilt_rad: Array  # (N, 2) of each: roll and pitch of the sensor against gravity
    roll_rad: float  # of the mounting: what is taken off
    pitch_rad: float
    sigma_rad: float
    table_deg: float | None  # slope; None when one heading cannot tell
    calibrated: bool  # the accelerometer was, before

    @property
    def matrix(self) -> Array:
        """Takes the sensor's idea of the body axes to the body's."""
        return rotation(np.array([self.roll_rad, self.pitch_rad, 0.0]))

    def sentences(self) -> list[str]:
        lines = [f"level from {len(self.heading_deg)} still positions"]
        lines += [
            f"  heading {heading:+6.0f} deg: roll {np.degrees(roll):+.3f}, "
            f"pitch {np.degrees(pitch):+.3f} deg"
            for heading, (roll, pitch) in zip(self.heading_deg, self.tilt_rad, strict=True)
        ]
        lines.append(
            f"  mounting: roll {np.degrees(self.roll_rad):+.3f}, pitch "
            f"{np.degrees(self.pitch_rad):+.3f} deg, +- {np.degrees(self.sigma_rad):.3f}"
        )
        if not self.calibrated:
            lines.append(
                "  next: strix calibrate accel --write first, then this again: 0.1 m/s^2 of bias "
                "pass for 0.6 deg of trim"
            )
        if self.table_deg is None:
            lines.append(
                "  next: the table's slope is in it: turn the aircraft by 180 deg on the spot, "
                "leave it for 5 s more, in one log"
            )
        else:
            lines.append(f"  table: {self.table_deg:.3f} deg, taken off")
        return lines

    def to_dict(self) -> dict[str, Any]:
        return {
            "calibration": "level",
            "heading_deg": self.heading_deg.tolist(),
            "tilt_rad": self.tilt_rad.tolist(),
            "roll_rad": self.roll_rad,
            "pitch_rad": self.pitch_rad,
            "sigma_rad": self.sigma_rad,
            "table_deg": self.table_deg,
            "rotation": self.matrix.tolist(),
        }

    def members(self) -> Mapping[str, Array]:
        return {"levelRotation": self.matrix}

    def draw(self, figure: Figure) -> None:
        axis = figure.subplots()
        roll, pitch = np.degrees(self.tilt_rad).T
        axis.plot(roll, pitch, "o", label="positions")
        for heading, x, y in zip(self.heading_deg, roll, pitch, strict=True):
            axis.annotate(f"  {heading:+.0f} deg", (x, y), fontsize="small")
        x, y = np.degrees(self.roll_rad), np.degrees(self.pitch_rad)
        axis.plot([x], [y], "x", markersize=12, label="mounting")
        axis.plot([0.0], [0.0], "+", color="black", markersize=14, label="level")
        axis.set_aspect("equal", adjustable="datalim")
        axis.margins(0.2)
        axis.set_xlabel("roll, deg")
        axis.set_ylabel("pitch, deg")
        axis.set_title("Tilt of the IMU against gravity, by heading", loc="left")
        axis.grid(visible=True, alpha=0.3)
        axis.legend()


def calibrate_level(
    imu: Imu, mounting: Array, accel_bias_m_s2: Array, accel_scale: Array
) -> LevelResult:
    """`mounting` is sensorToBody without any trim; bias and scale those of `calibrate accel`."""
    calibrated = bool(accel_bias_m_s2.any()) or not np.array_equal(accel_scale, np.eye(3))
    stretches = [s for s in still_stretches(imu) if s.duration_s >= LEAST_POSITION_S]
    if not stretches:
        lasted_s = float(imu.time_s[-1] - imu.time_s[0])
        raise Incomplete(
            f"{imu.where}: expected a standstill of 3 s at least, found none in {lasted_s:.1f} s; "
            "put the aircraft level on a firm table, 5 s, turn it by 180 deg, 5 s"
        )
    tilts, sigmas = [], []
    for stretch in stretches:
        part = imu.part(stretch.begin, stretch.end)
        force = (part.accel_m_s2 - accel_bias_m_s2) @ (mounting @ accel_scale).T
        mean, sigma = mean_and_sigma(part.time_s, force, 0.25)
        # The rotation vector that takes the seen direction to up, [0 0 -1]: no part about z.
        seen = unit(mean)
        across = np.cross(seen, [0.0, 0.0, -1.0])
        angle = np.arctan2(np.linalg.norm(across), -seen[2])
        size = max(float(np.linalg.norm(across)), 1e-12)
        tilts.append(across[:2] / size * angle)
        sigmas.append(float(np.linalg.norm(sigma[:2])) / float(np.linalg.norm(mean)))
        if np.degrees(angle) > MOST_TRIM_DEG:
            raise Incomplete(
                f"{imu.where}: expected the aircraft level within {MOST_TRIM_DEG:.0f} deg, found "
                f"{np.degrees(angle):.1f} deg at {stretch.begin_s:.1f} s (body axes see "
                f"{numbers(mean, 2)} m/s^2, level is 0 0 -9.81): not a trim; is --mounting right?"
            )
    tilt = np.array(tilts)
    heading = _headings(imu, [(s.begin, s.end) for s in stretches], mounting)
    return _separate(imu.where, heading, tilt, float(np.max(sigmas)), calibrated)


def _separate(
    where: str, heading_rad: Array, tilt: Array, noise_rad: float, calibrated: bool
) -> LevelResult:
    """tilt_i = mounting + R(heading_i)^T table, in the plane."""
    spread = np.abs((heading_rad[:, None] - heading_rad + np.pi) % (2.0 * np.pi) - np.pi).max()
    degrees = np.degrees(heading_rad)
    if np.degrees(spread) < LEAST_TURN_DEG:
        roll, pitch = tilt.mean(axis=0)
        scatter = float(tilt.std(axis=0).max())
        sigma = max(noise_rad, scatter)
        return LevelResult(where, degrees, tilt, float(roll), float(pitch), sigma, None, calibrated)
    rows, wanted = [], []
    for angle, (x, y) in zip(heading_rad, tilt, strict=True):
        c, s = np.cos(angle), np.sin(angle)
        rows += [[1.0, 0.0, c, s], [0.0, 1.0, -s, c]]
        wanted += [x, y]
    A, b = np.array(rows), np.array(wanted)
    found, *_ = np.linalg.lstsq(A, b, rcond=None)
    freedom = len(b) - 4
    left = float(np.sqrt(((b - A @ found) ** 2).sum() / freedom)) if freedom > 0 else 0.0
    sigma = max(noise_rad, left) * float(np.sqrt(np.linalg.inv(A.T @ A)[0, 0]))
    table = float(np.degrees(np.hypot(found[2], found[3])))
    return LevelResult(
        where, degrees, tilt, float(found[0]), float(found[1]), sigma, table, calibrated
    )


def _headings(imu: Imu, stretches: list[tuple[int, int]], mounting: Array) -> Array:
    """Turn about body z since the first position: the gyro, its bias taken off by the positions
    before and after.
    """
    rate = imu.gyro_rad_s @ mounting.T[:, 2]
    biases = [float(rate[b:e].mean()) for b, e in stretches]
    headings = [0.0]
    for i in range(1, len(stretches)):
        begin, end = stretches[i - 1][1] - 1, stretches[i][0] + 1
        bias = 0.5 * (biases[i - 1] + biases[i])
        turn = np.trapezoid(rate[begin:end] - bias, imu.time_s[begin:end])
        headings.append(headings[-1] + float(turn))
    return np.array(headings)
