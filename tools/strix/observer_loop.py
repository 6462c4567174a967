"""The reduced-observer law in a linear loop: poles, margins and step responses of one axis.

The law is lib/Control/ReducedObserver.h's, in double precision; the gains are observer_gains'.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from strix.errors import BadInput

# Beside the hold between commands: 2 ms of the IMU's low-pass, 1 ms until the loop's next pass,
# and half a period, because the rate is the mean over the period before.
FIXED_DELAY_S = 0.003

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Axis:
    """One axis' gains, rounded as in the header, and the model they are for."""

    name: str
    inertia_kg_m2: float
    motor_time_constant_s: float
    l0: float
    l1: float
    l2: float
    l3: float
    observer: float
    limit: float

    @property
    def has_angle(self) -> bool:
        return self.l1 != 0.0


@dataclass(frozen=True)
class LoopReport:
    """One loop as it is sampled."""

    name: str
    rate_hz: int
    poles_rad_s: NDArray[np.complex128]  # s = ln(z)/dt, of loop and observer
    phase_margin_deg: float
    gain_margin_db: float  # the smaller of how much more and how much less gain is stable
    crossover_rad_s: float


def recursion(axis: Axis, dt: float) -> tuple[float, float, float]:
    """b1, b2, b3 of the observer."""
    stiffness = 1.0 + axis.observer * axis.motor_time_constant_s / axis.inertia_kg_m2
    b4 = axis.motor_time_constant_s + dt * stiffness
    return axis.motor_time_constant_s / b4, -axis.observer * dt * stiffness / b4, dt / b4


def plant(inertia: float, tau: float, dt: float) -> tuple[Matrix, Matrix]:
    """[angle, rate, torque] over dt with u held: F and G, exact."""
    M = np.zeros((4, 4))
    M[0, 1], M[1, 2], M[2, 2], M[2, 3] = 1.0, 1.0 / inertia, -1.0 / tau, 1.0 / tau
    E = expm(M * dt)
    return E[:3, :3], E[:3, 3:]


def closed_loop(axis: Axis, dt: float, inertia: float, tau: float) -> Matrix:
    """The sampled loop with a plant that may differ from the model, without delay; states
    [angle or 0, rate, torque, x0, x_v[k-1], x_a[k-1]].
    """
    F, G = plant(inertia, tau, dt)
    b1, b2, b3 = recursion(axis, dt)
    e = np.eye(6)
    x0 = e[3] + dt * (e[0] if axis.has_angle else e[1])
    known = b1 * (e[5] - axis.observer * e[4]) + (b2 + axis.observer) * e[1]
    u = -(axis.l0 * x0 + axis.l1 * e[0] + axis.l2 * e[1] + axis.l3 * known) / (1.0 + axis.l3 * b3)
    T = np.zeros((6, 6))
    T[:3, :3] = F
    T[:3] += G * u
    T[3], T[4], T[5] = x0, e[1], known + b3 * u
    if axis.has_angle:
        return T
    keep = [1, 2, 3, 4, 5]  # an angle that nothing looks at is no part of the loop
    return T[np.ix_(keep, keep)]


def analyse(axis: Axis, rate_hz: int) -> LoopReport:
    """Margins at the plant input. The observer goes by the controller's own u."""
    dt = 1.0 / rate_hz
    w = np.geomspace(1e-2, 0.999 * np.pi * rate_hz, 6_000)
    z = np.exp(1j * w * dt)
    F, G = plant(axis.inertia_kg_m2, axis.motor_time_constant_s, dt)
    x = np.linalg.solve(z[:, None, None] * np.eye(3) - F, np.broadcast_to(G, (len(w), 3, 1)))
    angle, rate = x[:, 0, 0], x[:, 1, 0]
    b1, b2, b3 = recursion(axis, dt)
    memory = 1.0 / (1.0 - b1 / z)
    known = memory * (b2 + axis.observer - axis.observer * b1 / z) * rate
    integral = dt / (1.0 - 1.0 / z) * (angle if axis.has_angle else rate)
    feedback = axis.l0 * integral + axis.l1 * angle + axis.l2 * rate + axis.l3 * known
    delay = np.exp(-1j * w * (FIXED_DELAY_S + 0.5 * dt))
    loop = feedback / (1.0 + axis.l3 * memory * b3) * delay
    phase_deg, gain_db, crossover = _margins(w, loop)
    T = closed_loop(axis, dt, axis.inertia_kg_m2, axis.motor_time_constant_s)
    z_poles = np.linalg.eigvals(T).astype(complex)
    poles = np.log(z_poles[np.abs(z_poles) > 1e-9]) / dt  # x_v[k-1] is a pure delay
    return LoopReport(axis.name, rate_hz, np.sort_complex(poles), phase_deg, gain_db, crossover)


