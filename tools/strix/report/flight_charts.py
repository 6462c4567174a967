"""Charts of the flight over time: its states, how it followed the reference and knew itself."""

from __future__ import annotations

import numpy as np

from strix.attitude import roll_pitch_yaw, wrap
from strix.comparison import Comparison, Errors, interpolate
from strix.flightlog import Array
from strix.report.charts import (
    ALARM,
    ESTIMATE,
    REFERENCE,
    STATES,
    TRUTH,
    Chart,
    Panel,
    TimeAxis,
    Trace,
    band,
    line,
    panels,
    time_axis,
)
from strix.report.names import state_name


def state_spans(flight: Comparison) -> list[tuple[float, float, int, bool]]:
    """Begin and end in s, state's number and whether it followed a critical error."""
    time_s, state = flight.states.time_s, flight.states["state"].astype(int)
    first = np.flatnonzero(np.diff(state, prepend=-1))
    end_s = [*time_s[first[1:]], time_s[-1]]
    critical = flight.states["critical"]
    return [
        (float(time_s[i]), float(end), int(state[i]), bool(critical[i]))
        for i, end in zip(first, end_s, strict=True)
    ]


def timeline(flight: Comparison, time: TimeAxis) -> Chart:
    """One row a state, in the order they first came, and the messages above them."""
    spans = state_spans(flight)
    names = list(dict.fromkeys(state_name(state) for _, _, state, _ in spans))
    bars: Trace = {
        "type": "bar",
        "orientation": "h",
        "name": "state",
        "showlegend": False,
        "base": [begin for begin, _, _, _ in spans],
        "x": [end - begin for begin, end, _, _ in spans],
        "y": [state_name(state) for _, _, state, _ in spans],
        "marker": {
            "color": [
                ALARM if critical else STATES[state % len(STATES)]
                for _, _, state, critical in spans
            ]
        },
        "customdata": [f"{begin:.2f} to {end:.2f} s" for begin, end, _, _ in spans],
        "hovertemplate": "%{y}, %{customdata}<extra></extra>",
    }
    messages: Trace = {
        "type": "scatter",
        "mode": "markers",
        "name": "message",
        "showlegend": False,
        "x": [message.time_s for message in flight.log.messages],
        "y": ["message"] * len(flight.log.messages),
        "text": [message.text for message in flight.log.messages],
        "hovertemplate": "%{x:.2f} s: %{text}<extra></extra>",
        "marker": {"symbol": "diamond", "size": 9, "color": TRUTH},
    }
    layout = {
        "xaxis": time_axis(time),
        "yaxis": {
            "type": "category",
            "categoryorder": "array",
            "categoryarray": ["message", *names],
            "autorange": "reversed",
        },
        "bargap": 0.25,
        "hovermode": "closest",
    }
    return Chart(
        "timeline", "States of the flight", 90 + 32 * (len(names) + 1), [bars, messages], layout
    )


def position(flight: Comparison, time: TimeAxis) -> Chart:
    """North, east and height over time."""
    followed = flight.following(flight.reference.time_s)[:, None]
    reference = np.where(followed, flight.reference["position"], np.nan)
    rows = []
    for column, (title, sign) in enumerate((("north, m", 1), ("east, m", 1), ("height, m", -1))):
        traces = [
            line(
                "estimate",
                flight.estimate.time_s,
                sign * flight.estimate.position_ned_m[:, column],
                ESTIMATE,
            ),
            line(
                "reference",
                flight.reference.time_s,
                sign * reference[:, column],
                REFERENCE,
                dash="dash",
            ),
        ]
        if flight.truth is not None:
            truth = sign * flight.truth.position_ned_m[:, column]
            traces.insert(0, line("truth", flight.truth.time_s, truth, TRUTH, 4))
        rows.append(Panel(title, traces))
    return panels("position", "Position", 520, rows, time)


