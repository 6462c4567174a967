"""The report: a page that stands alone and shows what the log says."""

from __future__ import annotations

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from plotly.offline import get_plotlyjs
from synthetic_flight import IDLE, SAFE, TAKEOFF, SyntheticFlight, write_flight
from ulog_writer import ULogWriter

from strix.errors import BadInput
from strix.flightlog import FlightLog, read_flight_log
from strix.report import names, write_report
from strix.report.charts import ALARM, Panel, TimeAxis, band, line, panels, thinned
from strix.summary import summarise
from strix.track import TruthTrack

SECTIONS = ("track", "states", "following", "errors", "motors", "nis", "software")
CHARTS = [
    "track-above",
    "track-side",
    "timeline",
    "position",
    "attitude",
    "error-position",
    "error-velocity",
    "error-attitude",
    "motors",
    "wrench",
    "nis-tilt",
    "nis-magnetometer",
    "nis-altimeter",
    "nis-gps",
    "loop",
    "log",
]
VOID_ELEMENTS = ("meta", "br")


class Page(HTMLParser):
    """The page's elements; fails when they are not properly nested."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.addresses: list[str | None] = []
        self.content: dict[str, str] = {}  # of each script with an id
        self.words = ""  # outside scripts and styles
        self._open: list[tuple[str, str]] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        name = values.get("id") or ""
        if name:
            self.ids.append(name)
        self.addresses += [values[key] for key in ("src", "href", "action") if key in values]
        if tag not in VOID_ELEMENTS:
            self._open.append((tag, name))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        tag, name = self._open[-1] if self._open else ("", "")
        if tag == "script" and name:
            self.content[name] = self.content.get(name, "") + data
        elif tag not in ("script", "style"):
            self.words += data

    @property
    def charts(self) -> dict[str, dict[str, Any]]:
        return {chart["name"]: chart for chart in json.loads(self.content["charts"])}


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> SyntheticFlight:
    return write_flight(tmp_path_factory.mktemp("flight") / "flight.ulg")


def report(log: FlightLog, truth: TruthTrack | None, folder: Path) -> str:
    path = folder / "report.html"
    write_report(path, log, truth, summarise(log, truth, 1.0))
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def log(flight: SyntheticFlight) -> FlightLog:
    return read_flight_log(flight.log)


@pytest.fixture(scope="module")
def text(flight: SyntheticFlight, log: FlightLog, tmp_path_factory: pytest.TempPathFactory) -> str:
    return report(log, flight.truth, tmp_path_factory.mktemp("page"))


@pytest.fixture(scope="module")
def page(text: str) -> Page:
    return Page(text)


def decoded(numbers: dict[str, str]) -> list[float]:
    return list(np.frombuffer(base64.b64decode(numbers["bdata"]), dtype="<f4"))


def names_of(chart: dict[str, Any]) -> set[str]:
    return {trace["name"] for trace in chart["data"]}


def test_every_section_and_chart_is_there_once(page: Page) -> None:
    assert [name for name in page.ids if name.startswith("section-")] == [
        f"section-{name}" for name in SECTIONS
    ]
    assert list(page.charts) == CHARTS
    assert sorted(page.ids) == sorted({*page.ids})
    assert set(CHARTS) < set(page.ids)


def test_the_page_needs_nothing_from_elsewhere(text: str, page: Page) -> None:
    own = text.replace(get_plotlyjs(), "")
    assert len(own) < len(text)
    assert page.addresses == []
    assert not re.search(r"https?:|url\(|@import|//[a-z]+\.", own)
    # Plotly's own script names servers of maps; this keeps it, too, from asking any.
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', own)
    assert policy is not None
    assert policy[1].startswith("default-src 'none';")
    assert "connect-src" not in policy[1]


def test_the_page_is_well_under_ten_megabytes(text: str) -> None:
    assert len(text.encode()) < 7e6
    assert len(text) - len(get_plotlyjs()) < 2e6  # what grows with the flight is thinned


def test_plotly_accepts_every_chart(page: Page) -> None:
    for chart in page.charts.values():
        go.Figure(data=chart["data"], layout=chart["layout"])


def test_every_axis_has_a_title_and_time_is_the_same_everywhere(page: Page) -> None:
    ranges = []
    for name, chart in page.charts.items():
        for key, axis in chart["layout"].items():
            if "axis" in key and name != "timeline":
                assert axis["title"]["text"]
        if not name.startswith("track"):
            ranges.append(tuple(chart["layout"]["xaxis"]["range"]))
    assert set(ranges) == {(0.0, 59.998)}


def test_both_track_views_have_equal_scales(page: Page) -> None:
    for name in ("track-above", "track-side"):
        axis = page.charts[name]["layout"]["yaxis"]
        assert (axis["scaleanchor"], axis["scaleratio"]) == ("x", 1)


def test_the_track_shows_estimate_reference_truth_and_the_waypoint(page: Page) -> None:
    above = page.charts["track-above"]
    expected = {"truth", "reference", "estimate", "start", "waypoint", "end"}
    assert names_of(above) == expected
    waypoint = next(trace for trace in above["data"] if trace["name"] == "waypoint")
    place = [*decoded(waypoint["x"]), *decoded(waypoint["y"])]
    assert place == pytest.approx([3.0, 5.0], abs=0.01)  # east, north; the reference creeps there
    side = page.charts["track-side"]["layout"]["xaxis"]["title"]["text"]
    assert re.search("towards 03[0-2] deg", side)  # atan2(3, 5) is 31 deg


def test_the_tiles_and_the_verdict_are_the_summary(page: Page) -> None:
    assert "Landed 0.00 m from the start, disarmed" in page.words
    assert "60.0 s" in page.words
    assert "loop overruns1" in page.words
    assert "The log is damaged" not in page.words


def test_a_real_flight_has_no_truth_to_show(log: FlightLog, tmp_path: Path) -> None:
    page = Page(report(log, None, tmp_path))
    assert list(page.charts) == CHARTS
    for chart in page.charts.values():
        assert not names_of(chart) & {"truth", "estimate - truth"}
    assert "±3 sigma" in names_of(page.charts["error-position"])
    for name in ("wall time", "attitude error", "position error"):
        assert name not in page.words


def test_the_timeline_has_a_bar_a_state_and_a_mark_a_message(page: Page) -> None:
    bars, messages = page.charts["timeline"]["data"]
    assert len(bars["x"]) == 13  # the states the flight went through
    assert sum(bars["x"]) == pytest.approx(59.9)  # the last state is logged up to there
    assert messages["x"][:3] == [5.0, 15.0, 16.0]
    assert messages["text"][-1] == "landed: disarmed"


def minimal_log() -> ULogWriter:
    """No more than the summary needs."""
    log = ULogWriter()
    time_s = np.arange(11.0)
    log.topic("vehicle_local_position", time_s, {})
    log.topic("vehicle_attitude", time_s, {"q": [1.0, 0.0, 0.0, 0.0]})
    log.topic("trajectory_setpoint", time_s, {})
    log.topic("log_status", time_s, {"bytes": 1000 * time_s})
    log.topic("control_tick", time_s, {})
    return log


def states(log: ULogWriter, numbers: list[int]) -> None:
    state = np.array(numbers)
    critical = np.maximum.accumulate(state == SAFE)
    log.topic("flight_state", np.arange(len(state)), {"state": state, "critical": critical})


def test_a_log_of_the_bare_minimum_has_a_report(tmp_path: Path) -> None:
    log = minimal_log()
    states(log, [IDLE])
    page = Page(report(read_flight_log(log.write(tmp_path / "bare.ulg")), None, tmp_path))
    assert {"track-above", "timeline", "attitude", "loop"} <= set(page.charts)
    assert "Did not land" in page.words


def test_what_follows_a_critical_error_is_red(tmp_path: Path) -> None:
    log = minimal_log()
    states(log, [IDLE, TAKEOFF, SAFE])
    page = Page(report(read_flight_log(log.write(tmp_path / "flight.ulg")), None, tmp_path))
    colors = page.charts["timeline"]["data"][0]["marker"]["color"]
    assert [color == ALARM for color in colors] == [False, False, True]


def test_rejections_are_marked_and_the_rest_is_counted(tmp_path: Path) -> None:
    log = minimal_log()
    states(log, [IDLE])
    nis = np.zeros((100, 4))
    nis[:, 0] = 0.5
    nis[[3, 50], 0] = (7.0, 80.0)
    fields = {"nis": nis, "count": 2, "rejected": (nis[:, 0] > 6.635).astype(int)}
    log.topic("estimator_aid_source", np.arange(100) / 10.0, fields, instance=3)
    text = report(read_flight_log(log.write(tmp_path / "flight.ulg")), None, tmp_path)
    # 98 of 100 and 100 of 100; (98 x 0.5 + 100 x 0) / 198
    assert "99.0 % of 200 accepted; their mean is 0.25." in text
    rejected = next(
        trace for trace in Page(text).charts["nis-gps"]["data"] if trace["name"] == "rejected"
    )
    assert rejected["text"] == ["north, NIS 7.0", "north, NIS 80.0"]
    assert decoded(rejected["y"]) == [7.0, 12.0]  # 80 is drawn at the upper edge


def test_a_message_cannot_break_the_page(tmp_path: Path) -> None:
    log = minimal_log()
    states(log, [IDLE])
    log.text(1.0, 2, "</script><script>alert(1)</script> & <b>")
    text = report(read_flight_log(log.write(tmp_path / "flight.ulg")), None, tmp_path)
    assert "<script>alert" not in text
    assert "</script><script>alert(1)</script> & <b>" in Page(text).words


def test_numbers_that_are_none_leave_gaps(tmp_path: Path) -> None:
    log = minimal_log()
    states(log, [IDLE])
    gone = np.full(11, np.nan)
    log.topic("estimator_std", np.arange(11.0), {"std_dev": gone[:, None]})
    log.topic("actuator_outputs", np.arange(11.0), {"output": gone[:, None]})
    log.topic("estimator_aid_source", np.arange(11.0), {"nis": gone[:, None], "count": 3})
    report(read_flight_log(log.write(tmp_path / "flight.ulg")), None, tmp_path)


def test_a_damaged_log_is_called_so(tmp_path: Path) -> None:
    log = minimal_log()
    states(log, [IDLE, IDLE])
    path = log.write(tmp_path / "damaged.ulg")
    content = bytearray(path.read_bytes())
    content[-30:] = bytes(30)
    path.write_bytes(content)
    damaged = read_flight_log(path)
    assert damaged.damaged
    assert "The log is damaged or cut" in Page(report(damaged, None, tmp_path)).words


def test_states_have_numbers_where_the_flight_code_is_not_built(
    monkeypatch: pytest.MonkeyPatch, log: FlightLog
) -> None:
    assert names.state_name(TAKEOFF) == "TAKEOFF"
    limits = names.esc_limits(log)
    assert limits is not None
    assert (limits.unit, limits.off, limits.flight_max) == ("us", 1150.0, 1700.0)  # Quad5in.h
    monkeypatch.setattr(names, "_core", lambda: None)
    assert names.state_name(TAKEOFF) == "state 3"
    assert names.esc_limits(log) is None


def test_a_report_that_cannot_be_written_is_refused(log: FlightLog, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"none/report\.html: expected a file that can be written"):
        path = tmp_path / "none" / "report.html"
        write_report(path, log, None, summarise(log, None, 0.0))


def test_a_thinned_line_keeps_its_peaks_and_ends() -> None:
    values = np.sin(np.arange(100_000) / 5000.0)
    values[[31_234, 77_777]] = (9.0, -9.0)
    kept = thinned(values, 500)
    assert len(kept) <= 500
    assert {0, 31_234, 77_777, 99_999} <= set(kept.tolist())
    assert np.all(np.diff(kept) > 0)
    assert thinned(values[:400], 500).tolist() == list(range(400))


def test_a_gap_stays_a_gap_when_thinned() -> None:
    values = np.zeros(10_000)
    values[4010:6000] = np.nan
    values[4009] = 5.0  # a peak beside it
    kept = values[thinned(values, 500)]
    assert np.isnan(kept).any()
    assert np.nanmax(kept) == 5.0


def test_the_legend_names_each_line_once() -> None:
    x = np.arange(3.0)
    rows = [
        Panel(f"row {i}, m", [*band("bounds", x, x), line("error", x, x, ALARM)]) for i in (1, 2)
    ]
    chart = panels("name", "title", 300, rows, TimeAxis(0.0, 2.0, ()))
    shown = [(trace["name"], "fill" in trace) for trace in chart.traces if trace["showlegend"]]
    assert shown == [("bounds", True), ("error", False)]
