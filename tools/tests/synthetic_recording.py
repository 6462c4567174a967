"""A made-up recording for the tests: 3 s of standstill, then smooth flight, with the truth beside
it. Written from the definitions, in double precision; it shares nothing with the filter.
"""

from __future__ import annotations

import gzip
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STILL_S = 3.0
G = 9.81
FIELD_UT = np.array([20.0, 0.0, 45.0])  # magnetic north, east, down
ORIGIN_DEG = (59.65, 17.92)
RADIUS_M = (6_390_702.0, 6_394_136.0)  # of curvature there: meridian, prime vertical (WGS 84)
HEADERS = {
    "imu": "t_s,ax,ay,az,gx,gy,gz",
    "mag": "t_s,mx_uT,my_uT,mz_uT",
    "baro": "t_s,alt_m",
    "gps": "t_s,fix,lat_deg,lon_deg,alt_m,vn,ve,vd",
    "ref_att": "t_s,qw,qx,qy,qz,scored",
}


@dataclass(frozen=True)
class Case:
    """What a recording is made of."""

    duration_s: float = 40.0
    begin_s: float = 0.0
    yaw_deg: float = 70.0
    declination_deg: float = 0.0
    delays_s: dict[str, float] = field(default_factory=dict)
    moving_at_start: bool = False
    noise: float = 1.0  # times the sensors' own
    gyro_bias_rad_s: tuple[float, float, float] = (0.01, -0.02, 0.005)


@dataclass(frozen=True)
class Synthetic:
    """Tables of the sensors and of the truth; `tables` includes ref_att."""

    tables: dict[str, Array]
    position_m: Array  # NED, at the IMU's times
    velocity_m_s: Array


def make(case: Case | None = None) -> Synthetic:
    """Sensor readings at 200, 50, 20 and 5 Hz."""
    case = case or Case()
    random = np.random.default_rng(1)
    t = np.arange(0.0, case.duration_s, 0.005)
    flying = np.where(t < STILL_S, 0.0, t - STILL_S)
    if case.moving_at_start:
        flying = t + 1.0

    q = _attitude(flying, case.yaw_deg)
    speeds, sizes = np.array([0.6, 0.5, 0.4]), np.array([5.0, 3.0, -2.0])
    phase = flying[:, None] * speeds
    position = sizes * (1.0 - np.cos(phase))
    velocity = sizes * speeds * np.sin(phase)
    acceleration = sizes * speeds**2 * np.cos(phase) * (flying[:, None] > 0.0)

    rotation = _matrices(q)
    force = _to_body(rotation, acceleration - [0.0, 0.0, G])
    gyro = np.zeros_like(force)
    gyro[1:] = _rotation_vectors(q[:-1], q[1:]) / 0.005  # over the step that ends at the sample
    d = np.radians(case.declination_deg)
    turn = np.array([[np.cos(d), -np.sin(d), 0.0], [np.sin(d), np.cos(d), 0.0], [0.0, 0.0, 1.0]])
    magnetic = _to_body(rotation, np.broadcast_to(turn @ FIELD_UT, force.shape))

    def noisy(clean: Array, sigma: float) -> Array:
        return np.asarray(clean + case.noise * sigma * random.standard_normal(clean.shape))

    bias = np.array(case.gyro_bias_rad_s)
    imu = np.column_stack([t, noisy(force, 0.03), noisy(gyro + bias, 0.003)])
    mag = np.column_stack([t, noisy(magnetic, 0.3)])[::4]
    baro = np.column_stack([t, 120.0 + noisy(-position[:, 2], 0.2)])[::10]
    horizontal = noisy(position[:, :2], 0.5)
    cosine = np.cos(np.radians(ORIGIN_DEG[0]))
    gps = np.column_stack(
        [
            t,
            np.full_like(t, 3.0),
            ORIGIN_DEG[0] + np.degrees(horizontal[:, 0] / RADIUS_M[0]),
            ORIGIN_DEG[1] + np.degrees(horizontal[:, 1] / (RADIUS_M[1] * cosine)),
            120.0 - position[:, 2],
            noisy(velocity, 0.1),
        ]
    )[::40]
    tables = {"imu": imu, "mag": mag, "baro": baro, "gps": gps}
    tables["ref_att"] = np.column_stack([t, q, np.ones_like(t)])
    for name, table in tables.items():
        table[:, 0] += case.begin_s + case.delays_s.get(name, 0.0)
    return Synthetic(tables, position, velocity)


def write(folder: Path, tables: dict[str, Array]) -> Path:
    """Write the tables as .csv, the IMU's as .csv.gz; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, table in tables.items():
        lines = [HEADERS[name], *(",".join(f"{x:.10g}" for x in row) for row in table)]
        text = "\n".join(lines) + "\n"
        if name == "imu":
            (folder / "imu.csv.gz").write_bytes(gzip.compress(text.encode(), mtime=0))
        else:
            (folder / f"{name}.csv").write_text(text, encoding="utf-8")
    return folder


def _attitude(flying_s: Array, yaw_deg: float) -> Array:
    """Quaternions from yaw about down, pitch, roll."""
    roll = np.radians(12.0) * np.sin(1.1 * flying_s)
    pitch = np.radians(9.0) * np.sin(0.8 * flying_s)
    yaw = np.radians(yaw_deg + 60.0 * np.sin(0.3 * flying_s))
    cr, sr = np.cos(roll / 2), np.sin(roll / 2)
    cp, sp = np.cos(pitch / 2), np.sin(pitch / 2)
    cy, sy = np.cos(yaw / 2), np.sin(yaw / 2)
    return np.column_stack(
        [
            cy * cp * cr + sy * sp * sr,
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
        ]
    )


def _matrices(q: Array) -> Array:
    """Body to NED, one 3x3 matrix a row."""
    w, x, y, z = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _to_body(rotation: Array, ned: Array) -> Array:
    return np.asarray(np.einsum("nji,nj->ni", rotation, ned))


def _rotation_vectors(q0: Array, q1: Array) -> Array:
    """Small rotations from q0 to q1, in the body frame."""
    relative = np.einsum("nji,njk->nik", _matrices(q0), _matrices(q1))
    skew = 0.5 * (relative - np.swapaxes(relative, 1, 2))
    sine = np.column_stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]])
    length = np.linalg.norm(sine, axis=1, keepdims=True)
    return sine * np.where(length > 0.0, np.arcsin(length) / np.maximum(length, 1e-300), 1.0)
