"""`strix convert`: every value of a log arrives in the other format."""

from __future__ import annotations

import csv
import json
import random
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from numpy.typing import NDArray
from pyulog import ULog
from ulog_writer import TOPICS, ULogWriter

from strix.errors import BadInput
from strix.log import stream
from strix.log.convert import convert
from strix.log.stream import ULogSource

Columns = Mapping[str, NDArray[Any]]


def write_log(path: Path, rows: int = 40) -> Path:
    """A log with every topic of Topics.def, its fields random bits: NaN and infinities too."""
    rng = np.random.default_rng(1)
    log = ULogWriter()
    log.info("vehicle", "Quad5in")
    log.text(0.25, 6, 'armed, "now"')
    log.text(0.5, 3, "error\nof two lines, µ")
    for name, fields in TOPICS.items():
        for instance in (0, 3) if name == "estimator_aid_source" else (0,):
            columns = {
                field: _random_bits(rng, kind, (rows, length) if length else (rows,))
                for kind, field, length in fields
                if field != "timestamp"
            }
            log.topic(name, np.linspace(0.001, 2.0, rows), columns, instance)
    return log.write(path)


def _random_bits(rng: np.random.Generator, kind: str, shape: tuple[int, ...]) -> NDArray[Any]:
    if kind == "float":
        some = np.array([0.1, -0.0, np.nan, np.inf, 1e-45, 16777217.0, 3.4028235e38], np.float32)
        return np.where(rng.random(shape) < 0.3, rng.choice(some, shape), rng.normal(size=shape))
    dtype = np.dtype(kind.removesuffix("_t"))
    limits = np.iinfo(dtype)
    return rng.integers(limits.min, limits.max, shape, dtype=dtype, endpoint=True)


@pytest.fixture
def log_path(tmp_path: Path) -> Path:
    return write_log(tmp_path / "flight.ulg")


def pyulog_topics(path: Path) -> dict[str, Columns]:
    return {
        f"{topic.name}.{topic.multi_id}" if topic.multi_id else topic.name: topic.data
        for topic in ULog(str(path)).data_list
    }


def assert_same_bits(found: Columns, expected: Columns) -> None:
    assert set(found) == set(expected)
    for name, values in expected.items():
        assert found[name].dtype == values.dtype, name
        np.testing.assert_array_equal(found[name], values, name)  # NaN equals NaN here


def read_csv(path: Path, like: Columns) -> Columns:
    with path.open(newline="") as file:
        names, *rows = csv.reader(file)
    texts = dict(zip(names, zip(*rows, strict=True), strict=True))
    return {name: np.array(texts[name], dtype=str).astype(like[name].dtype) for name in names}


def test_csv_has_every_value_of_the_log(log_path: Path, tmp_path: Path) -> None:
    out = tmp_path / "csv"
    assert convert(log_path, out, to="csv") == []
    expected = pyulog_topics(log_path)
    assert {path.stem for path in out.iterdir()} == {*expected, "logged_messages"}
    for name, columns in expected.items():
        assert_same_bits(read_csv(out / f"{name}.csv", columns), columns)


def test_parquet_has_every_value_and_type_of_the_log(log_path: Path, tmp_path: Path) -> None:
    out = tmp_path / "tables.parquet"  # the ending names the format, a folder all the same
    convert(log_path, out)
    for name, columns in pyulog_topics(log_path).items():
        table = pyarrow.parquet.read_table(out / f"{name}.parquet")
        assert_same_bits({c: table[c].to_numpy() for c in table.column_names}, columns)


def test_mcap_has_every_value_of_the_log_for_any_protobuf_reader(
    log_path: Path, tmp_path: Path
) -> None:
    out = tmp_path / "flight.mcap"
    convert(log_path, out)
    expected = pyulog_topics(log_path)
    found: dict[str, dict[str, list[Any]]] = {}
    with out.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        channels = ["/" + name.replace(".", "/") for name in expected]
        for _, channel, message, record in reader.iter_decoded_messages(channels):
            assert message.log_time == record.timestamp * 1000  # ns
            columns = found.setdefault(channel.topic[1:].replace("/", "."), {})
            for descriptor in record.DESCRIPTOR.fields:
                value = getattr(record, descriptor.name)
                if descriptor.is_repeated:
                    for index, element in enumerate(value):
                        columns.setdefault(f"{descriptor.name}[{index}]", []).append(element)
                else:
                    columns.setdefault(descriptor.name, []).append(value)
    assert set(found) == set(expected)
    for name, arrays in expected.items():
        read = {c: np.array(values, dtype=arrays[c].dtype) for c, values in found[name].items()}
        assert_same_bits(read, arrays)


def test_messages_arrive_as_they_were_written(log_path: Path, tmp_path: Path) -> None:
    convert(log_path, tmp_path / "csv", to="csv")
    with (tmp_path / "csv" / "logged_messages.csv").open(newline="") as file:
        rows = list(csv.reader(file))[1:]
    texts = ['armed, "now"', "error\nof two lines, µ"]
    assert rows == [["250000", "info", texts[0]], ["500000", "error", texts[1]]]

    convert(log_path, tmp_path / "flight.mcap")
    with (tmp_path / "flight.mcap").open("rb") as file:
        found = [json.loads(m.data) for _, _, m in make_reader(file).iter_messages(["/log"])]
    assert [(m["timestamp"]["nsec"], m["level"], m["message"]) for m in found] == [
        (250_000_000, 2, texts[0]),
        (500_000_000, 4, texts[1]),
    ]


def test_a_log_read_in_small_parts_is_the_same(
    log_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stream, "CHUNK", 997)  # a message of this log is shorter; parts cut through
    convert(log_path, tmp_path / "tables.parquet")
    for name, columns in pyulog_topics(log_path).items():
        table = pyarrow.parquet.read_table(tmp_path / "tables.parquet" / f"{name}.parquet")
        assert_same_bits({c: table[c].to_numpy() for c in table.column_names}, columns)


