"""`strix log info|tail|plot`: the numbers of the log, whatever its length."""

from __future__ import annotations

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner
from ulog_writer import ULogWriter

from strix.errors import BadInput
from strix.log import cli_view, stream
from strix.log.convert import convert
from strix.log.view import curves, plot, summarise, tail

runner = CliRunner()


@pytest.fixture
def log_path(tmp_path: Path) -> Path:
    log = ULogWriter()
    log.info("sys_name", "Strix")
    log.info("vehicle", "Quad5in")
    log.info("ver_sw_git", "abc123")
    log.text(1.5, 4, "battery \x1b[31mlow")
    log.text(2.5, 6, "landed")
    times_s = np.arange(0.5, 3.0, 0.01)
    log.topic("vehicle_local_position", times_s, {"z": np.sin(times_s), "x": 4.0})
    q = np.stack([times_s, 2 * times_s, 3 * times_s, 4 * times_s], axis=1)
    log.topic("vehicle_attitude", times_s, {"q": q})
    log.topic("estimator_aid_source", [1.0, 3.5], {"count": [1, 2]}, instance=3)
    log.topic("log_status", [1.0, 2.0], {"dropped": [0, 7]})
    log.topic("log_block", [1.0, 2.0], {"boot_id": 0xDEAD})
    return log.write(tmp_path / "flight.ulg")


@pytest.fixture
def app() -> typer.Typer:
    app = typer.Typer()
    for command in (cli_view.convert, cli_view.info, cli_view.tail, cli_view.plot):
        app.command()(command)
    return app


@pytest.fixture(params=[1 << 22, 700], ids=["in-one-part", "in-many-parts"])
def chunk(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "CHUNK", request.param)


@pytest.mark.usefixtures("chunk")
def test_info_counts_what_the_log_holds(log_path: Path) -> None:
    found = summarise(log_path)
    assert found.identity == {"sys_name": "Strix", "vehicle": "Quad5in", "ver_sw_git": "abc123"}
    assert found.boot_id == 0xDEAD
    assert found.size == log_path.stat().st_size
    assert (found.begin_s, found.duration_s) == (0.5, 3.0)
    assert found.dropped == 7
    assert [m.text for m in found.messages] == ["battery \x1b[31mlow", "landed"]
    topics = {topic.name: topic for topic in found.topics}
    assert topics["vehicle_attitude"].count == 250
    assert topics["vehicle_attitude"].rate_hz == pytest.approx(100.0)
    assert topics["vehicle_attitude"].bytes == 250 * (5 + 8 + 16)
    assert topics["estimator_aid_source.3"].rate_hz == pytest.approx(0.4)
    assert found.unread == 0


def test_info_as_json_is_for_other_programs(log_path: Path, app: typer.Typer) -> None:
    result = runner.invoke(app, ["info", str(log_path), "--json"])
    found = json.loads(result.stdout)
    assert found["duration_s"] == 3.0
    assert {"name", "count", "rate_hz", "bytes", "first_s", "last_s"} == set(found["topics"][0])
    assert found["messages"][0]["time_s"] == 1.5


def test_info_for_a_person_cannot_be_steered_by_the_log(log_path: Path, app: typer.Typer) -> None:
    result = runner.invoke(app, ["info", str(log_path)])
    assert result.exit_code == 0
    assert "vehicle Quad5in" in result.stdout
    assert "battery ?[31mlow" in result.stdout
    assert "\x1b" not in result.stdout


def test_damage_is_told(log_path: Path, app: typer.Typer) -> None:
    content = log_path.read_bytes()
    log_path.write_bytes(content + b"\xff" * 50 + bytes(100))
    assert summarise(log_path).unread == 50
    assert "50 bytes not read" in runner.invoke(app, ["info", str(log_path)]).stdout


@pytest.mark.usefixtures("chunk")
def test_tail_gives_the_last_records(log_path: Path) -> None:
    names, rows = tail(log_path, "vehicle_attitude", 30)
    assert names == ["time_s", "q[0]", "q[1]", "q[2]", "q[3]"]
    assert len(rows) == 30
    assert rows[-1] == pytest.approx([2.99, 2.99, 5.98, 8.97, 11.96])
    assert rows[0][0] == pytest.approx(2.70)


def test_tail_without_a_topic_gives_the_last_messages(log_path: Path, app: typer.Typer) -> None:
    result = runner.invoke(app, ["tail", str(log_path), "-n", "1"])
    assert result.stdout.splitlines() == ["time_s  level  message", "2.5     info   landed"]


