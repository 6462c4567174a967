"""Reading a flight log."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from ulog_writer import ULogWriter

from strix.errors import BadInput
from strix.flightlog import read_flight_log


@pytest.fixture
def log_path(tmp_path: Path) -> Path:
    log = ULogWriter()
    log.info("vehicle", "Quad5in")
    log.text(1.5, 4, "late")
    log.text(0.5, 6, "early")
    times_s = [0.25, 0.5, 0.75]
    log.topic("vehicle_attitude", times_s, {"q": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]})
    log.topic("sensor_baro", [0.1, 2.1], {"pressure": [101325.0, 101300.0]})
    log.topic("estimator_aid_source", times_s, {"count": [1, 2, 3]})
    log.topic("estimator_aid_source", [0.3], {"count": [4]}, instance=3)
    return log.write(tmp_path / "flight.ulg")


def test_a_topic_is_columns_over_seconds(log_path: Path) -> None:
    topic = read_flight_log(log_path).topic("sensor_baro")
    assert topic.time_s.tolist() == pytest.approx([0.1, 2.1])
    assert topic["pressure"].tolist() == [101325.0, 101300.0]


def test_an_array_of_the_log_is_an_array_here(log_path: Path) -> None:
    q = read_flight_log(log_path).topic("vehicle_attitude")["q"]
    assert q.tolist() == [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]


def test_instances_of_a_topic_stay_apart(log_path: Path) -> None:
    log = read_flight_log(log_path)
    assert log.instances("estimator_aid_source") == [0, 3]
    assert log.topic("estimator_aid_source", 0)["count"].tolist() == [1, 2, 3]
    assert log.topic("estimator_aid_source", 3)["count"].tolist() == [4]
    assert log.has("estimator_aid_source", 3)
    assert not log.has("estimator_aid_source", 1)


def test_the_log_lasts_from_its_first_record_to_its_last(log_path: Path) -> None:
    log = read_flight_log(log_path)
    assert (log.begin_s, log.end_s) == pytest.approx((0.1, 2.1))
    assert log.duration_s == pytest.approx(2.0)


def test_messages_come_in_the_order_they_were_said(log_path: Path) -> None:
    log = read_flight_log(log_path)
    said = [(m.time_s, m.level, m.text) for m in log.messages]
    assert said == [(0.5, "info", "early"), (1.5, "warning", "late")]
    assert log.info["vehicle"] == "Quad5in"


def refusal(path: Path) -> str:
    with pytest.raises(BadInput) as refused:
        read_flight_log(path)
    message = str(refused.value)
    assert "\n" not in message
    assert str(path) in message
    return message


def test_a_missing_file_is_refused_in_one_line(tmp_path: Path) -> None:
    assert "No such file" in refusal(tmp_path / "none.ulg")
    assert "directory" in refusal(tmp_path)


@pytest.mark.parametrize("content", [b"", b"ULog", b"t_s,ax,ay,az\n0,0,0,-9.8\n"])
def test_another_kind_of_file_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other.ulg"
    path.write_bytes(content)
    assert "expected a ULog file, which begins with 'ULog', found" in refusal(path)


def test_a_log_without_records_is_refused_in_one_line(tmp_path: Path) -> None:
    log = ULogWriter()
    log.text(1.0, 6, "nothing to see")
    assert "expected a log with records" in refusal(log.write(tmp_path / "empty.ulg"))


def test_a_missing_topic_is_told_with_those_there_are(log_path: Path) -> None:
    log = read_flight_log(log_path)
    with pytest.raises(BadInput, match=r"flight\.ulg: topic control_tick: .*sensor_baro"):
        log.topic("control_tick")
    with pytest.raises(BadInput, match="topic estimator_aid_source, instance 2"):
        log.topic("estimator_aid_source", 2)


def test_a_missing_field_is_told_with_those_there_are(log_path: Path) -> None:
    topic = read_flight_log(log_path).topic("sensor_baro")
    with pytest.raises(
        BadInput, match="topic sensor_baro: expected a field height, found pressure"
    ):
        topic["height"]


def test_time_going_backwards_is_told_with_its_record(tmp_path: Path) -> None:
    log = ULogWriter()
    log.topic("sensor_baro", [1.0, 2.0, 1.5], {})
    path = log.write(tmp_path / "flight.ulg")
    with pytest.raises(BadInput, match=r"topic sensor_baro, record 3: .* 2\.0+ s .* 1\.50+ s"):
        read_flight_log(path).topic("sensor_baro")


def test_a_file_cut_in_a_record_keeps_the_records_before(log_path: Path) -> None:
    log_path.write_bytes(log_path.read_bytes()[:-10])
    log = read_flight_log(log_path)
    assert log.instances("estimator_aid_source") == [0]  # the cut one was instance 3's only record
    assert len(log.topic("vehicle_attitude").time_s) == 3


def test_a_damaged_file_is_read_or_refused_but_never_a_crash(
    log_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = log_path.read_bytes()
    rng = random.Random(1)
    damaged = [whole[:length] for length in range(0, len(whole), 7)]
    for _ in range(300):
        flipped = bytearray(whole)
        flipped[rng.randrange(len(whole))] ^= 1 << rng.randrange(8)
        damaged.append(bytes(flipped))
    told = 0
    for content in damaged:
        log_path.write_bytes(content)
        try:
            log = read_flight_log(log_path)
            told += log.damaged
            for name in ("vehicle_attitude", "sensor_baro"):
                log.topic(name)
        except BadInput as refused:
            assert "\n" not in str(refused)
    assert told > 0
    assert capsys.readouterr().out == ""
