"""Figures of docs/control.md: steps and margins of the four designs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from strix.errors import BadInput
from strix.gains.analysis import (
    ATTITUDE_STEP_RAD,
    SMOOTH_STEP_S,
    DesignReport,
    smooth_response,
    step_response,
)
from strix.gains.loop import sampled_loop
from strix.gains.margins import FREQUENCIES_RAD_S, LEAST_GAIN_MARGIN_DB, LEAST_PHASE_MARGIN_DEG
from strix.gains.model import ATTITUDE_CHANNELS, CHANNELS, PERIOD_S, Channel

WIDTH_IN, PANEL_IN = 7.0, 2.3
PIXELS_AN_INCH = 100  # 700 pixels wide
# Okabe and Ito's colours, which also the colour-blind tell apart.
COLORS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7")

FORWARD, RIGHT, DOWN, YAW = CHANNELS
PITCH_ALONE, ROLL_ALONE, YAW_ALONE = ATTITUDE_CHANNELS


def write_figures(reports: Sequence[DesignReport], folder: Path) -> list[Path]:
    """Write both figures of a vehicle as PNG; the folder is made."""
    name = reports[0].design.vehicle
    drawn = {
        folder / f"control_steps_{name}.png": draw_steps(reports),
        folder / f"control_margins_{name}.png": draw_margins(reports),
    }
    for path, figure in drawn.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # Without the version of matplotlib in it, the same gains give the same file.
            figure.savefig(path, dpi=PIXELS_AN_INCH, metadata={"Software": None})
        except OSError as error:
            raise BadInput(f"{path}: expected a file that can be written, found: {error}") from None
    return list(drawn)


def draw_steps(reports: Sequence[DesignReport]) -> Figure:
    """Position along a smooth path and after a step, roll and yaw after 30 deg."""
    figure = Figure(figsize=(WIDTH_IN, 0.7 + 4 * PANEL_IN), layout="constrained")
    smooth, step, roll, yaw = figure.subplots(4, 1)
    figure.suptitle(
        f"{reports[0].design.vehicle}: steps with motor lag and delay (linear model)", fontsize=11
    )
    for report, color in zip(reports, COLORS, strict=True):
        design, label = report.design, report.design.kind.title
        _curve(smooth, smooth_response(design, RIGHT)[0], 12.0, color, label)
        _curve(step, step_response(design, RIGHT, 1.0)[0], 12.0, color, label)
        for ax, channel in ((roll, ROLL_ALONE), (yaw, YAW_ALONE)):
            angle, _ = step_response(design, channel, ATTITUDE_STEP_RAD)
            _curve(ax, np.degrees(angle), 1.5 if ax is roll else 3.0, color, label)
    smooth.set_ylabel(f"right, m\nsmooth path, {SMOOTH_STEP_S:g} s", fontsize=9)
    step.set_ylabel("right, m\nbare step", fontsize=9)
    for ax, axis in ((roll, "roll"), (yaw, "yaw")):
        ax.set_ylabel(f"{axis}, deg\nattitude alone", fontsize=9)
        ax.axhspan(27.0, 33.0, color="0.93", zorder=0)
    for ax in (smooth, step):
        ax.axhspan(0.98, 1.02, color="0.93", zorder=0)
    smooth.legend(fontsize=8, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, frameon=False)
    yaw.set_xlabel("time (s)", fontsize=9)
    return figure


def draw_margins(reports: Sequence[DesignReport]) -> Figure:
    """Nichols charts at the plant input; the diamond's tips are 45 deg and 6 dB from the point
    that must not be met. Where a curve crosses the axes of the diamond, it must be outside.
    """
    figure = Figure(figsize=(WIDTH_IN, 2 * 3.2), layout="constrained")
    figure.suptitle(
        f"{reports[0].design.vehicle}: loop at the plant input with motor lag and delay",
        fontsize=11,
    )
    panels = zip(figure.subplots(2, 2).ravel(), (FORWARD, DOWN, YAW, PITCH_ALONE), strict=True)
    for ax, channel in panels:
        for report, color in zip(reports, COLORS, strict=True):
            _nichols(ax, report, channel, color)
        phase, gain = LEAST_PHASE_MARGIN_DEG, LEAST_GAIN_MARGIN_DB
        ax.fill(
            (-180 - phase, -180, -180 + phase, -180), (0, gain, 0, -gain), color="0.8", zorder=0
        )
        ax.set_title(channel.name, fontsize=9)
        ax.set_xlim(-300, -60)
        ax.set_ylim(-40, 40)
        ax.set_xticks([-270, -225, -180, -135, -90])
        _plain(ax)
    axes = figure.axes
    figure.legend(
        *axes[0].get_legend_handles_labels(),
        fontsize=8,
        loc="outside lower center",
        ncols=4,
        frameon=False,
    )
    for ax in axes[2:]:
        ax.set_xlabel("phase (deg)", fontsize=9)
    for ax in axes[::2]:
        ax.set_ylabel("gain (dB)", fontsize=9)
    return figure


def _nichols(ax: Axes, report: DesignReport, channel: Channel, color: str) -> None:
    loop = sampled_loop(report.design, channel).opened(FREQUENCIES_RAD_S)
    phase_deg = np.degrees(np.unwrap(np.angle(loop)))
    # unwrap starts anywhere: the crossover belongs between -360 and 0 deg.
    over = phase_deg[np.flatnonzero(np.abs(loop) > 1.0)[-1]]
    phase_deg -= 360.0 * np.floor(over / 360.0) + 360.0
    ax.plot(
        phase_deg,
        20.0 * np.log10(np.abs(loop)),
        color=color,
        linewidth=1.3,
        label=report.design.kind.title,
    )


def _curve(ax: Axes, values: np.ndarray, until_s: float, color: str, label: str) -> None:
    ax.plot(np.arange(len(values)) * PERIOD_S, values, color=color, linewidth=1.3, label=label)
    ax.set_xlim(0.0, until_s)
    _plain(ax)


def _plain(ax: Axes) -> None:
    ax.tick_params(labelsize=8)
    ax.grid(color="0.85", linewidth=0.5)
    ax.spines[["top", "right"]].set_visible(False)