def attitude(flight: Comparison, time: TimeAxis) -> Chart:
    """Roll, pitch and yaw over time. Yaw is drawn without jumps between -180 and 180 deg."""
    time_s = flight.estimate.time_s
    estimate = roll_pitch_yaw(flight.estimate.attitude)
    estimate[:, 2] = np.unwrap(estimate[:, 2])

    def beside(at_s: Array, q: Array) -> Array:
        angles = roll_pitch_yaw(q)
        near = interpolate(at_s, time_s, estimate[:, 2:])[:, 0]
        angles[:, 2] = near + wrap(angles[:, 2] - near)
        return np.asarray(np.degrees(angles))

    curves = [("estimate", time_s, np.degrees(estimate), ESTIMATE, 1.5, "solid")]
    if flight.log.has("vehicle_attitude_setpoint"):
        wanted = flight.log.topic("vehicle_attitude_setpoint")
        followed = flight.following(wanted.time_s)[:, None]
        angles = np.where(followed, beside(wanted.time_s, wanted["q_d"]), np.nan)
        curves.append(("reference", wanted.time_s, angles, REFERENCE, 1.5, "dash"))
    if flight.truth is not None:
        angles = beside(flight.truth.time_s, flight.truth.attitude)
        curves.insert(0, ("truth", flight.truth.time_s, angles, TRUTH, 4, "solid"))
    rows = [
        Panel(
            f"{title}, deg",
            [
                line(name, at_s, angles[:, column], color, width, dash)
                for name, at_s, angles, color, width, dash in curves
            ],
        )
        for column, title in enumerate(("roll", "pitch", "yaw"))
    ]
    return panels("attitude", "Attitude", 520, rows, time)


ERROR_CHARTS = (
    ("error-position", "Position", ("north, m", "east, m", "down, m"), 1.0),
    ("error-velocity", "Velocity", ("north, m/s", "east, m/s", "down, m/s"), 1.0),
    ("error-attitude", "Attitude", ("roll, deg", "pitch, deg", "yaw, deg"), 180.0 / np.pi),
)


def errors(flight: Comparison, time: TimeAxis) -> list[Chart]:
    """Estimate minus truth in the filter's own bounds; only the bounds for a real flight."""
    if not flight.log.has("estimator_std"):
        return []
    std = flight.log.topic("estimator_std")
    known = std.time_s >= flight.estimator_start_s
    time_s, sigma = std.time_s[known], std["std_dev"][known]
    charts = []
    for group, (name, title, axes, scale) in enumerate(ERROR_CHARTS):
        rows = []
        inside: list[float] = []
        for axis, axis_title in enumerate(axes):
            bound = 3.0 * scale * sigma[:, 3 * group + axis]
            traces = band("±3 sigma", time_s, bound)
            top = _largest(flight, time_s, bound)
            if flight.errors is not None:
                error_s = flight.errors.time_s
                error = scale * _error_columns(flight.errors, group)[:, axis]
                traces.append(line("estimate - truth", error_s, error, ESTIMATE))
                inside.append(float(np.mean(np.abs(error) <= np.interp(error_s, time_s, bound))))
                top = max(top, _largest(flight, error_s, error))
            rows.append(Panel(axis_title, traces, {"range": [-1.15 * top, 1.15 * top]}))
        note = f"Inside {100.0 * np.mean(inside):.1f} % of the time." if inside else ""
        charts.append(panels(name, title, 520, rows, time, note))
    return charts


def _largest(flight: Comparison, time_s: Array, values: Array) -> float:
    """While the motors are on, if they ever are: the start may be far more uncertain."""
    on = flight.flag("motors_on", time_s)
    chosen = np.abs(values[on] if on.any() else values)
    return float(chosen.max()) if len(chosen) and np.isfinite(chosen).all() else 1.0


def _error_columns(errors: Errors, group: int) -> Array:
    return (errors.position_ned_m, errors.velocity_ned_m_s, errors.attitude_rad)[group]
