"""The page: words, tiles and sections around the charts, and the file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template

from plotly.offline import get_plotlyjs

from strix.comparison import Comparison
from strix.errors import BadInput
from strix.flightlog import FlightLog, Message
from strix.report import flight_charts, machine_charts, track_charts
from strix.report.charts import Chart, TimeAxis
from strix.report.names import esc_limits
from strix.summary import ROWS, Summary, rating, shown, verdict
from strix.track import TruthTrack

# What the log says of itself, and the word before it.
INFO = {"vehicle": "", "ver_hw": "", "ver_sw": "version ", "ver_sw_git": "commit "}
ONLY_SIMULATED = ("wall_s", "rms_attitude_deg", "rms_position_m")
LEVEL_STYLES = {
    "emergency": "bad",
    "alert": "bad",
    "critical": "bad",
    "error": "bad",
    "warning": "warn",
}


@dataclass(frozen=True)
class Section:
    """A heading, what is to be seen, and the charts."""

    name: str
    title: str
    text: str
    charts: Sequence[Chart]
    column_rem: int = 30  # charts stand beside each other while each has this width
    words: str = ""  # HTML after the charts


def write_report(path: Path, log: FlightLog, truth: TruthTrack | None, summary: Summary) -> None:
    """Write the report: a page that needs no other file and no network."""
    flight = Comparison(log, truth)
    sections = _sections(flight)
    charts = [chart.to_dict() for section in sections for chart in section.charts]
    page = Template(files("strix.report").joinpath("page.html").read_text(encoding="utf-8"))
    text = page.substitute(
        title=escape(f"Flight report: {log.path.name}"),
        body=_head(flight, summary) + "".join(map(_section, sections)),
        plotly=get_plotlyjs(),
        # '<' could end the script element.
        charts=json.dumps(charts, allow_nan=False).replace("<", "\\u003c"),
    )
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadInput(
            f"{path}: expected a file that can be written, found: {error.strerror}"
        ) from None


def _sections(flight: Comparison) -> list[Section]:
    changes_s = [begin for begin, *_ in flight_charts.state_spans(flight)[1:]]
    time = TimeAxis(flight.log.begin_s, flight.log.end_s, changes_s)
    simulated = flight.truth is not None
    truth = ", the truth (what the simulated aircraft really did) in grey" if simulated else ""
    return [
        Section(
            "track",
            "Track",
            "Where the aircraft went while its motors were on; both views have the same scale on "
            f"both axes. The estimate is blue, the reference it was to follow orange{truth}.",
            track_charts.tracks(flight),
        ),
        Section(
            "states",
            "Flight states",
            "Which state the flight software was in. Dotted lines in the charts below mark the "
            "same changes.",
            [flight_charts.timeline(flight, time)],
            words=_messages(flight.log.messages),
        ),
        Section(
            "following",
            "Position and attitude",
            "The reference is drawn while it is followed: in flight with the controller on. Roll "
            "is positive to the right, pitch nose up, yaw clockwise from north.",
            [flight_charts.position(flight, time), flight_charts.attitude(flight, time)],
        ),
        Section(
            "errors",
            "Estimate minus truth" if simulated else "Uncertainty of the estimate",
            "The band is three times the standard deviation that the filter claims (sigma); roll, "
            "pitch and yaw here are small turns about the body's own axes"
            + (
                ". An honest filter's error is inside it about 99.7 % of the time."
                if simulated
                else ". Without a simulation there is no truth to compare with."
            ),
            flight_charts.errors(flight, time),
            column_rem=22,
        ),
        Section(
            "motors",
            "Motors",
            "M1 to M4 as in the vehicle's file. Where 'given' leaves 'asked', the motors could "
            "not do what the controller wanted.",
            machine_charts.motors(flight, esc_limits(flight.log), time),
        ),
        Section(
            "nis",
            "Measurements against expectation",
            "NIS (normalised innovation squared) is the square of measured minus expected, divided "
            "by the variance that the filter expects of it. An honest filter has a mean of 1 and "
            f"99 % below {machine_charts.NIS_GATE}; a mean far below 1 says that it trusts the "
            "sensor less than it could. What is above the bound is rejected. Very high values are "
            "drawn at the upper edge; of many dots only a part is drawn, evenly chosen.",
            machine_charts.innovations(flight, time),
        ),
        Section(
            "software",
            "Loop and log",
            "One pass of the flight software's loop, the time between two control ticks, and the "
            "log on its card.",
            machine_charts.software(flight, time),
        ),
    ]


def _head(flight: Comparison, summary: Summary) -> str:
    log = flight.log
    info = [before + log.info[key] for key, before in INFO.items() if key in log.info]
    good = "good" if summary.landed and summary.disarmed else "bad"
    subject = escape(" · ".join(["Strix flight report", *info, str(log.path.name)]))
    parts = [
        f'<header><div class="soft">{subject}</div>',
        f'<h1 class="{good}">{escape(verdict(summary))}</h1>',
    ]
    if log.damaged:
        parts.append('<p class="warn">The log is damaged or cut: what is missing is not shown.</p>')
    parts.append('<dl class="tiles">')
    for row in ROWS:
        if flight.truth is None and row.key in ONLY_SIMULATED:
            continue
        value = escape(" ".join(shown(row, summary)))
        parts.append(
            f'<div><dt>{row.name}</dt><dd><span class="value {rating(row, summary)}">{value}</span>'
            f'<br><span class="meaning">{escape(row.meaning)}</span></dd></div>'
        )
    return "".join([*parts, "</dl></header>\n"])


def _section(section: Section) -> str:
    content = "".join(map(_figure, section.charts)) + section.words
    return (
        f'<section id="section-{section.name}"><h2>{escape(section.title)}</h2>'
        f'<p class="soft">{escape(section.text)}</p>'
        f'<div class="charts" style="--column:{section.column_rem}rem">{content}</div></section>\n'
    )


def _figure(chart: Chart) -> str:
    note = f"<figcaption>{escape(chart.note)}</figcaption>" if chart.note else ""
    return (
        f"<figure><h3>{escape(chart.title)}</h3>"
        f'<div id="{chart.name}" style="height:{chart.height_px}px"></div>{note}</figure>'
    )


def _messages(messages: Sequence[Message]) -> str:
    rows = "".join(
        f"<tr><td>{m.time_s:.2f} s</td>"
        f'<td class="{LEVEL_STYLES.get(m.level, "")}">{escape(m.text)}</td></tr>'
        for m in messages
    )
    return f'<div class="words"><table>{rows}</table></div>' if rows else ""
