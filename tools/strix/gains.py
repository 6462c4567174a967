"""The controller's gains, designed from the numbers in include/vehicles/.

A linear-quadratic regulator at hover and yaw 0, x = [position, velocity, alpha, body rate] in the
heading frame (forward, right, down) and body axes, u = [thrust, tau_x, tau_y, tau_z]. The design
knows neither the motor lag nor the delay of the loop; what they leave of the margins is computed
here with both, and a design that keeps too little is refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are
from scipy.signal import cont2discrete

from strix.errors import BadInput

GRAVITY_M_S2 = 9.80665
RATE_HZ = 500
PERIOD_S = 1.0 / RATE_HZ
DELAY_SAMPLES = 1.5  # one until the ESC has the pulse, half of one for the hold between pulses
LEAST_PHASE_MARGIN_DEG = 45.0
LEAST_GAIN_MARGIN_DB = 6.0
GAINS_FOLDER = Path(__file__).resolve().parents[2] / "include" / "gains"

Numbers = Mapping[str, Any]  # of one vehicle, as _core.vehicle() gives them
Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """One input and the chain of integrators it drives. At hover the four do not touch."""

    name: str
    control: int  # row of u
    states: tuple[int, ...]  # of x; the first is the output


CHANNELS = (
    Channel("forward", 2, (0, 3, 7, 10)),
    Channel("right", 1, (1, 4, 6, 9)),
    Channel("down", 0, (2, 5)),
    Channel("yaw", 3, (8, 11)),
)


@dataclass(frozen=True)
class Design:
    """x' = A x + B u and the gain of u = u_nom - K e, rounded as it stands in the header."""

    name: str
    A: Matrix
    B: Matrix
    K: Matrix
    motor_time_constant_s: float


@dataclass(frozen=True)
class ChannelReport:
    """How one channel behaves with motor lag and delay, which the design model leaves out."""

    name: str
    poles_rad_s: NDArray[np.complex128]  # of the design model: s = ln(z) / period
    phase_margin_deg: float
    gain_margin_db: float  # the smaller of how much more and how much less gain is stable
    crossover_rad_s: float  # the highest
    bandwidth_rad_s: float  # reference to output, -3 dB
    settling_s: float  # of a unit step, to 2 %
    overshoot: float  # of a unit step
    largest_control: float  # of a unit step, N or N m


def hover_model(numbers: Numbers) -> tuple[Matrix, Matrix]:
    """A and B at hover, yaw 0. Nose up (alpha_y > 0) drives it backwards, right side down
    (alpha_x > 0) to the right; more thrust lifts it, which is -down.
    """
    jx, jy, jz = numbers["inertia"]
    A = np.zeros((12, 12))
    A[0:3, 3:6] = np.eye(3)
    A[3, 7] = -GRAVITY_M_S2
    A[4, 6] = GRAVITY_M_S2
    A[6:9, 9:12] = np.eye(3)
    B = np.zeros((12, 4))
    B[5, 0] = -1.0 / numbers["mass"]
    B[9, 1], B[10, 2], B[11, 3] = 1.0 / jx, 1.0 / jy, 1.0 / jz
    return A, B


def bryson_weights(numbers: Numbers) -> tuple[Matrix, Matrix]:
    """Q and R: one over the square of the largest acceptable value (Bryson's rule)."""
    w = numbers["bryson"]
    ph, pv = w["position_horizontal"], w["position_vertical"]
    vh, vv = w["velocity_horizontal"], w["velocity_vertical"]
    tilt, rate = w["tilt"], w["rate"]
    errors = [ph, ph, pv, vh, vh, vv, tilt, tilt, w["yaw"], rate, rate, w["yaw_rate"]]
    controls = [w["thrust"], w["torque"], w["torque"], w["yaw_torque"]]
    return np.diag(1.0 / np.square(errors)), np.diag(1.0 / np.square(controls))


def design_gains(numbers: Numbers) -> Design:
    """Discrete LQR at the control rate: the model held over one period, Riccati, feedback gain."""
    A, B = hover_model(numbers)
    Q, R = bryson_weights(numbers)
    Ad, Bd = discretise(A, B)
    P = solve_discrete_are(Ad, Bd, Q, R)
    K = np.linalg.solve(R + Bd.T @ P @ Bd, Bd.T @ P @ Ad)
    # Entries between channels are zero but for rounding, which differs between machines.
    own = np.zeros_like(K)
    for channel in CHANNELS:
        index = np.ix_([channel.control], channel.states)
        own[index] = K[index]
    rounded = np.array([[float(gain_text(k)) for k in row] for row in own])
    return Design(numbers["name"], A, B, rounded, numbers["motor_time_constant"])


def analyse(design: Design) -> list[ChannelReport]:
    return [_analyse_channel(design, channel) for channel in CHANNELS]


