"""A damaged log gives back every intact block, and nothing that was not written.

The damage of random kinds goes on for as many seconds as STRIX_FUZZ_S says:
STRIX_FUZZ_S=300 pytest tools/tests/test_log_integrity.py -k random
"""

from __future__ import annotations

import io
import json
import os
import struct
import time
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st
from pyulog import ULog
from typer.testing import CliRunner
from written_log import (
    BLOCK_END,
    SECTOR,
    Written,
    damages,
    flipped,
    fly_for,
    padded,
    preallocated,
    records,
    resealed,
    topic_ids,
)

from strix.errors import BadInput
from strix.log import blocks
from strix.log.blocks import Block, scan
from strix.log.check import check
from strix.log.cli import log_app
from strix.log.recover import recover
from strix.log.survey import survey


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("logs")


@pytest.fixture(scope="module")
def log(folder: Path) -> Written:
    return fly_for(1.5, 11, folder / "log.ulg")


@pytest.fixture(scope="module")
def older(folder: Path) -> Written:
    return fly_for(2.5, 10, folder / "older.ulg")


def scanned(content: bytes) -> list[bytes]:
    found = scan(io.BytesIO(content))
    return [content[item.start : item.end] for item in found if isinstance(item, Block)]


def put(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def recovered(content: bytes, folder: Path, header_from: Path | None = None) -> bytes:
    path = put(folder / "damaged.ulg", content)
    out = folder / "recovered.ulg"
    recover(path, out, header_from, force=True)
    assert path.read_bytes() == content
    return out.read_bytes()


# ---- a log as the flight software wrote it ----


def test_a_whole_log_is_found_intact_and_recovered_byte_for_byte(
    log: Written, tmp_path: Path
) -> None:
    found = check(log.path)
    assert found.intact
    assert found.to_dict()["blocks"] == len(log.blocks)
    assert found.begin_s == 0.0
    assert found.end_s == pytest.approx(1.5, abs=0.1)
    assert recovered(log.content, tmp_path) == log.content


def test_the_commands_say_by_their_status_whether_the_log_is_whole(
    log: Written, tmp_path: Path
) -> None:
    damaged = put(tmp_path / "damaged.ulg", flipped(log.content, 8 * len(log.content) // 2))
    run = CliRunner().invoke
    assert run(log_app, ["check", str(log.path)]).exit_code == 0
    assert run(log_app, ["check", str(damaged)]).exit_code == 1
    assert run(log_app, ["check", str(tmp_path / "none.ulg")]).exit_code == 2
    printed = json.loads(run(log_app, ["check", "--json", str(damaged)]).stdout)
    assert printed["missing_blocks"] == 1
    assert not printed["intact"]
    out = str(tmp_path / "out.ulg")
    assert run(log_app, ["recover", str(damaged), "-o", out]).exit_code == 0
    again = run(log_app, ["recover", str(damaged), "-o", out])
    assert (again.exit_code, "--force" in again.stderr) == (2, True)
    assert run(log_app, ["recover", str(damaged), "-o", out, "--force"]).exit_code == 0


def test_records_that_found_no_room_are_told_by_topic(log: Written, tmp_path: Path) -> None:
    ids = topic_ids(log.content)
    last = bytearray(log.blocks[-1])
    header = struct.pack("<cH", b"D", ids["log_status"])
    at = last.rindex(header) + len(header)
    by_id = at + 8 + 5 * 4  # behind timestamp, bytes, write_errors, stall, dropped, dropped_text
    struct.pack_into("<II", last, at + 8 + 4, 2, 250_000)  # write_errors, longest_stall_us
    struct.pack_into("<II", last, by_id - 8, 12, 5)  # dropped, dropped_text
    struct.pack_into("<I", last, by_id + 4 * ids["vehicle_gps_position"], 7)
    path = put(tmp_path / "drops.ulg", b"".join([*log.blocks[:-1], resealed(last)]))
    found = check(path)
    assert (found.damaged, found.intact) == (False, False)
    assert found.status is not None
    assert found.status.dropped == {"vehicle_gps_position": 7, "text": 5}
    assert (found.status.write_errors, found.status.longest_stall_s) == (2, 0.25)
    assert CliRunner().invoke(log_app, ["check", str(path)]).exit_code == 1


# ---- damage ----


def test_a_log_cut_at_any_byte_gives_every_block_before_the_cut(log: Written) -> None:
    starts = log.starts()
    ends = starts[1:]
    whole = 0  # blocks before the cut
    for cut in range(len(log.content) - 65536, len(log.content)):
        while ends[whole] <= cut:
            whole += 1
        begin = max(whole - 2, 0)  # what came before is as for the last cut
        assert scanned(log.content[starts[begin] : cut]) == list(log.blocks[begin:whole])


@pytest.mark.parametrize("lost", [1, 511, 512, 4096, 5000, 65536, 100_000])
def test_what_a_cut_took_is_told(log: Written, tmp_path: Path, lost: int) -> None:
    cut = len(log.content) - lost
    kept = [end for end in log.starts() if end <= cut]
    found = check(put(tmp_path / "cut.ulg", log.content[:cut]))
    assert len(found.log.blocks) == len(kept) - 1
    assert found.log.torn_bytes == cut - kept[-1]
    assert found.damaged == (cut != kept[-1])
    assert recovered(log.content[:cut], tmp_path) == log.content[: kept[-1]]


def test_a_flipped_bit_costs_its_block_and_no_other(log: Written) -> None:
    before, block, after = log.blocks[4:7]
    assert len(block) > 4000
    for bit in range(8 * len(block)):
        assert scanned(before + flipped(block, bit) + after) == [before, after]


@pytest.mark.parametrize("byte", [0, 1, 2, 3, 20, -29, -28, -12, -8, -4, -1])
@pytest.mark.parametrize("which", [1, 5, -1])
def test_a_flipped_bit_is_told(log: Written, tmp_path: Path, which: int, byte: int) -> None:
    which %= len(log.blocks)
    start, end = log.starts()[which : which + 2]
    damaged = flipped(log.content, 8 * (end + byte if byte < 0 else start + byte) + 2)
    assert recovered(damaged, tmp_path) == log.content[:start] + log.content[end:]
    found = check(tmp_path / "damaged.ulg")
    assert found.damaged
    if which + 1 < len(log.blocks):
        assert [(gap.first, gap.last) for gap in found.log.gaps] == [(which, which)]
        assert found.log.damaged_bytes == end - start
    else:
        assert found.log.torn_bytes == end - start


def test_recovered_records_are_those_outside_the_damaged_blocks(
    log: Written, tmp_path: Path
) -> None:
    starts = log.starts()
    damaged = bytearray(log.content)
    damaged[starts[7] + 100 : starts[9] + 1] = bytes(starts[9] + 1 - starts[7] - 100)
    damaged[starts[20] : starts[20] + SECTOR] = os.urandom(SECTOR)
    out = recovered(bytes(damaged), tmp_path)
    kept = [block for i, block in enumerate(log.blocks) if i not in (7, 8, 9, 20)]
    assert records(out) == [record for block in kept for record in records(block)]

    read = ULog(str(tmp_path / "recovered.ulg"))
    assert not read.file_corruption
    rows = Counter(m[3] + 256 * m[4] for m in records(out) if m[2:3] == b"D")
    assert {topic.msg_id: len(topic.data["timestamp"]) for topic in read.data_list} == rows
    found = check(tmp_path / "damaged.ulg")
    assert [(gap.first, gap.last) for gap in found.log.gaps] == [(7, 9), (20, 20)]
    assert [gap.to_us for gap in found.log.gaps] == [
        BLOCK_END.unpack(log.blocks[after][-BLOCK_END.size :])[3] for after in (10, 21)
    ]


def test_blocks_that_are_there_twice_come_out_once(log: Written, tmp_path: Path) -> None:
    doubled = b"".join((*log.blocks[:9], *log.blocks[3:6], *log.blocks[9:]))
    assert recovered(doubled, tmp_path) == log.content
    found = check(tmp_path / "damaged.ulg")
    assert (found.log.repeated, found.damaged) == (3, True)


def test_blocks_in_disorder_come_out_in_order(log: Written, tmp_path: Path) -> None:
    mixed = b"".join((*log.blocks[:9], *log.blocks[12:15], *log.blocks[9:12], *log.blocks[15:]))
    assert recovered(mixed, tmp_path) == log.content


def test_a_block_around_an_intact_block_is_none(log: Written) -> None:
    inner = log.blocks[-1]
    outer = bytearray(log.blocks[1][:40] + inner + log.blocks[1][-BLOCK_END.size :])
    struct.pack_into("<I", outer, len(outer) - 8, len(outer))
    assert len(outer) <= 4096
    assert scanned(resealed(outer)) == [inner]


# ---- an older log behind a new one ----


def test_an_older_log_behind_a_new_one_stays_behind(
    log: Written, older: Written, tmp_path: Path
) -> None:
    assert len(older.content) > len(log.content) + 65536
    for content in (
        log.content + older.content,
        padded(log.content) + older.content,
        preallocated(log.content, older.content),
        preallocated(log.content, older.content) + bytes(100_000),
    ):
        assert recovered(content, tmp_path) == log.content
        found = check(tmp_path / "damaged.ulg")
        assert found.intact
        assert list(found.log.stale) == [10]
        assert found.log.stale[10].blocks > 16


def test_a_power_cut_in_a_preallocated_file_costs_the_unfinished_block(
    log: Written, older: Written, tmp_path: Path
) -> None:
    ends = log.starts()[1:]
    for sectors in range(60, 100):
        cut = log.content[: sectors * SECTOR]
        kept = max(end for end in ends if end <= len(cut))
        assert recovered(preallocated(cut, older.content), tmp_path) == log.content[:kept]
        torn = cut[kept:] != older.content[kept : len(cut)]  # both aircraft began at standstill
        assert check(tmp_path / "damaged.ulg").damaged == torn


def test_zeros_that_were_allocated_and_never_written_are_no_damage(
    log: Written, tmp_path: Path
) -> None:
    for rest in (bytes(1), bytes(3_000_000), bytes(-len(log.content) % SECTOR) + b"\xff" * 9999):
        assert recovered(log.content + rest, tmp_path) == log.content
        found = check(tmp_path / "damaged.ulg")
        assert found.intact
        assert found.log.padding_bytes == len(rest.rstrip(b"\xff"))


def test_only_the_zeros_next_to_the_log_are_its_padding(log: Written, tmp_path: Path) -> None:
    rest = b"an old photograph" + bytes(3_000_000)
    found = check(put(tmp_path / "photo.ulg", padded(log.content) + rest))
    assert found.log.padding_bytes == len(padded(log.content)) - len(log.content)
    assert found.intact


# ---- the header is lost ----


def test_without_its_header_a_log_needs_another_of_the_same_firmware(
    log: Written, older: Written, tmp_path: Path
) -> None:
    damaged = flipped(log.content, 8 * 300)
    with pytest.raises(BadInput, match=r"first block.*--header-from"):
        recovered(damaged, tmp_path)
    assert not (tmp_path / "recovered.ulg").exists()
    out = recovered(damaged, tmp_path, header_from=older.path)
    assert records(out) == [record for block in log.blocks[1:] for record in records(block)]
    assert b"Quad5in" not in out  # the other log's vehicle
    read = ULog(str(tmp_path / "recovered.ulg"))
    assert read.msg_info_dict == {"header_from": "older.ulg"}
    whole = ULog(str(log.path))
    for topic in read.data_list:
        (same,) = [
            t for t in whole.data_list if (t.name, t.multi_id) == (topic.name, topic.multi_id)
        ]
        for column, values in topic.data.items():
            assert values.tobytes() == same.data[column][-len(values) :].tobytes()
    assert not check(tmp_path / "damaged.ulg").has_header


def test_the_header_of_another_firmware_is_refused(
    log: Written, older: Written, tmp_path: Path
) -> None:
    for old, new in (
        (b"float[3] field_ut;", b"float[4] field_ut;"),
        (b"\x00log_block", b"\x00log_blink"),
    ):
        assert older.blocks[0].count(old) == 1
        other = put(tmp_path / "other.ulg", resealed(older.blocks[0].replace(old, new)))
        with pytest.raises(BadInput, match=r"other\.ulg: expected"):
            recovered(flipped(log.content, 8 * 300), tmp_path, header_from=other)


# ---- the user's files ----


def test_the_input_is_never_changed(log: Written, tmp_path: Path) -> None:
    path = put(tmp_path / "log.ulg", flipped(log.content, 99_999))
    os.utime(path, ns=(1, 1))
    out = tmp_path / "out.ulg"
    check(path)
    recover(path, out)
    link = tmp_path / "link.ulg"
    link.symlink_to(path)
    hard = tmp_path / "hard.ulg"
    hard.hardlink_to(path)
    for same in (path, link, hard):
        with pytest.raises(BadInput, match="found the input"):
            recover(path, same, force=True)
    part = path.rename(tmp_path / "new.ulg.part")  # as an unfinished output is called
    with pytest.raises(BadInput, match=r"new\.ulg\.part: expected to write"):
        recover(part, tmp_path / "new.ulg")
    assert part.read_bytes() == flipped(log.content, 99_999)
    assert part.stat().st_mtime_ns == 1


def test_an_existing_file_is_overwritten_only_on_demand(log: Written, tmp_path: Path) -> None:
    out = put(tmp_path / "out.ulg", b"precious")
    with pytest.raises(BadInput, match=r"out\.ulg: .*--force"):
        recover(log.path, out)
    assert out.read_bytes() == b"precious"
    recover(log.path, out, force=True)
    assert out.read_bytes() == log.content
    with pytest.raises(BadInput, match="found a folder"):
        recover(log.path, tmp_path, force=True)


def test_what_is_no_log_is_refused_in_one_line(tmp_path: Path) -> None:
    for content in (b"", b"ULog", bytes(10_000), os.urandom(10_000)):
        path = put(tmp_path / "other", content)
        with pytest.raises(BadInput, match=f"other: expected blocks .* in {len(content)} bytes"):
            check(path)
    with pytest.raises(BadInput, match="No such file"):
        check(tmp_path / "none")


# ---- damage of all kinds ----


def test_random_damage_gives_every_intact_block_and_nothing_else(
    log: Written, older: Written, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    new, old = log.blocks[:8], older.blocks[:12]

    def holds(content: bytes, chunk: int) -> None:
        monkeypatch.setattr(blocks, "_CHUNK", chunk)
        places = [(content.find(block), kin) for kin in (new, old) for block in kin]
        there = [(place, kin) for place, kin in places if place >= 0]
        if not there:
            with pytest.raises(BadInput, match="expected blocks"):
                recovered(content, folder)
            return
        kin = min(there)[1]  # the log is that of the first intact block
        expected = [block for block in kin if block in content]
        has_header = expected[0] == kin[0]
        out = recovered(content, folder, None if has_header else log.path)
        body = b"".join(expected)
        assert out == body if has_header else out.endswith(body)
        assert records(out) == [record for block in expected for record in records(block)]
        found = survey(folder / "damaged.ulg")
        assert found.size == len(content)
        assert found.missing_blocks == kin.index(expected[-1]) + 1 - len(expected)

    chunks = st.sampled_from([97, 1000, 5000, 1 << 20])
    cases = given(damages(b"".join(new), b"".join(old)), chunks)
    patient = settings(
        deadline=None, max_examples=200, database=None, suppress_health_check=list(HealthCheck)
    )
    until = time.monotonic() + float(os.environ.get("STRIX_FUZZ_S", "0"))
    rounds = 0
    while rounds == 0 or time.monotonic() < until:
        seed(rounds)(patient(cases(holds)))()
        rounds += 1
    print(f"{200 * rounds} damaged files")