@pytest.mark.usefixtures("chunk")
def test_plot_draws_the_fields_asked_for(log_path: Path, tmp_path: Path) -> None:
    out = tmp_path / "figures" / "z.png"
    wanted = ["vehicle_local_position.z", "vehicle_attitude.q", "estimator_aid_source.3.count"]
    drawn = plot(log_path, wanted, out)
    assert [curve.name for curve in drawn] == [
        "vehicle_local_position.z",
        *(f"vehicle_attitude.q[{i}]" for i in range(4)),
        "estimator_aid_source.3.count",
    ]
    np.testing.assert_allclose(drawn[0].values, np.sin(drawn[0].time_s), atol=1e-6)
    assert drawn[0].values.size == 250
    assert drawn[-1].values.tolist() == [1, 2]
    assert out.read_bytes().startswith(b"\x89PNG")


def test_a_long_curve_keeps_its_peaks_and_its_gaps(tmp_path: Path) -> None:
    times_s = np.arange(100_003) * 1e-3
    z = np.zeros(times_s.size)
    z[[17, 54_321, 70_005, 100_002]] = [5.0, -7.0, 11.0, 9.0]
    z[70_010:71_000] = np.nan  # not where a part of the thinned curve begins
    log = ULogWriter()
    log.topic("vehicle_local_position", times_s, {"z": z})
    (curve,) = curves(log.write(tmp_path / "long.ulg"), ["vehicle_local_position.z"])
    assert curve.values.size < 5000
    assert np.all(np.diff(curve.time_s) >= 0.0)
    for value, time_s in ((5.0, 0.017), (-7.0, 54.321), (11.0, 70.005), (9.0, 100.002)):
        assert curve.time_s[curve.values == value] == pytest.approx([time_s])
    assert np.isnan(curve.values[(curve.time_s > 70.3) & (curve.time_s < 70.7)]).all()


def test_memory_does_not_grow_with_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "CHUNK", 1 << 16)
    times_s = np.arange(250_000) * 1e-3
    log = ULogWriter()
    log.topic("vehicle_local_position", times_s, {"z": times_s})
    path = log.write(tmp_path / "long.ulg")
    del log
    assert path.stat().st_size > 10e6
    for look in (
        lambda: summarise(path),
        lambda: tail(path, "vehicle_local_position", 10),
        lambda: convert(path, tmp_path / "long.dat"),
    ):
        tracemalloc.start()
        look()
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        # Of the log: one part; for Ugglan's form the 10 s in which late records may come.
        assert peak < 6e6


@pytest.mark.parametrize(
    "arguments",
    [
        ["info", "{log}.gone"],
        ["tail", "{log}", "nothing"],
        ["plot", "{log}", "nothing.z"],
        ["convert", "{log}", "-o", "x.doc"],
    ],
)
def test_a_command_refuses_in_one_line(
    arguments: list[str], log_path: Path, app: typer.Typer
) -> None:
    result = runner.invoke(app, [part.format(log=log_path) for part in arguments])
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("strix: ")
    assert result.stderr.count("\n") == 1


def test_convert_names_what_it_wrote_and_what_was_lost(
    log_path: Path, tmp_path: Path, app: typer.Typer
) -> None:
    out = tmp_path / "flight.dat"
    result = runner.invoke(app, ["convert", str(log_path), "-o", str(out)])
    assert result.exit_code == 0
    assert result.stdout == f"{out}\n"
    assert "2 messages are left out" in result.stderr


@pytest.mark.parametrize(
    ("field", "expected"),
    [
        ("vehicle_local_position", "expected topic.field"),
        ("nothing.z", "expected records of topic nothing, found estimator_aid_source.3, log_block"),
        ("vehicle_attitude.p", r"expected a field p, found q\[0\], q\[1\]"),
        ("vehicle_attitude.2.q", "expected records of topic vehicle_attitude.2"),
    ],
)
def test_a_wrong_field_is_told_with_what_there_is(
    field: str, expected: str, log_path: Path, tmp_path: Path
) -> None:
    with pytest.raises(BadInput, match=expected):
        plot(log_path, [field], tmp_path / "x.png")


def test_a_figure_never_replaces_the_log(log_path: Path) -> None:
    before = log_path.read_bytes()
    with pytest.raises(BadInput, match=r"expected a name that ends in \.png"):
        plot(log_path, ["vehicle_attitude.q"], log_path)
    assert log_path.read_bytes() == before


@pytest.mark.parametrize("content", [b"", b"ULog", b"a photo, say", b"ULog\x01\x12\x35"])
def test_another_file_is_refused_with_its_name(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "photo.jpg"
    path.write_bytes(content)
    with pytest.raises(BadInput, match=r"photo\.jpg.*expected"):
        summarise(path)
    with pytest.raises(BadInput, match=r"nowhere\.ulg: expected a readable log"):
        summarise(tmp_path / "nowhere.ulg")