def refuse_thin_margins(design: Design, reports: Sequence[ChannelReport]) -> None:
    """Raise BadInput unless every channel keeps 45 deg and 6 dB with motor lag and delay."""
    for r in reports:
        if r.phase_margin_deg < LEAST_PHASE_MARGIN_DEG or r.gain_margin_db < LEAST_GAIN_MARGIN_DB:
            raise BadInput(
                f"include/vehicles/{design.name}.h, bryson: expected weights that leave "
                f"{LEAST_PHASE_MARGIN_DEG:.0f} deg and {LEAST_GAIN_MARGIN_DB:.0f} dB, found "
                f"{r.phase_margin_deg:.1f} deg and {r.gain_margin_db:.1f} dB in channel '{r.name}'"
            )


def discretise(A: Matrix, B: Matrix) -> tuple[Matrix, Matrix]:
    """Zero-order hold over one control period."""
    n, m = B.shape
    Ad, Bd, *_ = cont2discrete((A, B, np.eye(n), np.zeros((n, m))), PERIOD_S, method="zoh")
    return Ad, Bd


def sampled_loop(design: Design, channel: Channel) -> tuple[Matrix, Matrix]:
    """One channel as it runs: z[k+1] = F z[k] + G r[k], z = [states, lagged control, control on its
    way to the ESC], r the reference of the output.
    """
    n = len(channel.states)
    A = np.zeros((n + 1, n + 1))
    A[:n, :n] = design.A[np.ix_(channel.states, channel.states)]
    A[:n, n] = design.B[list(channel.states), channel.control]
    A[n, n] = -1.0 / design.motor_time_constant_s
    B = np.zeros((n + 1, 1))
    B[n, 0] = 1.0 / design.motor_time_constant_s
    Ad, Bd = discretise(A, B)
    K = design.K[channel.control, list(channel.states)]
    F = np.zeros((n + 2, n + 2))
    F[: n + 1, : n + 1] = Ad
    F[: n + 1, n + 1] = Bd[:, 0]
    F[n + 1, :n] = -K
    G = np.zeros((n + 2, 1))
    G[n + 1, 0] = K[0]
    return F, G


def step_response(
    design: Design, channel: Channel, duration_s: float = 20.0
) -> tuple[Matrix, Matrix]:
    """Output and control, sampled at the control rate, after a unit step of the reference."""
    F, G = sampled_loop(design, channel)
    n = len(F)
    M = np.block([[F, G], [np.zeros((1, n)), np.ones((1, 1))]])  # the reference, 1, as a state
    samples = np.eye(n + 1)[:, -1:]
    while samples.shape[1] < duration_s * RATE_HZ:  # M holds as many steps as there are samples
        samples = np.hstack([samples, M @ samples])
        M = M @ M
    samples = samples[:, : round(duration_s * RATE_HZ)]
    return samples[0], samples[n - 1]


def _analyse_channel(design: Design, channel: Channel) -> ChannelReport:
    states = list(channel.states)
    A = design.A[np.ix_(states, states)]
    b = design.B[states, channel.control]
    K = design.K[channel.control, states]

    Ad, Bd = discretise(A, b[:, None])
    poles = np.log(np.linalg.eigvals(Ad - Bd @ K[None, :]).astype(complex)) / PERIOD_S

    w = np.geomspace(1e-2, np.pi * RATE_HZ, 4_000)
    s = 1j * w
    lag = np.exp(-s * DELAY_SAMPLES * PERIOD_S) / (design.motor_time_constant_s * s + 1.0)
    x = np.linalg.solve(s[:, None, None] * np.eye(len(states)) - A, b[:, None])[:, :, 0]
    loop = (x @ K) * lag
    phase_deg, gain_db, crossover = _margins(w, loop)

    follow_db = 20.0 * np.log10(np.abs(x[:, 0] * K[0] * lag / (1.0 + loop)))
    output, control = step_response(design, channel)
    outside = np.flatnonzero(np.abs(output - 1.0) > 0.02)
    return ChannelReport(
        name=channel.name,
        poles_rad_s=np.sort_complex(poles),
        phase_margin_deg=phase_deg,
        gain_margin_db=gain_db,
        crossover_rad_s=crossover,
        bandwidth_rad_s=float(w[np.argmax(follow_db < -3.0)]),
        settling_s=float((outside[-1] + 1) * PERIOD_S),
        overshoot=max(0.0, float(output.max() - 1.0)),
        largest_control=float(np.abs(control).max()),
    )


