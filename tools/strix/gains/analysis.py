"""How a design behaves with motor lag and delay: margins, steps, wind and noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov

from strix.errors import BadInput
from strix.gains.design import KINDS, Design, design_gains, design_model
from strix.gains.loop import Loop, sampled_loop
from strix.gains.margins import (
    FREQUENCIES_RAD_S,
    LEAST_GAIN_MARGIN_DB,
    LEAST_PHASE_MARGIN_DEG,
    Margins,
    margins_of,
)
from strix.gains.model import (
    ATTITUDE_CHANNELS,
    CHANNELS,
    GRAVITY_M_S2,
    PERIOD_S,
    RATE_HZ,
    Channel,
    Matrix,
    Numbers,
    Truth,
)

DURATION_S = 20.0
ATTITUDE_STEP_RAD = float(np.radians(30.0))
SMOOTH_STEP_S = 5.0  # ours: 1 m, at most 0.38 m/s and 0.23 m/s^2
GYRO_NOISE_RAD_S = 0.0031  # one sigma of a sample (DESIGN.md, 5), each its own


@dataclass(frozen=True)
class ChannelReport:
    """One channel that holds position or yaw. Steps are of 1 m or 1 rad, without the controller's
    limits; the smooth one follows a minimum-jerk path with velocity and acceleration fed forward.
    """

    name: str
    poles_rad_s: NDArray[np.complex128]  # of the design model: s = ln(z) / period
    margins: Margins
    bandwidth_rad_s: float  # reference to output, -3 dB
    settling_s: float  # to 2 %
    overshoot: float
    largest_control: float  # N or N m
    smooth_settling_s: float
    smooth_overshoot: float
    offset: float  # largest, after 1 N or 1 N m pushes from then on, m or rad
    offset_gone_s: float  # until a tenth of it is left; infinite: not within 20 s


@dataclass(frozen=True)
class AttitudeReport:
    """One axis that holds attitude; the step is of 30 deg."""

    name: str
    margins: Margins
    rise_s: float  # 10 to 90 %
    reached_s: float  # within 10 %, 3 deg, from then on
    overshoot: float
    largest_torque: float  # N m
    torque_limit: float  # N m, what the motors give at hover without changing the thrust
    noise_torque: float  # N m, RMS, asked for because of the gyro's noise


@dataclass(frozen=True)
class DesignReport:
    """All channels of one design."""

    design: Design
    channels: tuple[ChannelReport, ...]
    attitudes: tuple[AttitudeReport, ...]


def design_and_analyse(numbers: Numbers) -> list[DesignReport]:
    """The four designs of a vehicle, the flown one first."""
    return [analyse(design_gains(numbers, kind)) for kind in KINDS]


def analyse(design: Design) -> DesignReport:
    """What a person wants to know of a design. Raises BadInput when a loop is unstable."""
    return DesignReport(
        design,
        tuple(_analyse_channel(design, channel) for channel in CHANNELS),
        tuple(_analyse_attitude(design, channel) for channel in ATTITUDE_CHANNELS),
    )


def refuse_thin_margins(designs: Sequence[Design]) -> None:
    """Raise BadInput unless every channel keeps 45 deg and 6 dB with motor lag and delay."""
    for design in designs:
        for channel in (*CHANNELS, *ATTITUDE_CHANNELS):
            margins = _margins(_stable_loop(design, channel))
            phase_deg, gain_db = margins.phase_deg, margins.gain_db
            if phase_deg < LEAST_PHASE_MARGIN_DEG or gain_db < LEAST_GAIN_MARGIN_DB:
                raise _refused(design, channel, f"{phase_deg:.1f} deg and {gain_db:.1f} dB")


def _stable_loop(design: Design, channel: Channel) -> Loop:
    """The margins of a loop that is unstable say nothing: it is refused."""
    loop = sampled_loop(design, channel)
    if np.abs(np.linalg.eigvals(loop.closed)).max() >= 1.0:
        raise _refused(design, channel, "an unstable loop")
    return loop


def _refused(design: Design, channel: Channel, found: str) -> BadInput:
    return BadInput(
        f"include/vehicles/{design.vehicle}.h, {design.kind.weights}: expected weights that leave "
        f"{LEAST_PHASE_MARGIN_DEG:.0f} deg and {LEAST_GAIN_MARGIN_DB:.0f} dB, found {found} in "
        f"channel '{channel.name}' of the design '{design.kind.title}'"
    )


def loop_margins(design: Design, channel: Channel, truth: Truth | None = None) -> Margins:
    """At the plant input, of the loop that samples and holds."""
    return _margins(sampled_loop(design, channel, truth))


def _margins(loop: Loop) -> Margins:
    return margins_of(FREQUENCIES_RAD_S, loop.opened(FREQUENCIES_RAD_S))


def step_response(
    design: Design,
    channel: Channel,
    size: float,
    duration_s: float = DURATION_S,
    truth: Truth | None = None,
) -> tuple[Matrix, Matrix]:
    """Output and control at 500 Hz after a step of the reference."""
    return sampled_loop(design, channel, truth).run(_step(channel, size, duration_s))


def _step(channel: Channel, size: float, duration_s: float = DURATION_S) -> Matrix:
    reference = np.zeros((round(duration_s * RATE_HZ), len(channel.states)))
    reference[:, 0] = size
    return reference


def smooth_response(design: Design, channel: Channel) -> tuple[Matrix, Matrix]:
    """Output and control along a minimum-jerk path to 1, as the guidance feeds it forward."""
    return sampled_loop(design, channel).run(*_smooth_path(design, channel))


def _smooth_path(design: Design, channel: Channel) -> tuple[Matrix, Matrix]:
    """Reference and nominal control."""
    t = np.arange(round(DURATION_S * RATE_HZ)) * PERIOD_S
    x = np.minimum(t / SMOOTH_STEP_S, 1.0)
    reference = np.zeros((len(t), len(channel.states)))
    reference[:, 0] = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    reference[:, 1] = 30.0 * x**2 * (1.0 - x) ** 2 / SMOOTH_STEP_S
    acceleration = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / SMOOTH_STEP_S**2
    nominal = np.zeros(len(t))
    if channel.name == "down":
        nominal = -design.numbers["mass"] * acceleration
    elif channel.name != "yaw":  # the tilt that gives it: nose down forward, right side down right
        sign = -1.0 if channel.name == "forward" else 1.0
        reference[:, 2] = sign * acceleration / GRAVITY_M_S2
    return reference, nominal


def torque_limits(numbers: Numbers) -> tuple[float, float, float]:
    """Roll, pitch and yaw torque that the motors give at hover without changing the thrust, N m:
    two rotors up, two down, as far as the nearer limit allows (X layout).
    """
    hover = numbers["mass"] * GRAVITY_M_S2 / (4.0 * numbers["thrust_constant"])  # n^2
    curve = numbers["command"]
    above = numbers["command_flight_max"] - curve["offset"]
    most = above / curve["quadratic"] if curve["quadratic"] else (above / curve["linear"]) ** 2
    room = min(hover - numbers["speed_flight_min"] ** 2, most - hover)
    along = room * numbers["thrust_constant"]
    return (
        along * sum(abs(rotor["y"]) for rotor in numbers["rotors"]),
        along * sum(abs(rotor["x"]) for rotor in numbers["rotors"]),
        4.0 * room * numbers["torque_constant"],
    )


def _analyse_channel(design: Design, channel: Channel) -> ChannelReport:
    loop = _stable_loop(design, channel)
    output, control = loop.run(_step(channel, 1.0))
    smooth, _ = loop.run(*_smooth_path(design, channel))
    still = _step(channel, 0.0)
    offset = np.abs(loop.run(still, disturbance=1.0)[0])
    return ChannelReport(
        name=channel.name,
        poles_rad_s=_design_poles(design, channel),
        margins=_margins(loop),
        bandwidth_rad_s=_bandwidth(loop),
        settling_s=_last(np.abs(output - 1.0) > 0.02),
        overshoot=max(0.0, float(output.max() - 1.0)),
        largest_control=float(np.abs(control).max()),
        smooth_settling_s=_last(np.abs(smooth - 1.0) > 0.02),
        smooth_overshoot=max(0.0, float(smooth.max() - 1.0)),
        offset=float(offset.max()),
        offset_gone_s=_last(offset > 0.1 * offset.max()),
    )


def _analyse_attitude(design: Design, channel: Channel) -> AttitudeReport:
    loop = _stable_loop(design, channel)
    angle, torque = loop.run(_step(channel, ATTITUDE_STEP_RAD, 5.0))
    part = angle / ATTITUDE_STEP_RAD
    return AttitudeReport(
        name=channel.name,
        margins=_margins(loop),
        rise_s=float((np.argmax(part > 0.9) - np.argmax(part > 0.1)) * PERIOD_S),
        reached_s=_last(np.abs(part - 1.0) > 0.1),
        overshoot=max(0.0, float(part.max() - 1.0)),
        largest_torque=float(np.abs(torque).max()),
        torque_limit=torque_limits(design.numbers)[channel.control - 1],
        noise_torque=_noise_torque(loop, len(channel.states) - 1),
    )


def _design_poles(design: Design, channel: Channel) -> NDArray[np.complex128]:
    row = channel.control
    K = list(design.k[row, list(channel.states)])
    K = [design.integral[row], *K] if design.kind.integral else K
    K = [*K, design.lag[row]] if design.kind.lag else K
    Ad, Bd = design_model(design.numbers, channel, design.kind)
    poles = np.linalg.eigvals(Ad - Bd @ np.array([K])).astype(np.complex128)
    found: NDArray[np.complex128] = np.sort_complex(np.log(poles) / PERIOD_S)
    return found


def _bandwidth(loop: Loop) -> float:
    push = (loop.B_aircraft + loop.B_controller) @ loop.K_r[:, :1] - loop.S[:, :1]
    z = np.exp(1j * FREQUENCIES_RAD_S * PERIOD_S)[:, None, None]
    follow = np.linalg.solve(z * np.eye(len(push)) - loop.closed, push.astype(complex))[:, 0, 0]
    below = np.abs(follow) < np.sqrt(0.5)
    return float(FREQUENCIES_RAD_S[np.argmax(below)])


def _noise_torque(loop: Loop, rate: int) -> float:
    """RMS of u in the closed loop with white noise on the measured rate: Lyapunov's equation."""
    on_u = -loop.K_r[0, rate] * GYRO_NOISE_RAD_S
    push = (loop.B_aircraft + loop.B_controller) * on_u
    P = solve_discrete_lyapunov(loop.closed, push @ push.T)
    return float(np.sqrt((loop.K @ P @ loop.K.T)[0, 0] + on_u**2))


def _last(outside: NDArray[np.bool_]) -> float:
    """Time after which it is not outside again, s; infinite if it still is at the end."""
    found = np.flatnonzero(outside)
    if len(found) == 0:
        return 0.0
    return float((found[-1] + 1) * PERIOD_S) if found[-1] + 1 < len(outside) else float("inf")
