"""The flown design around aircraft that are not quite what the vehicle file says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from strix.gains.analysis import ATTITUDE_STEP_RAD, loop_margins, step_response
from strix.gains.design import Design
from strix.gains.loop import sampled_loop
from strix.gains.margins import Margins
from strix.gains.model import ATTITUDE_CHANNELS, CHANNELS, Channel, Numbers, Truth

SLOWEST_MOTORS_S = 0.08
# For each channel only thrust / mass or thrust / inertia counts: all three off by a fifth at once.
WEAK = {"mass": 1.2, "inertia": 1.2, "thrust": 0.8}
STRONG = {"mass": 0.8, "inertia": 0.8, "thrust": 1.2}


@dataclass(frozen=True)
class Corner:
    """One channel of one aircraft."""

    channel: str
    aircraft: str  # weak, as designed or strong
    motor_time_constant_s: float
    stable: bool
    margins: Margins
    overshoot: float | None  # of a 30 deg step, where attitude is held


def corner_truths(numbers: Numbers) -> list[tuple[str, Truth]]:
    """Mass, inertia and thrust 20 % off either way; motors as designed and as slow as 0.08 s."""
    lags = sorted({round(numbers["motor_time_constant"], 6), SLOWEST_MOTORS_S})
    return [
        (name, Truth(**factors, motor_time_constant_s=lag))
        for lag in lags
        for name, factors in (("weak", WEAK), ("as designed", {}), ("strong", STRONG))
    ]


def corner_table(design: Design) -> list[Corner]:
    """Every channel at every corner."""
    return [
        _corner(design, channel, name, truth)
        for channel in (*CHANNELS, *ATTITUDE_CHANNELS)
        for name, truth in corner_truths(design.numbers)
    ]


def _corner(design: Design, channel: Channel, name: str, truth: Truth) -> Corner:
    eigenvalues = np.linalg.eigvals(sampled_loop(design, channel, truth).closed)
    overshoot = None
    if not channel.integral:
        angle, _ = step_response(design, channel, ATTITUDE_STEP_RAD, 5.0, truth)
        overshoot = max(0.0, float(angle.max() / ATTITUDE_STEP_RAD - 1.0))
    return Corner(
        channel=channel.name,
        aircraft=name,
        motor_time_constant_s=float(truth.motor_time_constant_s or 0.0),
        stable=bool(np.abs(eigenvalues).max() < 1.0),
        margins=loop_margins(design, channel, truth),
        overshoot=overshoot,
    )


def render_corners(design: Design, corners: Sequence[Corner]) -> str:
    """The table for people: one line a channel and lag, one column an aircraft."""
    lines = [
        f"{design.title}, when the aircraft differs: phase margin deg / gain margin dB "
        "(30 deg step's overshoot)",
        "weak: mass and inertia +20 %, thrust -20 %; strong: the other way",
        f"{'channel':<16}{'lag, s':<8}{'weak':<22}{'as designed':<22}strong",
    ]
    for i in range(0, len(corners), 3):
        three = corners[i : i + 3]
        cells = "".join(f"{_cell(c):<22}" for c in three).rstrip()
        lines.append(f"{three[0].channel:<16}{three[0].motor_time_constant_s:<8g}{cells}")
    return "\n".join(lines)


def _cell(corner: Corner) -> str:
    if not corner.stable:
        return "unstable"
    m = corner.margins
    text = f"{m.phase_deg:.1f} / {m.gain_db:.1f}"
    return text if corner.overshoot is None else f"{text} ({100.0 * corner.overshoot:.0f} %)"
