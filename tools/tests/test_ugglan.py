"""Ugglan's data log: what it says is what we read, and what we write it would read.

STRIX_FUZZ_S=300 lets the fuzzer run for five minutes.
"""

from __future__ import annotations

import base64
import gzip
import json
import os
import re
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyulog import ULog
from ulog_writer import ULogWriter

from strix.errors import BadInput
from strix.log import stream, ugglan
from strix.log.convert import convert
from strix.log.ugglan import UgglanSource

# As Ugglan's own, but with other numbers: nothing may be built in.
HEADER: dict[str, Any] = {
    "start_time": "2020-09-04T19:31:08Z",
    "types": {
        "9": "BOOL",
        "3": "UINT8",
        "2": "UINT16",
        "1": "UINT32",
        "0": "SINT8",
        "5": "SINT16",
        "6": "SINT32",
        "7": "FLOAT",
        "4": "DOUBLE",
        "12": "a type of tomorrow, of no signal",
    },
    "groups": {"4": "IMU", "7": "RC (left)"},
    "signals": {
        "300": {"name": "AccelerationX", "group": 4, "type": 4},
        "0": {"name": "Ok", "group": 4, "type": 9},
        "1": {"name": "Status", "group": 4, "type": 3},
        "2": {"name": "Counter", "group": 4, "type": 2},
        "65535": {"name": "Ticks", "group": 4, "type": 1},
        "4": {"name": "Trim", "group": 7, "type": 0},
        "5": {"name": "Stick", "group": 7, "type": 5},
        "6": {"name": "Knob", "group": 7, "type": 6},
        "7": {"name": "Temperature, °C", "group": 7, "type": 7, "unit": "°C"},
    },
    "firmware": "unknown keys are fine",
}
LETTERS = {300: "d", 0: "B", 1: "B", 2: "H", 65535: "I", 4: "b", 5: "h", 6: "i", 7: "f"}
KINDS = {"d": "<f8", "B": "u1", "H": "<u2", "I": "<u4", "b": "i1", "h": "<i2", "i": "<i4"}
SIZES = {number: struct.calcsize(letter) for number, letter in LETTERS.items()}

Package = tuple[int, bytes, int]  # signal, value, ms since the one before

packages_of_any_bits = st.lists(
    st.sampled_from(sorted(SIZES)).flatmap(
        lambda number: st.tuples(
            st.just(number),
            st.binary(min_size=SIZES[number], max_size=SIZES[number]),
            st.integers(0, 255),
        )
    ),
    max_size=60,
)
on_files = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def head(header: Any = HEADER) -> bytes:
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    return base64.b64encode(gzip.compress(text)) + b"\n"


def body(packages: list[Package]) -> bytes:
    return b"".join(struct.pack("<H", n) + value + bytes([ms]) for n, value, ms in packages)


def read(path: Path) -> dict[int, tuple[list[int], bytes]]:
    """Times in ms and the values' bytes, by signal."""
    found: dict[int, tuple[list[int], bytes]] = {}
    for chunk in UgglanSource(path).chunks():
        for number, rows in chunk.records.items():
            times, values = found.get(number, ([], b""))
            more = (rows["timestamp"] // 1000).tolist()
            found[number] = (times + more, values + rows["value"].tobytes())
    return found


def expected_of(packages: list[Package]) -> dict[int, tuple[list[int], bytes]]:
    found: dict[int, tuple[list[int], bytes]] = {}
    now_ms = 0
    for number, value, ms in packages:
        now_ms += ms
        times, values = found.get(number, ([], b""))
        found[number] = ([*times, now_ms], values + value)
    return found


@given(packages=packages_of_any_bits, chunk=st.sampled_from([20, 64, 1 << 22]))
@on_files
def test_a_log_is_read_by_its_own_type_table(
    packages: list[Package], chunk: int, tmp_path: Path
) -> None:
    path = tmp_path / "log.dat"
    path.write_bytes(head() + body(packages))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ugglan, "CHUNK", chunk)
        assert read(path) == expected_of(packages)


@given(packages=packages_of_any_bits)
@on_files
def test_through_ulog_and_back_every_byte_of_the_packages_is_the_same(
    packages: list[Package], tmp_path: Path
) -> None:
    if packages:
        packages = [(*packages[0][:2], 0), *packages[1:]]  # Ugglan's first package is at 0 ms
    path, ulg, back = (tmp_path / name for name in ("log.dat", "log.ulg", "back.dat"))
    path.write_bytes(head() + body(packages))
    convert(path, ulg, force=True)
    convert(ulg, back, force=True)
    line, _, content = back.read_bytes().partition(b"\n")
    assert json.loads(gzip.decompress(base64.b64decode(line))) == HEADER
    assert content == body(packages)


