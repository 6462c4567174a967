"""Charts of where the aircraft went: from above and from the side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from strix.comparison import Comparison, Track
from strix.flightlog import Array
from strix.report.charts import ESTIMATE, FAINT, FOUR, REFERENCE, TRUTH, Chart, Trace, encoded

LINE_POINTS = 1500  # of one track at most


@dataclass(frozen=True)
class _Path:
    name: str
    position_ned_m: Array
    style: dict[str, Any]


@dataclass(frozen=True)
class _Places:
    name: str
    position_ned_m: Array
    style: dict[str, Any]
    labels: Sequence[str] = field(default=("",))


def tracks(flight: Comparison) -> list[Chart]:
    """Both views, while the motors were on; the side view along the way to the farthest point."""
    paths = _paths(flight)
    places = _places(flight)
    everything = np.concatenate([path.position_ned_m for path in paths] + [np.zeros((1, 3))])
    everything = everything[np.isfinite(everything).all(axis=1)]  # no place: it is not estimated
    farthest = everything[np.argmax(np.linalg.norm(everything[:, :2], axis=1))]
    bearing_rad = float(np.arctan2(farthest[1], farthest[0]))
    bearing_deg = round(np.degrees(bearing_rad)) % 360
    away = [np.cos(bearing_rad), np.sin(bearing_rad), 0.0]
    from_above = _chart(
        "track-above",
        "From above",
        ("east of the start, m", "north of the start, m"),
        _traces(paths, places, np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])),
    )
    from_the_side = _chart(
        "track-side",
        "From the side",
        (f"distance from the start towards {bearing_deg:03d} deg, m", "height, m"),
        _traces(paths, places, np.array([away, [0.0, 0.0, -1.0]])),
    )
    from_the_side.layout["shapes"] = [_ground()]
    return [from_above, from_the_side]


def _paths(flight: Comparison) -> list[_Path]:
    def flown(track: Track) -> Array:
        return track.position_ned_m[flight.flag("motors_on", track.time_s)]

    followed = flight.following(flight.reference.time_s)
    paths = [
        _Path(
            "reference",
            flight.reference["position"][followed],
            {"color": REFERENCE, "width": 1.5, "dash": "dash"},
        ),
        _Path("estimate", flown(flight.estimate), {"color": ESTIMATE, "width": 1.5}),
    ]
    if flight.truth is not None:
        paths.insert(0, _Path("truth", flown(flight.flown), {"color": TRUTH, "width": 4}))
    return paths


def _places(flight: Comparison) -> list[_Places]:
    waypoints = _waypoints(flight)
    numbers = [str(i + 1) for i in range(len(waypoints))]
    end = flight.flown.position_ned_m[-1:]
    return [
        _Places("start", np.zeros((1, 3)), _marker("circle-open", 14, FOUR[2])),
        _Places("waypoint", waypoints, _marker("square-open", 12, REFERENCE), numbers),
        _Places("end", end, _marker("x", 9, FOUR[3])),
    ]


def _waypoints(flight: Comparison) -> Array:
    """Places away from the start at which the reference rests, in the order they were reached."""
    followed = flight.following(flight.reference.time_s)
    at_rest = np.linalg.norm(flight.reference["velocity"], axis=1) < 1e-3
    found = [np.zeros(3)]
    for ned in flight.reference["position"][followed & at_rest]:
        if min(np.linalg.norm(ned[:2] - other[:2]) for other in found) > 0.5:
            found.append(ned)
    return np.array(found[1:]).reshape(-1, 3)


def _traces(paths: Sequence[_Path], places: Sequence[_Places], axes: Array) -> list[Trace]:
    """Projected: the rows of `axes` are the drawing's x and y in NED."""
    traces: list[Trace] = []
    for path in paths:
        step = len(path.position_ned_m) // LINE_POINTS + 1
        x, y = axes @ path.position_ned_m[::step].T
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": path.name,
                "x": encoded(x),
                "y": encoded(y),
                "line": path.style,
            }
        )
    for place in places:
        x, y = axes @ place.position_ned_m.T
        traces.append(
            {
                "type": "scatter",
                "mode": "markers+text",
                "name": place.name,
                "x": encoded(x),
                "y": encoded(y),
                "text": list(place.labels),
                "textposition": "top right",
                "marker": place.style,
            }
        )
    return [{**trace, "hovertemplate": "%{x:.2f}, %{y:.2f} m"} for trace in traces]


def _chart(name: str, title: str, axes: tuple[str, str], traces: list[Trace]) -> Chart:
    layout = {
        "xaxis": {"title": {"text": axes[0]}},
        "yaxis": {"title": {"text": axes[1]}, "scaleanchor": "x", "scaleratio": 1},
        "hovermode": "closest",
    }
    return Chart(name, title, 440, traces, layout)


def _ground() -> dict[str, Any]:
    across = {"xref": "paper", "x0": 0, "x1": 1, "y0": 0, "y1": 0}
    return {"type": "line", "layer": "below", **across, "line": {"color": FAINT, "width": 2}}


def _marker(symbol: str, size: int, color: str) -> dict[str, Any]:
    return {"symbol": symbol, "size": size, "color": color, "line": {"width": 2, "color": color}}
