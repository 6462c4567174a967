"""The figures of docs/navigation.md: each option off and on, in the same simulated flight."""

from __future__ import annotations

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from strix.errors import BadInput
from strix.options.comparison import Comparison, Panel

WIDTH_IN, PANEL_IN = 7.0, 2.3
PIXELS_AN_INCH = 100  # 700 pixels wide
# Okabe and Ito's colours, which also the colour-blind tell apart.
COLORS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7")


def draw(comparison: Comparison, path: Path) -> None:
    """Write the figure as PNG; its folder is made."""
    panels = comparison.panels
    figure = Figure(figsize=(WIDTH_IN, 0.7 + PANEL_IN * len(panels)), layout="constrained")
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    figure.suptitle(comparison.title, fontsize=11)
    for panel, ax in zip(panels, axes, strict=True):
        _draw_panel(comparison, panel, ax)
    for name, (begin_s, _) in comparison.marked.items():
        axes[0].annotate(
            name,
            (begin_s, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(3, -11),
            textcoords="offset points",
            fontsize=8,
            color="0.35",
        )
    axes[0].legend(fontsize=8, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, frameon=False)
    axes[-1].set_xlabel("time (s)", fontsize=9)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Without the version of matplotlib in it, the same flight gives the same file.
        figure.savefig(path, dpi=PIXELS_AN_INCH, metadata={"Software": None})
    except OSError as error:
        raise BadInput(f"{path}: expected a file that can be written, found: {error}") from None


def _draw_panel(comparison: Comparison, panel: Panel, ax: Axes) -> None:
    solid = len(panel.curves) // (2 if panel.dashed else 1)
    for i, (name, values) in enumerate(panel.curves.items()):
        ax.plot(
            comparison.time_s,
            values,
            label=name,
            color=COLORS[i % solid],
            linewidth=1.3,
            linestyle="-" if i < solid else "--",
        )
    for i, (begin_s, end_s) in enumerate(comparison.marked.values()):
        ax.axvspan(begin_s, end_s, color=("0.93", "0.86")[i % 2], zorder=0)
    if panel.logarithmic:
        ax.set_yscale("log")
    if panel.ticks:
        ax.set_yticks(list(panel.ticks), list(panel.ticks.values()))
    ax.set_ylabel(panel.quantity, fontsize=9)
    ax.set_xlim(comparison.drawn_from_s, float(comparison.time_s[-1]))
    ax.margins(y=0.12)
    ax.tick_params(labelsize=8)
    ax.grid(color="0.85", linewidth=0.5)
    ax.spines[["top", "right"]].set_visible(False)
