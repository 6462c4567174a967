"""What a person reads before believing a gain, and the same as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from strix.gains.analysis import AttitudeReport, ChannelReport, DesignReport
from strix.gains.corners import Corner
from strix.gains.model import RATE_HZ


def render_report(reports: Sequence[DesignReport]) -> str:
    """The tables of one vehicle's designs."""
    numbers = reports[0].design.numbers
    lines = [
        f"{reports[0].design.vehicle}: LQR at {RATE_HZ} Hz; all but the poles with motor lag "
        f"{numbers['motor_time_constant']:g} s, a sample of delay and the hold"
    ]
    for report in reports:
        lines += ["", f"design: {report.design.kind.title}"]
        lines += _channel_lines(report.channels)
        lines += _attitude_lines(report.attitudes)
    return "\n".join(lines)


def _channel_lines(channels: Sequence[ChannelReport]) -> list[str]:
    lines = [
        "channel  margins         crossover  bandwidth  step of 1                smooth step    "
        "push of 1          design poles",
        "         deg     dB      rad/s      rad/s      settled  over  largest   settled  over  "
        "offset    gone     rad/s",
        "                                               s        %     N, N m    s        %     "
        "m, rad    s",
    ]
    for r in channels:
        poles = "  ".join(_pole_text(p) for p in r.poles_rad_s if p.imag > -1e-6)
        gone = f"{r.offset_gone_s:.1f}" if math.isfinite(r.offset_gone_s) else "no"
        lines.append(
            f"{r.name:<9}{r.margins.phase_deg:<8.1f}{r.margins.gain_db:<8.1f}"
            f"{r.margins.crossover_rad_s:<11.2f}{r.bandwidth_rad_s:<11.2f}"
            f"{r.settling_s:<9.2f}{100.0 * r.overshoot:<6.1f}{r.largest_control:<10.4f}"
            f"{r.smooth_settling_s:<9.2f}{100.0 * r.smooth_overshoot:<6.1f}"
            f"{r.offset:<10.3f}{gone:<9}{poles}"
        )
    return lines


def _attitude_lines(attitudes: Sequence[AttitudeReport]) -> list[str]:
    lines = [
        "attitude alone  margins         step of 30 deg                     motors   gyro noise",
        "                deg     dB      rise     in 3 deg  over  largest   give     RMS",
        "                                s        s         %     N m       N m      mN m",
    ]
    lines += [
        f"{r.name:<16}{r.margins.phase_deg:<8.1f}{r.margins.gain_db:<8.1f}{r.rise_s:<9.3f}"
        f"{r.reached_s:<10.3f}{100.0 * r.overshoot:<6.1f}{r.largest_torque:<10.3f}"
        f"{r.torque_limit:<9.3f}{1e3 * r.noise_torque:.3f}"
        for r in attitudes
    ]
    return lines


def _pole_text(pole: complex) -> str:
    return f"{pole.real:.2f}" + (f"±{pole.imag:.2f}i" if pole.imag > 1e-6 else "")


def report_dict(reports: Sequence[DesignReport], corners: Sequence[Corner]) -> dict[str, Any]:
    """Everything, by name."""
    return {
        "vehicle": reports[0].design.vehicle,
        "designs": [
            {
                "design": report.design.title,
                "k": report.design.k.tolist(),
                "lag": report.design.lag.tolist(),
                "integral": report.design.integral.tolist(),
                "channels": [_plain(asdict(r)) for r in report.channels],
                "attitudes": [_plain(asdict(r)) for r in report.attitudes],
            }
            for report in reports
        ],
        "corners": [_plain(asdict(corner)) for corner in corners],
    }


def _plain(value: Any) -> Any:
    """For JSON: complex numbers as [real, imaginary], what is infinite as null."""
    if isinstance(value, dict):
        return {key: _plain(v) for key, v in value.items()}
    if isinstance(value, np.ndarray):
        return [[float(p.real), float(p.imag)] for p in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
