"""Figures of docs/control.md: the aircraft's responses as flown."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from strix.errors import BadInput
from strix.handling.flights import GRID_S, Kind, Measured, grid
from strix.handling.montecarlo import by_badness
from strix.handling.targets import ATTITUDES, PLACES

WIDTH_IN, PANEL_IN = 9.0, 2.4
# Okabe and Ito's colours, which also the colour-blind tell apart.
COLORS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7")
SHOWN_S = {"roll": 0.6, "pitch": 0.6, "yaw": 1.5, "forward": 6.0, "up": 6.0}
TARGET_S = {"roll": 0.2, "pitch": 0.2, "yaw": 1.0}
UNIT = {**dict.fromkeys(ATTITUDES, "of 30 deg"), **dict.fromkeys(PLACES, "of 1 m")}


def write_figures(flown: Sequence[Measured], folder: Path) -> list[Path]:
    """One of the headings for each vehicle, one of the Monte Carlo."""
    paths = []
    for vehicle in sorted({m.job.vehicle for m in flown if m.job.quiet_gps}):
        path = folder / f"control_headings_{vehicle}.png"
        _save(_headings([m for m in flown if m.job.vehicle == vehicle and m.job.quiet_gps]), path)
        paths.append(path)
    robust = [m for m in flown if m.job.kind is Kind.ROBUST]
    if robust:
        path = folder / "control_robust.png"
        _save(_robust(robust), path)
        paths.append(path)
    return paths


def _headings(quiet: Sequence[Measured]) -> Figure:
    figure = Figure(figsize=(WIDTH_IN, 2.0 * PANEL_IN + 0.5), layout="constrained")
    panels = figure.subplots(2, 3).flat
    figure.suptitle(f"{quiet[0].job.vehicle}: the same steps at four headings", fontsize=11)
    headings = sorted({m.job.heading_deg for m in quiet})
    for name in (*ATTITUDES, *PLACES):
        ax = next(panels)
        for heading_deg, color in zip(headings, COLORS, strict=False):
            each = [
                r
                for m in quiet
                if m.job.heading_deg == heading_deg
                for r in m.responses.get(name, [])
            ]
            if each:
                time_s = grid(len(each[0]) * GRID_S)
                label = f"{heading_deg:.0f} deg"
                ax.plot(time_s, np.mean(each, axis=0), color=color, linewidth=1.2, label=label)
        _lay_out(ax, name)
    last = next(panels)
    last.axis("off")
    last.legend(*figure.axes[0].get_legend_handles_labels(), loc="center", frameon=False)
    return figure


def _robust(flown: Sequence[Measured]) -> Figure:
    """All flights; the worst one in colour."""
    worst = by_badness(flown)[0].draw.seed
    names = ("roll", "pitch", "yaw", "forward")
    figure = Figure(figsize=(WIDTH_IN, 2.0 * PANEL_IN + 0.5), layout="constrained")
    axes = figure.subplots(2, 2).flat
    figure.suptitle(
        f"{flown[0].job.vehicle}: {len(flown)} aircraft, mass, inertia and thrust off by up to "
        f"20 %, motor lag 0.02 to 0.08 s; the worst, seed {worst}, in colour",
        fontsize=10,
    )
    for name, ax in zip(names, axes, strict=True):
        for m in sorted(flown, key=lambda m: m.job.seed == worst):
            for r in m.responses.get(name, []):
                is_worst = m.job.seed == worst
                ax.plot(
                    grid(len(r) * GRID_S),
                    r,
                    color=COLORS[0] if is_worst else "0.3",
                    alpha=1.0 if is_worst else 0.15,
                    linewidth=1.3 if is_worst else 0.6,
                )
        _lay_out(ax, name)
    return figure


def _lay_out(ax: Axes, name: str) -> None:
    ax.axhline(1.0, color="0.6", linewidth=0.7)
    if name in TARGET_S:
        ax.axvline(TARGET_S[name], color="0.6", linewidth=0.7, linestyle=":")
    ax.set_xlim(0.0, SHOWN_S[name])
    ax.set_title(name, fontsize=9)
    ax.set_ylabel(UNIT[name], fontsize=8)
    ax.set_xlabel("time from the step (s)", fontsize=8)
    ax.tick_params(labelsize=8)
    ax.grid(color="0.88", linewidth=0.5)
    ax.spines[["top", "right"]].set_visible(False)


def _save(figure: Figure, path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Without the version of matplotlib in it, the same flights give the same file.
        figure.savefig(path, dpi=100, metadata={"Software": None})
    except OSError as error:
        raise BadInput(f"{path}: expected a file that can be written, found: {error}") from None