def _margins(w: Matrix, loop: NDArray[np.complex128]) -> tuple[float, float, float]:
    """Smallest phase margin, deg, gain margin, dB, and the highest crossover, rad/s."""
    gain_db = 20.0 * np.log10(np.abs(loop))
    phase_deg = np.degrees(np.unwrap(np.angle(loop)))
    crossings = np.flatnonzero(gain_db[:-1] * gain_db[1:] < 0.0)
    if len(crossings) == 0:
        raise BadInput("observer design: expected a loop gain that crosses one, found none")
    phase = min(abs(phase_deg[i] % 360.0 - 180.0) for i in crossings)
    turns = np.floor((phase_deg + 180.0) / 360.0)
    inversions = np.flatnonzero(turns[:-1] != turns[1:])
    gain = min((abs(gain_db[i]) for i in inversions), default=np.inf)
    return float(phase), float(gain), float(w[crossings[-1]])


def continuous_step(
    axis: Axis, duration_s: float, dt: float = 1e-3
) -> tuple[Matrix, Matrix, Matrix]:
    """Time, output and u after a unit step of the reference, of u = -L x with x_a known."""
    n = 4
    A, b, c = np.zeros((n, n)), np.zeros((n, 1)), 1.0 / axis.inertia_kg_m2
    tau = axis.motor_time_constant_s  # states [x0, angle error, rate (error), torque]
    A[1, 2], A[2, 3], A[3, 3], b[3, 0] = 1.0, c, -1.0 / tau, 1.0 / tau
    A[0, 1 if axis.has_angle else 2] = 1.0
    L = np.array([[axis.l0, axis.l1, axis.l2, axis.l3]])
    E = expm((A - b @ L) * dt)
    start = np.zeros(n)
    start[1 if axis.has_angle else 2] = -1.0
    x = _powers(E, start, round(duration_s / dt))
    return np.arange(0.0, len(x)) * dt, 1.0 + x[:, 1 if axis.has_angle else 2], (-x @ L.T)[:, 0]


def sampled_step(axis: Axis, rate_hz: int, duration_s: float) -> tuple[Matrix, Matrix, Matrix]:
    """The same of the law as it flies: sampled, its torque observed; the rate of the body is what
    the observer sees, its error what is fed back.
    """
    dt, tau = 1.0 / rate_hz, axis.motor_time_constant_s
    F, G = plant(axis.inertia_kg_m2, tau, dt)
    b1, b2, b3 = recursion(axis, dt)
    angle_step, rate_step = (1.0, 0.0) if axis.has_angle else (0.0, 1.0)
    x, x0, rate_before, torque = np.zeros(3), 0.0, 0.0, 0.0
    output, control = [], []
    for _ in range(round(duration_s * rate_hz)):
        angle, rate = x[0] - angle_step, x[1] - rate_step
        x0 += dt * (angle if axis.has_angle else rate)
        known = b1 * (torque - axis.observer * rate_before) + (b2 + axis.observer) * x[1]
        u = -(axis.l0 * x0 + axis.l1 * angle + axis.l2 * rate + axis.l3 * known)
        u /= 1.0 + axis.l3 * b3
        torque, rate_before = known + b3 * u, float(x[1])
        output.append(x[0] if axis.has_angle else x[1])
        control.append(u)
        x = F @ x + G[:, 0] * u
    return np.arange(0.0, len(output)) * dt, np.array(output), np.array(control)


def _powers(E: Matrix, start: Matrix, count: int) -> Matrix:
    rows = [start]
    for _ in range(count - 1):
        rows.append(E @ rows[-1])
    return np.array(rows)
