"""campaign.html: one page that needs no other file, no network and no script."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path

from strix.campaign.flight import Result
from strix.campaign.run import Campaign
from strix.campaign.table import (
    CRITERIA,
    NOT_JUDGED,
    WORST,
    by_badness,
    command,
    rows,
    sentence,
    speed,
)

_STYLE = """
:root { --page: #f4f5f7; --card: #fff; --ink: #1c2530; --soft: #5c6773; --edge: #dfe3e8;
  --good: #11784f; --bad: #c92a2a; --height: #1f6fb2; --distance: #b26a00; }
@media (prefers-color-scheme: dark) { :root { --page: #12161c; --card: #1a2028; --ink: #e4e8ed;
  --soft: #97a2af; --edge: #2b333e; --good: #3fc38b; --bad: #ff6b6b; --height: #5eb1f3;
  --distance: #e6b04a; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem clamp(0.6rem, 2.5vw, 2rem) 3rem; max-width: 74rem;
  background: var(--page); color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.6rem; margin: 0 0 0.3rem; } h2 { font-size: 1.15rem; margin: 2rem 0 0.4rem; }
h3 { font-size: 0.95rem; margin: 0; }
.soft { color: var(--soft); font-size: 0.87rem; } .good { color: var(--good); }
.bad { color: var(--bad); } p { max-width: 62rem; margin: 0.2rem 0 0.6rem; }
.card { background: var(--card); border: 1px solid var(--edge); border-radius: 8px;
  padding: 0.7rem 0.9rem; margin: 0 0 0.8rem; overflow-x: auto; }
table { border-collapse: collapse; } td, th { padding: 0.12rem 1.4rem 0.12rem 0; text-align: right;
  font-variant-numeric: tabular-nums; }
th { font-weight: 600; border-bottom: 1px solid var(--edge); }
td:first-child, th:first-child, td:last-child { text-align: left; }
code { background: var(--page); padding: 0.1rem 0.35rem; border-radius: 4px; }
.flight { display: grid; gap: 0.2rem 1.2rem;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, 24rem), 1fr)); }
svg { width: 100%; max-width: 44rem; height: auto; display: block; }
svg text { fill: var(--soft); font: 11px system-ui, sans-serif; }
"""
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 640.0, 150.0, 40.0, 8.0, 16.0, 20.0


def write_page(path: Path, campaign: Campaign) -> None:
    style = "good" if campaign.passes else "bad"
    settings = campaign.settings
    worst = by_badness(campaign.flights)[:WORST]
    body = [
        f'<h1 class="{style}">Fault campaign: {escape(sentence(campaign))}</h1>',
        f'<p class="soft">Seed {settings.seed}, software {settings.software}.</p>',
        f"<p>{escape(CRITERIA)}</p>",
        '<div class="card"><table><tr><th>fault</th><th>flights</th><th>passed</th>'
        "<th>hardest contact, m/s</th><th>furthest beyond the fence, m</th><th></th></tr>",
        *_table(campaign.flights),
        "</table></div>",
        f"<h2>The worst {len(worst)}</h2>",
        '<p class="soft">Height (blue) and distance from the start (orange), m, over time, s; the '
        "fault begins at the dashed line.</p>",
        *(_flight(campaign, flight) for flight in worst),
    ]
    path.write_text(
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark">'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        "style-src 'unsafe-inline'\">"
        f"<title>Fault campaign</title><style>{_STYLE}</style></head><body>"
        + "\n".join(body)
        + "</body></html>\n",
        encoding="utf-8",
    )


def _table(flights: Sequence[Result]) -> Iterator[str]:
    for row in rows(flights):
        style = "good" if row.passed == row.flights else "bad"
        yield (
            f'<tr><td>{row.fault}</td><td>{row.flights}</td><td class="{style}">{row.passed}</td>'
            f"<td>{speed(row)}</td><td>{row.beyond_m:.1f}</td>"
            f'<td class="soft">{"" if row.judged else NOT_JUDGED}</td></tr>'
        )


def _flight(campaign: Campaign, flight: Result) -> str:
    verdict = (
        '<span class="good">passes</span>'
        if flight.passes
        else f'<span class="bad">{escape("; ".join(flight.failures))}</span>'
    )
    contact = "none" if flight.contact_m_s is None else f"{flight.contact_m_s:.2f} m/s"
    said = "<br>".join(escape(text) for text in flight.said) or "nothing"
    return (
        f'<div class="card"><h3>{flight.fault}: {escape(flight.detail)}</h3>'
        f'<p class="soft">flight {flight.index}, {flight.mission}, fault at {flight.at_s:.1f} s, '
        f"wind {flight.wind_m_s:.1f} m/s, ended in {flight.state}; contact {contact}, "
        f'{flight.fence}; {verdict}</p><div class="flight">{_picture(flight)}'
        f'<p class="soft">{said}</p></div><code>{escape(command(campaign, flight))}</code></div>'
    )


def _picture(flight: Result) -> str:
    if len(flight.track) < 2:
        return ""
    end_s = flight.track[-1][0]
    top = max(5.0, *(max(height, away) for _, height, away in flight.track))

    def x(time_s: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * time_s / end_s

    def y(metres: float) -> float:
        return _HEIGHT - _BOTTOM - (_HEIGHT - _TOP - _BOTTOM) * max(metres, 0.0) / top

    def line(column: int, colour: str) -> str:
        points = " ".join(f"{x(row[0]):.1f},{y(row[column]):.1f}" for row in flight.track)
        return (
            f'<polyline points="{points}" fill="none" stroke="var({colour})" stroke-width="1.5"/>'
        )

    fault = x(min(flight.at_s, end_s))
    return (
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" aria-label="height and distance">'
        f'<line x1="{_LEFT}" y1="{y(0.0)}" x2="{_WIDTH - _RIGHT}" y2="{y(0.0)}" '
        f'stroke="var(--edge)"/><line x1="{fault:.1f}" y1="{_TOP}" x2="{fault:.1f}" y2="{y(0.0)}" '
        f'stroke="var(--bad)" stroke-dasharray="4 3"/>'
        + line(2, "--distance")
        + line(1, "--height")
        + f'<text x="{_LEFT - 6}" y="{y(top) + 4}" text-anchor="end">{top:.0f} m</text>'
        f'<text x="{_LEFT - 6}" y="{y(0.0) + 4}" text-anchor="end">0</text>'
        f'<text x="{_WIDTH - _RIGHT}" y="{_HEIGHT - 5}" text-anchor="end">{end_s:.0f} s</text>'
        f'<text x="{_LEFT}" y="{_HEIGHT - 5}">0 s</text></svg>'
    )
