"""Charts of the machine: motors, sensors, the loop and the log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from strix.comparison import Comparison
from strix.flightlog import Array, Topic
from strix.report.charts import (
    ALARM,
    ESTIMATE,
    FOUR,
    REFERENCE,
    TRUTH,
    Chart,
    Panel,
    TimeAxis,
    Trace,
    dots,
    level,
    line,
    panels,
)
from strix.report.names import EscLimits

NIS_GATE = 6.635  # chi-square, 1 degree of freedom, 99 %
NIS_TOP = 12.0  # what lies above is drawn at the edge
NIS_DOTS = 900  # of one component at most, besides the rejected ones

# Instances of estimator_aid_source (lib/Logger/DataTypes.h, AidSource) and their components.
AID_SOURCES = (
    ("tilt", "Tilt (accelerometer)", ("x", "y", "z")),
    ("magnetometer", "Magnetometer", ("x", "y", "z")),
    ("altimeter", "Altimeter", ("height",)),
    ("gps", "GPS", ("north", "east", "speed north", "speed east")),
)


def motors(flight: Comparison, limits: EscLimits | None, time: TimeAxis) -> list[Chart]:
    """Commands to the ESCs, and what the controller asked of them and got."""
    charts = []
    if flight.log.has("actuator_outputs"):
        charts.append(_commands(flight, limits, time))
    if flight.log.has("wrench_setpoint") and flight.log.has("wrench_achieved"):
        charts.append(_wrench(flight, time))
    return charts


def _commands(flight: Comparison, limits: EscLimits | None, time: TimeAxis) -> Chart:
    topic = flight.log.topic("actuator_outputs")
    commands = topic["output"]
    finite = commands[np.isfinite(commands)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    unit, note = "", ""
    if limits is not None:
        low, high = min(low, limits.off), max(high, limits.flight_max)
        unit = f", {limits.unit}" if limits.unit else ""
        controlled = commands[flight.flag("controller_on", topic.time_s)]
        full = np.any(controlled >= limits.flight_max - 0.5, axis=1)
        share = _share(int(full.sum()), len(full))
        note = f"A motor was at its limit {share} of the time under control."
        if not full.any():
            note = "No motor reached its limit."
    margin = 0.06 * (high - low) + 1.0
    rows = []
    for motor in range(commands.shape[1]):
        traces = [line("command", topic.time_s, commands[:, motor], ESTIMATE, 1.2)]
        if limits is not None:
            traces.append(level("limit in flight", time, limits.flight_max))
            traces.append(level("motor off", time, limits.off, TRUTH))
        axis = {"range": [low - margin, high + margin]}
        rows.append(Panel(f"M{motor + 1}{unit}", traces, axis))
    return panels("motors", "Commands to the motors", 560, rows, time, note)


def _wrench(flight: Comparison, time: TimeAxis) -> Chart:
    asked, given = flight.log.topic("wrench_setpoint"), flight.log.topic("wrench_achieved")
    asked_for, given_back = _controlled(flight, asked), _controlled(flight, given)
    rows = [
        Panel(
            title,
            [
                line("asked", asked.time_s, asked_for[:, column], REFERENCE, 4),
                line("given", given.time_s, given_back[:, column], ESTIMATE, 1.2),
            ],
        )
        for column, title in enumerate(("thrust, N", "roll, N m", "pitch, N m", "yaw, N m"))
    ]
    return panels("wrench", "Thrust and torques", 560, rows, time)


def _controlled(flight: Comparison, wrench: Topic) -> Array:
    """Thrust and torques while the controller is on, not a number else."""
    on = flight.flag("controller_on", wrench.time_s)[:, None]
    return np.where(on, np.column_stack([wrench["thrust"], wrench["torque"]]), np.nan)


def innovations(flight: Comparison, time: TimeAxis) -> list[Chart]:
    """How far each measurement lay from what the filter expected, in its own measure."""
    charts = []
    for instance, (name, title, components) in enumerate(AID_SOURCES):
        if flight.log.has("estimator_aid_source", instance):
            aid = flight.log.topic("estimator_aid_source", instance)
            charts.append(_nis(name, title, components, aid, flight.estimator_start_s, time))
    return charts


def _nis(
    name: str,
    title: str,
    components: Sequence[str],
    aid: Topic,
    start_s: float,
    time: TimeAxis,
) -> Chart:
    traces: list[Trace] = []
    used = 0
    accepted_sum = 0.0
    refusals: list[tuple[float, float, str]] = []  # time, NIS, component
    for i, component in enumerate(components):
        there = (aid["count"] > i) & (aid.time_s >= start_s)
        time_s, nis = aid.time_s[there], aid["nis"][there, i]
        refused = (aid["rejected"][there].astype(int) >> i) & 1 == 1
        used += len(nis)
        accepted_sum += float(nis[~refused].sum())
        drawn = np.flatnonzero(~refused)[:: len(nis) // NIS_DOTS + 1]
        traces.append(dots(component, time_s[drawn], nis[drawn], FOUR[i]))
        refusals += [(t, n, component) for t, n in zip(time_s[refused], nis[refused], strict=True)]
    if not used:
        return panels(
            f"nis-{name}", title, 300, [Panel("NIS", [])], time, "No measurement was used."
        )
    if refusals:
        traces.append(_rejected(refusals[:: len(refusals) // NIS_DOTS + 1]))
    traces.append(level("99 % bound", time, NIS_GATE))
    accepted = used - len(refusals)
    note = f"{_share(accepted, used)} of {used} accepted"
    if accepted:
        note += f"; their mean is {accepted_sum / accepted:.2g}"
    axis = {"range": [0.0, NIS_TOP * 1.03]}
    return panels(f"nis-{name}", title, 300, [Panel("NIS", traces, axis)], time, note + ".")


def _rejected(refusals: Sequence[tuple[float, float, str]]) -> Trace:
    time_s, nis, _ = (np.array(column) for column in zip(*refusals, strict=True))
    return {
        **dots("rejected", time_s, np.minimum(nis, NIS_TOP), ALARM),
        "marker": {"color": ALARM, "size": 5, "symbol": "x"},
        "text": [f"{component}, NIS {value:.1f}" for _, value, component in refusals],
        "hovertemplate": "%{text}",
    }


def software(flight: Comparison, time: TimeAxis) -> list[Chart]:
    """Time of the loop, and the log on its card."""
    tick, status = flight.log.topic("control_tick"), flight.log.topic("log_status")
    period_us = np.diff(tick.time_s, prepend=np.nan) * 1e6
    loop = [
        Panel("pass, µs", [line("pass", tick.time_s, tick["pass_us"], ESTIMATE, 1.2)]),
        Panel("period, µs", [line("period", tick.time_s, period_us, REFERENCE, 1.2)]),
    ]
    seconds = np.diff(status.time_s)
    rate = np.diff(status["bytes"]) / np.where(seconds > 0.0, seconds, np.nan) / 1000.0
    log = [
        Panel("written, kB/s", [line("rate", status.time_s[1:], rate, ESTIMATE)]),
        Panel("lost, records", [line("lost", status.time_s, status["dropped"], ALARM)]),
    ]
    for row in (*loop, *log):
        row.traces[0]["showlegend"] = False
        row.axis["rangemode"] = "tozero"
    last = {
        field: int(status[field][-1]) for field in ("bytes", "longest_stall_us", "write_errors")
    }
    return [
        panels(
            "loop",
            "Loop",
            320,
            loop,
            time,
            f"{int(tick['overruns'][-1])} task periods missed; "
            f"median control period {np.nanmedian(period_us):.0f} µs.",
        ),
        panels(
            "log",
            "Log",
            320,
            log,
            time,
            f"{last['bytes'] / 1e6:.1f} MB written, {last['write_errors']} write errors; the "
            f"card kept data waiting for {last['longest_stall_us'] / 1000:.1f} ms at most.",
        ),
    ]


def _share(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.1f} %" if whole else "0 %"