def test_pyulog_reads_the_values_in_the_signals_own_types(tmp_path: Path) -> None:
    values = {n: struct.pack(f"<{letter}", 7) for n, letter in LETTERS.items()}
    path = tmp_path / "log.dat"
    path.write_bytes(head() + body([(n, value, 20) for n, value in values.items()]))
    convert(path, tmp_path / "log.ulg")
    log = ULog(str(tmp_path / "log.ulg"))
    found = {topic.name: topic.data["value"] for topic in log.data_list}
    assert set(found) == {
        "IMU/AccelerationX",
        "IMU/Ok",
        "IMU/Status",
        "IMU/Counter",
        "IMU/Ticks",
        "RC__left_/Trim",
        "RC__left_/Stick",
        "RC__left_/Knob",
        "RC__left_/Temperature___C",
    }
    assert {str(v.dtype) for v in found.values()} == {
        "float64", "uint8", "uint16", "uint32", "int8", "int16", "int32", "float32"
    }  # fmt: skip
    assert all(v.tolist() == [7] for v in found.values())
    assert log.get_dataset("IMU/Ok").data["timestamp"].tolist() == [40_000]  # us


def test_a_flight_in_ugglans_form_keeps_every_value(tmp_path: Path) -> None:
    accel = np.array([[1.5, np.nan, -0.0], [0.1, 2.0, 3.0]], dtype=np.float32)
    log = ULogWriter()
    log.text(1.0, 6, "armed")
    times_s = [1.0005, 1.2505]
    log.topic("sensor_combined", times_s, {"timestamp_sample": 2**53, "accelerometer_m_s2": accel})
    log.topic("estimator_aid_source", [1.1, 2.1], {"count": [200, 3]}, instance=3)
    path = log.write(tmp_path / "flight.ulg")
    lost = convert(path, tmp_path / "flight.dat")
    assert len(lost) == 2
    assert lost[0].startswith("1 pauses longer than 255 ms")  # from 1.25 s to 2.1 s
    assert lost[1].startswith("1 messages are left out")

    source = UgglanSource(tmp_path / "flight.dat")
    (chunk,) = source.chunks()
    rows = {source.topics[number].name: rows for number, rows in chunk.records.items()}
    found = np.stack(
        [rows[f"sensor_combined/accelerometer_m_s2_{i}_"]["value"] for i in range(3)], axis=1
    )
    assert found.tobytes() == accel.tobytes()
    stamps = rows["sensor_combined/timestamp_sample"]
    assert stamps["value"].tolist() == [float(2**53)] * 2  # a DOUBLE: Ugglan has no UINT64
    assert stamps["timestamp"].tolist() == [0, 250_000]
    count = rows["estimator_aid_source_3/count"]
    assert count["value"].tolist() == [200, 3]
    assert count["timestamp"].tolist() == [100_000, 505_000]  # 1.1 s as it was; 0.85 s was 0.255 s