def _margins(w: Matrix, loop: NDArray[np.complex128]) -> tuple[float, float, float]:
    """Smallest phase margin in deg and gain margin in dB over all crossings, and the highest
    crossover. A chain of integrators is conditionally stable: less gain can also upset it.
    """
    log_w = np.log(w)
    gain_db = 20.0 * np.log10(np.abs(loop))
    phase_deg = np.degrees(np.unwrap(np.angle(loop)))

    def at_zero(y: Matrix, *others: Matrix) -> list[list[float]]:
        found = []
        for i in np.flatnonzero(y[:-1] * y[1:] < 0.0):
            t = y[i] / (y[i] - y[i + 1])
            found.append([float(o[i] + t * (o[i + 1] - o[i])) for o in others])
        return found

    crossovers = at_zero(gain_db, phase_deg, log_w)
    phase_margin = min(abs(phase % 360.0 - 180.0) for phase, _ in crossovers)
    turns = range(int(phase_deg.min() // 360.0) - 1, int(phase_deg.max() // 360.0) + 2)
    inversions = [g for n in turns for (g,) in at_zero(phase_deg - (360.0 * n - 180.0), gain_db)]
    gain_margin = min((abs(g) for g in inversions), default=float("inf"))
    return phase_margin, gain_margin, float(np.exp(max(log for _, log in crossovers)))


def gain_text(gain: float) -> str:
    """Six digits: plenty for a gain, and the same with every BLAS, which differ in the eleventh."""
    text = f"{gain + 0.0:.6g}"
    return text if "." in text or "e" in text else text + ".0"


def render_header(design: Design) -> str:
    """Text of include/gains/NAME.h."""
    lines = [
        f"/// Generated by `strix gains --vehicle {design.name}` from "
        f"include/vehicles/{design.name}.h: do not edit.",
        "#pragma once",
        "",
        '#include "Gains.h"',
        "",
        "namespace strix {",
        "",
        "// clang-format off",
        f"constexpr Gains k{design.name}Gains{{",
        f'    "{design.name} LQR {RATE_HZ} Hz",',
        "    {{",
    ]
    columns = ("position", "velocity", "alpha", "body rate")
    for row, control in enumerate(("thrust, N", "tau_x, N m", "tau_y, N m", "tau_z, N m")):
        lines.append(f"        // {control}")
        for group, column in enumerate(columns):
            three = design.K[row, 3 * group : 3 * group + 3]
            opening = "{" if group == 0 else " "
            closing = "}," if group == 3 else ","
            text = ", ".join(gain_text(k) + "F" for k in three)
            lines.append(f"        {opening}{text}{closing}  // {column}")
    lines += ["    }},", "};", "// clang-format on", "", "}  // namespace strix", ""]
    return "\n".join(lines)


def render_report(design: Design, reports: Sequence[ChannelReport]) -> str:
    """The table a person reads before believing a gain."""
    lines = [
        f"{design.name}: LQR at {RATE_HZ} Hz; margins and steps with motor lag "
        f"{design.motor_time_constant_s:g} s and {DELAY_SAMPLES:g} samples of delay",
        "channel  phase   gain    crossover  bandwidth  settling  overshoot  largest u  "
        "design poles",
        "         deg     dB      rad/s      rad/s      s         %          per unit   rad/s",
    ]
    for r in reports:
        poles = "  ".join(_pole_text(p) for p in r.poles_rad_s if p.imag > -1e-6)
        lines.append(
            f"{r.name:<9}{r.phase_margin_deg:<8.1f}{r.gain_margin_db:<8.1f}"
            f"{r.crossover_rad_s:<11.2f}{r.bandwidth_rad_s:<11.2f}{r.settling_s:<10.2f}"
            f"{100.0 * r.overshoot:<11.1f}{r.largest_control:<11.4f}{poles}"
        )
    return "\n".join(lines)


def _pole_text(pole: complex) -> str:
    return f"{pole.real:.2f}" + (f"±{pole.imag:.2f}i" if pole.imag > 1e-6 else "")


def run_gains(vehicle: str | None, check: bool, folder: Path = GAINS_FOLDER) -> bool:
    """Design the gains of one vehicle, or of all; print their reports; write the headers.

    With check nothing is written. Returns whether every header was as it must be.
    """
    from strix import _core
    from strix.vehicles import vehicle_name

    names = _core.vehicle_names() if vehicle is None else [vehicle_name(vehicle)]
    current = True
    for name in names:
        design = design_gains(_core.vehicle(name))
        reports = analyse(design)
        print(render_report(design, reports), end="\n\n")
        refuse_thin_margins(design, reports)
        current = _put_header(folder / f"{name}.h", render_header(design), check) and current
    return current


def _put_header(file: Path, text: str, check: bool) -> bool:
    try:
        same = file.exists() and file.read_bytes() == text.encode()
        if check:
            print(f"{file}: {'as designed' if same else 'not what the vehicle file gives'}")
            return same
        if not same:
            file.write_text(text, encoding="utf-8")
        print(f"{file}: {'unchanged' if same else 'written; build again (make setup)'}")
    except OSError as error:
        raise BadInput(f"{file}: expected a file to write, found: {error.strerror}") from None
    return True