def test_a_cut_log_gives_what_stands_before_the_cut_and_says_so(
    log_path: Path, tmp_path: Path
) -> None:
    whole = log_path.read_bytes()
    log_path.write_bytes(whole[:-7])
    (said,) = convert(log_path, tmp_path / "out.parquet")
    assert "damaged or cut" in said
    rows = {
        path.stem: pyarrow.parquet.read_metadata(path).num_rows
        for path in (tmp_path / "out.parquet").iterdir()
    }
    assert rows.pop("log_block") == 39  # the last topic that was written
    assert rows.pop("logged_messages") == 2
    assert set(rows.values()) == {40}


def test_zeros_that_fill_the_last_sector_are_no_damage(log_path: Path, tmp_path: Path) -> None:
    log_path.write_bytes(log_path.read_bytes() + bytes(300))
    assert convert(log_path, tmp_path / "out.parquet") == []


def test_a_topic_cannot_lead_out_of_the_folder(tmp_path: Path) -> None:
    log = ULogWriter()
    log.topic("sensor_baro", [0.1], {})
    path = log.write(tmp_path / "evil.ulg")
    path.write_bytes(path.read_bytes().replace(b"sensor_baro", b"/../../baro"))
    with pytest.raises(BadInput, match=r"expected a topic's name, found '/\.\./\.\./baro'"):
        convert(path, tmp_path / "a" / "b" / "out.csv")
    assert not list(tmp_path.rglob("*baro*"))


def test_formats_inside_formats_are_flattened_as_pyulog_does(tmp_path: Path) -> None:
    def message(kind: str, content: bytes) -> bytes:
        return struct.pack("<HB", len(content), ord(kind)) + content

    esc = "esc:int32_t rpm;bool on;uint8_t[3] _padding0;"
    status = "esc_status:uint64_t timestamp;esc[2] esc;char[4] name;uint8_t[4] _padding0;"
    record = struct.pack("<QiB3xiB3x4s", 1500, -7, 1, 9, 0, b"abcd")  # its end not padded
    path = tmp_path / "px4.ulg"
    path.write_bytes(
        b"ULog\x01\x12\x35\x01"
        + bytes(8)
        + message("F", status.encode())
        + message("F", esc.encode())
        + message("A", b"\0\5\0esc_status")
        + message("D", b"\5\0" + record)
    )
    (rows,) = (chunk.records[5] for chunk in ULogSource(path).chunks())
    assert {name: rows[name].tolist() for name in rows.dtype.names or ()} == {
        "timestamp": [1500],
        "esc[0].rpm": [-7],
        "esc[0].on": [1],
        "esc[1].rpm": [9],
        "esc[1].on": [0],
        "name": [b"abcd"],
    }
    for ending in ("mcap", "csv", "parquet", "dat"):
        convert(path, tmp_path / f"out.{ending}")


@pytest.mark.parametrize(
    ("out", "to", "expected"),
    [
        ("flight.ulg", "mcap", "expected another file than the log itself"),
        ("there.mcap", None, "expected a new name"),
        ("there", "csv", "expected a new name"),
        ("out.xlsx", None, "expected a format of csv, parquet, mcap, ugglan, ulg"),
        ("out", "excel", "--to: expected a format of"),
        ("new.ulg", None, "expected Ugglan's data log"),
    ],
)
def test_what_exists_is_never_destroyed_unasked(
    log_path: Path, tmp_path: Path, out: str, to: str | None, expected: str
) -> None:
    before = log_path.read_bytes()
    (tmp_path / "there.mcap").write_text("mine")
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "mine.txt").write_text("mine")
    with pytest.raises(BadInput, match=expected):
        convert(log_path, tmp_path / out, to, force=out == "flight.ulg")
    assert log_path.read_bytes() == before
    assert (tmp_path / "there.mcap").read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 3


def test_random_damage_is_bad_input_or_a_shorter_log(log_path: Path, tmp_path: Path) -> None:
    whole = log_path.read_bytes()
    chance = random.Random(2)
    rows = 0
    for _ in range(300):
        damaged = bytearray(whole)
        for _ in range(chance.randrange(1, 5)):
            damaged[chance.randrange(len(whole) if chance.random() < 0.5 else 3000)] ^= (
                1 << chance.randrange(8)
            )
        path = tmp_path / "damaged.ulg"
        path.write_bytes(damaged)
        try:
            for chunk in ULogSource(path).chunks():
                rows += sum(part.size for part in chunk.records.values())
        except BadInput as error:
            assert str(path) in str(error)
    assert rows > 0


@pytest.mark.parametrize("rest", [b"", b"\0", b"\0" * 300, b"\x05\x00D\x00", b"\x02\x00D\x00\x00"])
def test_a_log_without_records_is_empty(rest: bytes, tmp_path: Path) -> None:
    path = tmp_path / "empty.ulg"
    path.write_bytes(b"ULog\x01\x12\x35\x01" + bytes(8) + rest)
    assert sum(len(chunk.records) for chunk in ULogSource(path).chunks()) == 0
    for ending in ("csv", "parquet", "mcap", "dat"):
        convert(path, tmp_path / f"out.{ending}")


def test_a_record_longer_than_its_format_is_damage(log_path: Path, tmp_path: Path) -> None:
    record = b"\0" * 100
    alien = struct.pack("<HBH", 2 + len(record), ord("D"), 0) + record
    log_path.write_bytes(log_path.read_bytes() + alien)
    (said,) = convert(log_path, tmp_path / "out.parquet")
    assert "damaged or cut" in said
