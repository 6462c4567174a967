"""The page of `strix consistency`: every series over time, with its bounds."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template

import numpy as np
from plotly.offline import get_plotlyjs

from strix.consistency import Consistency, Judgement
from strix.report.charts import ALARM, ESTIMATE, Chart, Panel, TimeAxis, level, line, panels

EXPLANATION = (
    "Mean over all flights, once a second, divided by the degrees of freedom: 1 is right. NEES "
    "weighs the true error with the covariance that the filter claims; above 1 it claims too "
    "much. NIS does the same with each measurement. A consistent filter keeps 95 % of the seconds "
    "between the dashed bounds. strix/consistency.py says what is flown and how it is judged."
)


def write_page(path: Path, found: Consistency) -> None:
    """A page that needs no other file and no network."""
    drawn = charts(found)
    page = Template(files("strix.report").joinpath("page.html").read_text(encoding="utf-8"))
    text = page.substitute(
        title="Consistency of the flight filter",
        body=_head(found) + "".join(map(_figure, drawn)) + "</div>",
        plotly=get_plotlyjs(),
        # '<' could end the script element.
        charts=json.dumps([chart.to_dict() for chart in drawn]).replace("<", "\\u003c"),
    )
    path.write_text(text, encoding="utf-8")


def charts(found: Consistency) -> list[Chart]:
    """One for each filter and kind of flight."""
    cases = dict.fromkeys(row.case for row in found.judgements)
    return [
        _chart(f"case{number}", [row for row in found.judgements if row.case == case])
        for number, case in enumerate(cases)
    ]


def _chart(name: str, rows: Sequence[Judgement]) -> Chart:
    """All series of one filter in one kind of flight."""
    seconds = np.arange(1.0, len(rows[0].each_second) + 1.0)
    time = TimeAxis(0.0, float(seconds[-1]), [])
    content = []
    for row in rows:
        low, high = row.bounds_95
        mean = line("mean over flights", seconds, np.array(row.each_second), ESTIMATE)
        bounds = [level("95 % bounds", time, bound, ALARM) for bound in (low, high)]
        content.append(Panel(row.name, [mean, bounds[0], {**bounds[1], "showlegend": False}]))
    chart = panels(name, rows[0].case, 40 + 130 * len(rows), content, time)
    chart.layout["xaxis"]["title"] = {"text": "time since the start of the flight, s"}
    return chart


def _head(found: Consistency) -> str:
    style, word = ("good", "Consistent") if found.consistent else ("bad", "Not consistent")
    return (
        f'<header><div class="soft">{found.flights} simulated flights of {found.flight_s} s each, '
        f'seed {found.seed}</div><h1 class="{style}">{word}: 9- and 18-state filter</h1></header>'
        f'<p class="soft">{escape(EXPLANATION)}</p><div class="words"><table>'
        + "".join(_rows(found))
        + '</table></div><div class="charts" style="--column:30rem;margin-top:0.8rem">'
    )


def _rows(found: Consistency) -> Iterator[str]:
    for row in found.judgements:
        low, high = row.mean_95
        yield (
            f"<tr><td>{row.case}</td><td>{row.name}</td><td>mean {row.mean:.4f}, 95 % bounds "
            f"{low:.4f} to {high:.4f}</td><td>{row.inside:.0%} of the seconds inside, "
            f"{row.inside_needed:.0%} needed</td><td>{_verdict(row.consistent)}</td></tr>"
        )
    for run in found.endurance:
        definite = run.not_positive_definite == 0
        yield (
            f"<tr><td>{run.states} states, {run.hours:g} h</td><td>P</td><td>smallest eigenvalue "
            f"of the correlation matrix {run.smallest_eigenvalue:.1e}</td><td>positive definite at "
            f"{run.looks - run.not_positive_definite} of {run.looks} looks</td>"
            f"<td>{_verdict(definite)}</td></tr>"
        )


def _verdict(good: bool) -> str:
    return '<span class="good">yes</span>' if good else '<span class="bad">NO</span>'


def _figure(chart: Chart) -> str:
    return (
        f"<figure><h3>{escape(chart.title)}</h3>"
        f'<div id="{chart.name}" style="height:{chart.height_px}px"></div></figure>'
    )