def test_records_out_of_order_are_sorted_by_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The logger empties one ring after another: the later topic's records are as old."""
    times_s = np.arange(0.0, 40.0, 0.01)
    log = ULogWriter()
    for begin in range(0, times_s.size, 20):
        part = times_s[begin : begin + 20]
        log.topic("sensor_baro", part, {"pressure": part})
        log.topic("sensor_mag", part + 0.001, {"field_ut": np.stack([part] * 3, axis=1)})
    path = log.write(tmp_path / "flight.ulg")
    monkeypatch.setattr(stream, "CHUNK", 4096)
    convert(path, tmp_path / "flight.dat")
    source = UgglanSource(tmp_path / "flight.dat")
    found: dict[str, list[Any]] = {}
    for chunk in source.chunks():
        for number, rows in chunk.records.items():
            found.setdefault(source.topics[number].name, []).append(rows)
    stamps = [
        np.concatenate([r["timestamp"] for r in parts])
        for name, parts in found.items()
        if re.search(r"/pressure|/field_ut_2_", name)
    ]
    stamps_ms = np.unique(np.concatenate(stamps) // 1000)
    np.testing.assert_array_equal(stamps_ms[::2], np.arange(0, 40_000, 10))
    np.testing.assert_array_equal(stamps_ms[1::2], np.arange(1, 40_001, 10))


def test_a_cut_tail_leaves_everything_before_it(tmp_path: Path) -> None:
    packages: list[Package] = [(1, b"\5", 0), (300, struct.pack("<d", 0.3), 255), (1, b"\6", 9)]
    content = body(packages)
    path = tmp_path / "log.dat"
    for length in range(len(content) + 1):
        path.write_bytes(head() + content[:length])
        whole = sum(length >= len(body(packages[: n + 1])) for n in range(3))
        assert read(path) == expected_of(packages[:whole])


def test_an_unknown_id_is_named_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "log.dat"
    path.write_bytes(head() + body([(1, b"\5", 0)]) + b"\x2b\x01")
    place = len(head()) + 4
    expected = rf"log.dat, byte {place}: expected the id of a signal .*, found 299"
    with pytest.raises(BadInput, match=expected):
        read(path)
    with pytest.raises(BadInput, match=expected):
        convert(path, tmp_path / "log.ulg")
    assert not list(tmp_path.glob("log.ulg*"))


def _with(**changes: Any) -> bytes:
    return head({**HEADER, **changes})


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "expected one line of text"),
        (b"no line", "expected one line of text"),
        (b"?\n", r"expected base64\(gzip\(JSON\)\)"),
        (base64.b64encode(b"{}") + b"\n", r"expected base64\(gzip\(JSON\)\)"),
        (base64.b64encode(gzip.compress(b"{}")[:-5]) + b"\n", "expected a whole gzip file"),
        (head(b"\0" * (1 << 25)), "expected a whole gzip file"),  # a bomb
        (head(b"[" * 100_000), "expected JSON"),
        (head([]), "expected a table 'types'"),
        (_with(signals=[]), "expected a table 'signals'"),
        (_with(signals={"x": {}}), "signal 'x': expected its own number"),
        (_with(signals={"65536": {}}), "signal '65536': expected its own number"),
        (_with(signals={"1": {}, "01": {}}), "signal '1': expected a name, group and type"),
        (_with(types={}), "signal '300': expected a type .* found '4', which is 'None'"),
        (_with(types={"4": "QUAD"}), "found '4', which is 'QUAD'"),
        (_with(groups={}), "signal '300': expected a group of the header, found '4'"),
    ],
)
def test_a_bad_header_is_named(content: bytes, expected: str, tmp_path: Path) -> None:
    path = tmp_path / "log.dat"
    path.write_bytes(content)
    with pytest.raises(BadInput, match=expected):
        read(path)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=8,
)
rows = st.fixed_dictionaries({"name": json_values, "group": json_values, "type": json_values})
headers = st.one_of(
    st.binary(max_size=60),
    st.binary(max_size=60).map(head),
    json_values.map(head),
    st.fixed_dictionaries(
        {
            "types": st.just(HEADER["types"]) | json_values,
            "groups": st.just(HEADER["groups"]) | json_values,
            "signals": st.dictionaries(
                st.integers(0, 70_000).map(str) | st.text(max_size=3),
                st.sampled_from(list(HEADER["signals"].values())) | rows | json_values,
                max_size=4,
            ),
        }
    ).map(head),
    st.just(head()),
)
damaged_bodies = st.one_of(
    st.binary(max_size=200),
    st.tuples(packages_of_any_bits, st.binary(max_size=20)).map(lambda two: body(two[0]) + two[1]),
)


@given(start=headers, content=damaged_bodies)
@settings(on_files, max_examples=200)
def test_any_bytes_are_a_log_or_bad_input(start: bytes, content: bytes, tmp_path: Path) -> None:
    check_any_bytes(start + content, tmp_path)


def check_any_bytes(content: bytes, folder: Path) -> None:
    path = folder / "log.dat"
    path.write_bytes(content)
    for ending in ("ulg", "dat"):
        try:
            convert(path, folder / f"out.{ending}", force=True)
        except BadInput as error:
            assert str(error).isprintable()
    assert path.read_bytes() == content


@pytest.mark.skipif("STRIX_FUZZ_S" not in os.environ, reason="STRIX_FUZZ_S=300 fuzzes that long")
def test_fuzz(tmp_path: Path) -> None:
    end = time.monotonic() + float(os.environ["STRIX_FUZZ_S"])
    count = 0

    @given(start=headers, content=damaged_bodies)
    @settings(on_files, max_examples=2000, database=None)
    def some(start: bytes, content: bytes) -> None:
        nonlocal count
        count += 1
        if time.monotonic() < end:
            check_any_bytes(start + content, tmp_path)

    while time.monotonic() < end:
        some()
    print(f"{count} inputs")
