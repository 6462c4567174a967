"""A spectrum for a person: words and a figure."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from strix.errors import BadInput
from strix.log.motor_lines import MOTION_HZ, MotorLine, folded
from strix.log.notch import HIGHEST, LAG_AT_HZ, LEAST_SHARE
from strix.log.spectrum import Spectrum
from strix.log.spectrum_input import UNITS

COLORS = ("#D55E00", "#0072B2", "#009E73")  # x y z: Okabe and Ito's
PREDICTED = "#b455d6"
ABOVE: dict[str, Any] = {  # where a legend hides no line
    "loc": "lower right",
    "bbox_to_anchor": (1.0, 1.0),
    "borderaxespad": 0.2,
    "fontsize": "small",
    "frameon": False,
    "ncols": 6,
}


def sentences(s: Spectrum) -> list[str]:
    """What was found and what to do about it."""
    unit = s.unit
    out = [
        f"{s.where}, {s.topic}: {s.samples} samples from {s.begin_s:.3f} to {s.end_s:.3f} s"
        f"{'' if s.whole else ' (a part of the log)'}, {s.rate_hz:.1f} Hz; "
        f"{s.resolution_hz:.2f} Hz apart, {s.averages} averages"
    ]
    out += _timing(s)
    clipped = ", ".join(f"{n} on {axis}" for axis, n in zip("xyz", s.clipped, strict=True) if n)
    scale = f"{s.full_scale:g} {UNITS[s.topic].scale_name}"
    if clipped:
        out.append(
            f"clipping: samples at {scale}: {clipped}, the first at {s.clipped_s[0]:.3f} s. A "
            "clipped wave has lines that are not there: soften the mount, or take a larger range"
        )
    else:
        out.append(f"clipping: no sample at {scale}")
    noise = " ".join(f"{value:.4g}" for value in s.noise_rms)
    out.append(f"above {MOTION_HZ:g} Hz: {noise} {unit} RMS (x y z)")
    for peak in s.peaks:
        out.append(
            f"peak: {peak.hz:.1f} Hz, {peak.rms:.3g} {unit} RMS, most on {peak.axis}, "
            f"{peak.above_floor_db:.0f} dB above the floor"
        )
    if not s.peaks:
        out.append("peaks: none")
    for line in s.motor_lines or []:
        out.append(_motor_line(line, s))
    if s.piled_up:
        out.append(
            f"aliasing: the density rises by {s.piles_up_db:.1f} dB towards Nyquist "
            f"({s.rate_hz / 2.0:.1f} Hz): what is above folds back. Lower the IMU's own low-pass, "
            "or sample faster"
        )
    return out + _notch(s)


def _timing(s: Spectrum) -> list[str]:
    if not s.resampled:
        return [f"sample times: even to {s.jitter_us:.1f} us RMS"]
    filled = ""
    if s.missing:
        share = 100.0 * s.missing / (s.samples + s.missing)
        filled = f", {s.missing} single samples missing ({share:.1f} %)"
    return [
        f"sample times: uneven by {s.jitter_us:.1f} us RMS{filled}: resampled with a cubic spline, "
        f"which blurs what is above {s.rate_hz / 4.0:.0f} Hz"
    ]


def _motor_line(line: MotorLine, s: Spectrum) -> str:
    text = f"motors x {line.order}: {line.from_hz:.1f} to {line.to_hz:.1f} Hz by their commands"
    if line.folds_to_hz is not None:
        begin_hz, end_hz = line.folds_to_hz
        seen = f"seen at {begin_hz:.1f} to {end_hz:.1f} Hz"
        if line.from_hz < s.rate_hz / 2.0:
            seen = f"seen up to there and back to {end_hz:.1f} Hz"
        text += f", beyond Nyquist ({s.rate_hz / 2.0:.1f} Hz): {seen}"
    if line.found_order is None:
        return f"{text}: no line"
    return (
        f"{text}: {line.rms:.3g} {s.unit} RMS, {line.above_floor_db:.0f} dB above the floor, "
        f"{100.0 * line.share:.0f} % of the power above {MOTION_HZ:g} Hz, at "
        f"{line.found_order / line.order:.3f} of the predicted speed"
    )


def _notch(s: Spectrum) -> list[str]:
    if s.topic != "gyro":
        return []
    if s.motor_lines is None:
        return [
            "notch: no proposal, because nothing tells the motors' speed (a flight log of a known "
            "vehicle does)"
        ]
    if not s.motor_lines:
        return ["notch: no proposal, because the motors do not turn for long enough"]
    if s.notch is not None:
        n = s.notch
        return [
            f"notch: costs {n.lag_deg:.1f} deg at {LAG_AT_HZ:g} Hz at its lowest. To paste into "
            "include/FlightConfig.h:",
            *(f"  {line}" for line in n.lines()),
        ]
    strong = [line for line in s.motor_lines if line.found_order and line.share >= LEAST_SHARE]
    if strong:
        return [
            f"notch: none reaches the line at motors x {strong[0].order} beyond "
            f"{HIGHEST * s.rate_hz:.0f} Hz: lower the IMU's own low-pass, or sample faster"
        ]
    return [
        f"notch: none needed, no line at the motors' turns has {100.0 * LEAST_SHARE:.0f} % of the "
        f"power above {MOTION_HZ:g} Hz"
    ]


def draw(s: Spectrum, out: Path) -> None:
    """Density by axis, and below it all axes over time with the motors' turns."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    if out.suffix.lower() != ".png":
        raise BadInput(f"-o {out}: expected a name that ends in .png, found {out.suffix!r}")
    figure = Figure(figsize=(10.0, 8.0), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, height_ratios=[1.0, 1.0])
    figure.suptitle(f"{Path(s.where).name}, {s.topic}, {s.begin_s:.1f} to {s.end_s:.1f} s")
    nyquist_hz = s.rate_hz / 2.0

    shown = s.density[1:-1]  # the first bin is the mean, the last the window's
    for axis, color in enumerate(COLORS):
        upper.semilogy(s.hz[1:-1], shown[:, axis], color=color, linewidth=0.9, label="xyz"[axis])
    for peak in s.peaks:
        at = int(np.argmin(np.abs(s.hz - peak.hz)))
        upper.annotate(
            f"{peak.hz:.0f}",
            (peak.hz, s.density[at].max()),
            xytext=(0, 4),
            textcoords="offset points",
            ha="center",
            fontsize="small",
        )
    for line in s.motor_lines or []:
        seen: tuple[float, ...] = line.folds_to_hz or (line.from_hz, line.to_hz)
        label = f"motors x {line.order}{'' if line.folds_to_hz is None else ', folded'}"
        if line.from_hz < nyquist_hz < line.to_hz:
            seen = (*seen, nyquist_hz)
        alpha = 0.30 - 0.08 * (line.order - 1)
        upper.axvspan(min(seen), max(seen), color=PREDICTED, alpha=alpha, lw=0, label=label)
    # As plain text: powers in mathematical type want fonts that not every machine has.
    upper.yaxis.set_major_formatter(lambda value, _: f"{value:.0e}")
    upper.yaxis.set_minor_formatter(NullFormatter())
    upper.set_xlim(0.0, nyquist_hz)
    upper.set_ylabel(f"density, ({s.unit.replace('^2', '²')})²/Hz")
    upper.set_xlabel("frequency, Hz (to Nyquist)")
    upper.grid(visible=True, alpha=0.3)
    upper.margins(y=0.08)
    upper.legend(**ABOVE)

    power_db = 10.0 * np.log10(np.maximum(s.waterfall[1:], 1e-30))
    low, high = np.percentile(power_db, [5.0, 99.8])
    image = lower.pcolormesh(
        s.segment_s, s.hz[1:], power_db, cmap="gray_r", vmin=low, vmax=high, rasterized=True
    )
    figure.colorbar(image, ax=lower, label="all axes, dB")
    for line in s.motor_lines or []:
        lower.plot(
            s.segment_s,
            folded(line.order * s.turns_hz, s.rate_hz),
            color=PREDICTED,
            linestyle=("-", "--", ":")[line.order - 1],
            linewidth=1.2,
            alpha=0.7,
            label=f"motors x {line.order} by their commands",
        )
    if s.clipped_s.size:
        lower.plot(
            s.clipped_s,
            np.full(s.clipped_s.size, 0.99 * nyquist_hz),
            "|",
            color="#e5383b",
            label="clipped",
        )
    lower.set_ylim(0.0, nyquist_hz)
    lower.set_ylabel("frequency, Hz")
    lower.set_xlabel("time since power-up, s")
    if lower.get_legend_handles_labels()[0]:
        lower.legend(**ABOVE)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(out, dpi=120)
    except OSError as error:
        raise BadInput(f"-o {out}: expected to write there, found: {error.strerror}") from None
