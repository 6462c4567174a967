"""Attitude error of an estimate, as the BROAD benchmark defines it (Laidig et al., Data 2021)."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from strix.errors import BadInput
from strix.recording import Array, read_table

ATTITUDE_COLUMNS = ("t_s", "qw", "qx", "qy", "qz")
UNIT_TOLERANCE = 0.01


@dataclass(frozen=True)
class Score:
    """RMS errors in degrees over `rows` reference rows."""

    total_deg: float
    heading_deg: float
    inclination_deg: float
    roll_deg: float
    pitch_deg: float
    rows: int

    def to_dict(self) -> dict[str, float]:
        """By name, as --json prints it."""
        return asdict(self)

    def table(self) -> str:
        """One line a kind of error."""
        kinds = {
            "total": self.total_deg,
            "heading": self.heading_deg,
            "inclination": self.inclination_deg,
            "roll": self.roll_deg,
            "pitch": self.pitch_deg,
        }
        lines = [f"{kind:<11} {value:7.2f} deg RMS" for kind, value in kinds.items()]
        return "\n".join([*lines, f"{'rows':<11} {self.rows:7d}"])


def read_attitude(path: Path) -> Array:
    """t_s, qw, qx, qy, qz of an estimate."""
    table = read_table(path, ATTITUDE_COLUMNS)
    _check_unit(path, table)
    return table


def read_reference(path: Path) -> Array:
    """t_s, qw, qx, qy, qz, scored of a reference; a quaternion is nan where it is unknown."""
    table = read_table(path, (*ATTITUDE_COLUMNS, "scored"), may_be_nan=ATTITUDE_COLUMNS[1:])
    _check_unit(path, table)
    return table


def score(estimate: Array, reference: Array, after_s: float = 0.0) -> Score:
    """Compare at the reference's times, the estimate interpolated.

    Left out are rows of the reference with scored 0 or without a quaternion, outside the
    estimate's time, and in its first `after_s` seconds. No row left is a BadInput.
    """
    if not after_s >= 0.0:
        raise BadInput(f"--after: expected a number of seconds from 0 on, found {after_s}")
    t_s = reference[:, 0]
    used = (reference[:, 5] == 1.0) & np.isfinite(reference[:, 1:5]).all(axis=1)
    used &= (t_s >= estimate[0, 0] + after_s) & (t_s <= estimate[-1, 0])
    if not used.any():
        raise BadInput(
            f"expected a scored row of the reference from {estimate[0, 0] + after_s:.3f} to "
            f"{estimate[-1, 0]:.3f} s, found none"
        )
    q_ref = _unit(reference[used, 1:5])
    q_est = interpolate_attitude(estimate, t_s[used])

    # In the earth frame, so that its vertical component is the error of heading.
    w, x, y, z = multiply(q_est, conjugate(q_ref)).T
    roll, pitch = _roll_pitch(q_est) - _roll_pitch(q_ref)
    return Score(
        total_deg=_rms_deg(2.0 * np.arctan2(np.sqrt(x**2 + y**2 + z**2), np.abs(w))),
        heading_deg=_rms_deg(2.0 * np.arctan2(np.abs(z), np.abs(w))),
        inclination_deg=_rms_deg(2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z))),
        roll_deg=_rms_deg(np.mod(roll + np.pi, 2.0 * np.pi) - np.pi),
        pitch_deg=_rms_deg(pitch),
        rows=int(used.sum()),
    )


def interpolate_attitude(table: Array, t_s: Array) -> Array:
    """Quaternions of a table t_s, qw, qx, qy, qz at times inside it, along the shortest arc."""
    after = np.clip(np.searchsorted(table[:, 0], t_s), 1, max(len(table) - 1, 1))
    if len(table) == 1:
        return np.repeat(_unit(table[:, 1:5]), len(t_s), axis=0)
    t0, t1 = table[after - 1, 0], table[after, 0]
    q0, q1 = _unit(table[after - 1, 1:5]), _unit(table[after, 1:5])
    part = np.divide(t_s - t0, t1 - t0, out=np.zeros_like(t_s), where=t1 > t0)[:, None]
    cosine = np.sum(q0 * q1, axis=1, keepdims=True)
    q1 = np.where(cosine < 0.0, -q1, q1)
    angle = np.arctan2(np.linalg.norm(q1 - q0, axis=1), np.linalg.norm(q1 + q0, axis=1))[:, None]
    angle = 2.0 * np.maximum(angle, 1e-9)
    return _unit(q0 * np.sin((1.0 - part) * angle) + q1 * np.sin(part * angle))


def multiply(p: Array, q: Array) -> Array:
    """Hamilton products p (x) q, row by row."""
    pw, px, py, pz = p.T
    qw, qx, qy, qz = q.T
    return np.column_stack(
        [
            pw * qw - px * qx - py * qy - pz * qz,
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
        ]
    )


def conjugate(q: Array) -> Array:
    """Inverse rotations of unit quaternions."""
    return np.asarray(q * np.array([1.0, -1.0, -1.0, -1.0]))


def _roll_pitch(q: Array) -> Array:
    w, x, y, z = q.T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x**2 + y**2))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    return np.stack([roll, pitch])


def _unit(q: Array) -> Array:
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


def _rms_deg(angle_rad: Array) -> float:
    return float(np.degrees(np.sqrt(np.mean(angle_rad**2))))


def _check_unit(path: Path, table: Array) -> None:
    length = np.linalg.norm(table[:, 1:5], axis=1)
    wrong = np.flatnonzero(np.abs(length - 1.0) > UNIT_TOLERANCE)  # nan is not wrong
    if wrong.size:
        raise BadInput(
            f"{path}: line {wrong[0] + 2}, columns qw to qz: expected a quaternion of length 1, "
            f"found length {length[wrong[0]]:.3g}"
        )
