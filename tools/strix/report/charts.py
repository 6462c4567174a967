"""Charts as Plotly's JavaScript draws them: plain dictionaries of traces and a layout.

Without Plotly's Python classes, which would take longer to build than all else here; the tests
check the dictionaries against them. Colours of text, axes and grid come from the page (page.html),
which knows whether it is light or dark; those of traces are readable on both.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strix.flightlog import Array

Trace = dict[str, Any]

TRUTH = "#98a1ad"  # drawn wide, below the others
ESTIMATE = "#2b7fe0"
REFERENCE = "#e8790c"
BAND = "rgba(43,127,224,0.16)"
ALARM = "#e5383b"
FAINT = "rgba(128,128,128,0.4)"
FOUR = ("#2b7fe0", "#e8790c", "#17a06b", "#b455d6")  # M1..M4, or components
STATES = ("#98a1ad", "#6b7f99", "#d6a100", "#17a06b", "#2b7fe0", "#8a5cf0", "#e8790c")

LINE_POINTS = 2000  # of one line at most: more than a screen is wide


@dataclass(frozen=True)
class Chart:
    """One drawing and the words that go with it."""

    name: str  # of its element in the page
    title: str
    height_px: int
    traces: list[Trace]
    layout: dict[str, Any]
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        """For the page's script."""
        return {"name": self.name, "data": self.traces, "layout": self.layout}


@dataclass(frozen=True)
class TimeAxis:
    """The same for all charts over time, so that they can be compared."""

    begin_s: float
    end_s: float
    marks_s: Sequence[float]  # changes of state, marked across all panels


@dataclass
class Panel:
    """One of several axes above each other, on the same time axis."""

    title: str
    traces: list[Trace]
    axis: dict[str, Any] = field(default_factory=dict)
    weight: float = 1.0  # share of the height


def panels(
    name: str,
    title: str,
    height_px: int,
    content: Sequence[Panel],
    time: TimeAxis,
    note: str = "",
) -> Chart:
    """Panels above each other."""
    gap = 22.0 / height_px
    unit = (1.0 - gap * (len(content) - 1)) / sum(panel.weight for panel in content)
    top = 1.0
    layout: dict[str, Any] = {}
    traces: list[Trace] = []
    named: set[str] = set()
    for number, panel in enumerate(content, start=1):
        axis = "y" if number == 1 else f"y{number}"
        bottom = max(top - unit * panel.weight, 0.0)
        layout["yaxis" + axis[1:]] = {
            "title": {"text": panel.title, "standoff": 6},
            "domain": [bottom, top],
            **panel.axis,
        }
        top = bottom - gap
        for trace in panel.traces:
            # One entry of the legend switches a line on and off in every panel.
            shown = trace.get("showlegend", True) and trace["name"] not in named
            if shown:
                named.add(trace["name"])
            grouped = {"legendgroup": trace["name"], "showlegend": shown}
            traces.append({**trace, "yaxis": axis, **grouped})
    layout["xaxis"] = {**time_axis(time), "anchor": axis}
    layout["hovermode"] = "x"
    layout["shapes"] = [
        {
            "type": "line",
            "layer": "below",
            "xref": "x",
            "yref": "paper",
            "x0": round(time_s, 3),
            "x1": round(time_s, 3),
            "y0": 0,
            "y1": 1,
            "line": {"color": FAINT, "width": 1, "dash": "dot"},
        }
        for time_s in time.marks_s
    ]
    return Chart(name, title, height_px, traces, layout, note)


def time_axis(time: TimeAxis) -> dict[str, Any]:
    """For a layout."""
    return {
        "title": {"text": "time since power-up, s"},
        "range": [round(time.begin_s, 3), round(time.end_s, 3)],
    }


def line(
    name: str, x: Array, y: Array, color: str, width: float = 1.5, dash: str = "solid"
) -> Trace:
    """A line over time, thinned without losing its peaks."""
    keep = thinned(y)
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": encoded(x[keep]),
        "y": encoded(y[keep]),
        "line": {"color": color, "width": width, "dash": dash},
    }


def band(name: str, x: Array, half_width: Array) -> list[Trace]:
    """The area between -half_width and +half_width."""
    keep = thinned(half_width, LINE_POINTS // 2)
    edge = {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": encoded(x[keep]),
        "line": {"color": ESTIMATE, "width": 0.6},
        "hoverinfo": "skip",
    }
    lower = {**edge, "y": encoded(-half_width[keep]), "showlegend": False}
    upper = {**edge, "y": encoded(half_width[keep]), "fill": "tonexty", "fillcolor": BAND}
    return [lower, upper]


def level(name: str, time: TimeAxis, value: float, color: str = ALARM) -> Trace:
    """A limit, across the whole time."""
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": [round(time.begin_s, 3), round(time.end_s, 3)],
        "y": [value, value],
        "line": {"color": color, "width": 1.2, "dash": "dash"},
        "hoverinfo": "skip",
    }


def dots(name: str, x: Array, y: Array, color: str) -> Trace:
    """Single measurements."""
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": encoded(x),
        "y": encoded(y),
        "marker": {"color": color, "size": 4, "opacity": 0.7},
    }


def thinned(values: Array, points: int = LINE_POINTS) -> NDArray[np.int_]:
    """Indices of at most `points` values that draw the same line: lowest and highest of each of
    equal stretches, first and last.
    """
    if len(values) <= points:
        return np.arange(len(values))
    stretches = (points - 2) // 2
    size = -(-len(values) // stretches)
    padded = np.full(size * stretches, np.nan)
    padded[: len(values)] = values
    rows = padded.reshape(stretches, size)
    low = np.argmin(np.where(np.isnan(rows), np.inf, rows), axis=1)
    high = np.argmax(np.where(np.isnan(rows), -np.inf, rows), axis=1)
    begin = np.arange(stretches) * size
    indices = np.concatenate([[0, len(values) - 1], begin + low, begin + high])
    return np.unique(indices[indices < len(values)])


def encoded(values: Array) -> Mapping[str, str]:
    """Numbers as Plotly reads them from text, single precision; not a number is a gap."""
    single = np.ascontiguousarray(values, dtype="<f4")
    return {"dtype": "f4", "bdata": base64.b64encode(single.tobytes()).decode()}
