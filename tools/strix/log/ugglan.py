"""Ugglan's data log, read and written.

It is described in github.com/real-tintin/ugglan, doc/source/software_design.rst: one line
base64(gzip(JSON)), then packages without padding, little-endian: uint16 signal id, the value,
uint8 ms since the package before. The JSON names every id that is used:

    {"start_time": "2020-09-04T19:31:08Z",
     "types": {"0": "UINT8", "7": "DOUBLE"},
     "groups": {"0": "IMU"},
     "signals": {"0": {"name": "AccelerationX", "group": 0, "type": 7}}}

Only its own tables count, never a built-in one: ids may be any, further keys are passed over.

A signal is a topic IMU/AccelerationX here, with the one field `value`; its id is the topic's. Time
is in whole ms from the first package, and a longer pause than 255 ms is one of 255 ms: the file
does not hold more.
"""

from __future__ import annotations

import base64
import binascii
import gzip
import json
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from strix.errors import BadInput
from strix.log.stream import CHUNK, Chunk, LogSource, LogTopic, Places, Records, merge

TYPES = {
    "BOOL": "u1",
    "UINT8": "u1",
    "UINT16": "<u2",
    "UINT32": "<u4",
    "UINT64": "<u8",
    "SINT8": "i1",
    "SINT16": "<i2",
    "SINT32": "<i4",
    "SINT64": "<i8",
    "FLOAT": "<f4",
    "DOUBLE": "<f8",
}
LONGEST_LINE = 1 << 20  # bytes of a header, and sixteen times that unpacked
LONGEST_PAUSE_MS = 255
HEADER_INFO = "ugglan_header"  # key in a ULog: the header that its topics came from
SETTLED_US = 10_000_000  # rings empty in turn: how much later than another a record may come


@dataclass(frozen=True)
class Signal:
    """A row of the header's signal table."""

    id: int
    group: str
    name: str
    dtype: str  # NumPy's


def parse_header(where: str, text: str) -> list[Signal]:
    """The signal table, its ids replaced by what they mean. BadInput names what is wrong."""
    try:
        header = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{where}: expected JSON, found: {str(error)[:100]}") from None
    types, groups, signals = (
        _table(where, header, name) for name in ("types", "groups", "signals")
    )
    found: dict[int, Signal] = {}
    for key, row in signals.items():
        place = f"{where}, signal {key[:20]!r}"
        if not re.fullmatch(r"[0-9]{1,5}", key) or int(key) > 65535 or int(key) in found:
            raise BadInput(f"{place}: expected its own number of at most 65535")
        if not isinstance(row, dict) or not isinstance(row.get("name"), str):
            raise BadInput(f"{place}: expected a name, group and type, found {str(row)[:60]!r}")
        kind, group = types.get(str(row.get("type"))), groups.get(str(row.get("group")))
        if not isinstance(kind, str) or kind not in TYPES:
            raise BadInput(
                f"{place}: expected a type that the header calls one of {', '.join(TYPES)}, "
                f"found {str(row.get('type'))[:20]!r}, which is {str(kind)[:20]!r}"
            )
        if not isinstance(group, str):
            raise BadInput(
                f"{place}: expected a group of the header, found {str(row.get('group'))[:20]!r}"
            )
        found[int(key)] = Signal(int(key), group, row["name"], TYPES[kind])
    return list(found.values())


def _table(where: str, header: Any, name: str) -> dict[str, Any]:
    table = header.get(name) if isinstance(header, dict) else None
    if not isinstance(table, dict):
        raise BadInput(f"{where}: expected a table '{name}' in the JSON, found none")
    return table


def _topics(signals: list[Signal]) -> dict[int, LogTopic]:
    topics: dict[int, LogTopic] = {}
    names: set[str] = set()
    for signal in signals:
        parts = [re.sub(r"[^A-Za-z0-9_-]", "_", part) for part in (signal.group, signal.name)]
        name = f"{parts[0] or '_'}/{parts[1] or '_'}"[:200]  # as ULog allows
        if name.lower() in names:  # a file each, also where a file's name has no case
            name = f"{name}_{signal.id}"
        names.add(name.lower())
        dtype = np.dtype([("timestamp", "<u8"), ("value", signal.dtype)])
        topics[signal.id] = LogTopic(signal.id, name, 0, dtype, dtype.itemsize)
    return topics


class UgglanSource:
    """One of Ugglan's logs. A cut last package is passed over; an id that the header does not
    have is BadInput, as nothing behind it can be told apart.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.info: dict[str, str] = {}
        self.topics: dict[int, LogTopic] = {}
        self.stopped_at: int | None = None

    def chunks(self) -> Iterator[Chunk]:
        """The log, part by part."""
        self.stopped_at = None
        try:
            with self.path.open("rb") as file:
                text = self._header(file.readline(LONGEST_LINE))
                self.info = {HEADER_INFO: text}
                self.topics = _topics(parse_header(f"{self.path}, header", text))
                sizes = {n: topic.dtype.itemsize - 8 for n, topic in self.topics.items()}
                begin, time_ms, rest = file.tell(), 0, b""
                while fresh := file.read(CHUNK):
                    content = rest + fresh
                    starts, used = self._walk(content, sizes, begin)
                    chunk, time_ms = self._chunk(content, starts, begin, time_ms)
                    begin, rest = begin + used, content[used:]
                    yield chunk
                self.stopped_at = begin if rest else None
        except OSError as error:
            raise BadInput(
                f"{self.path}: expected a readable log, found: {error.strerror}"
            ) from None

    def _header(self, line: bytes) -> str:
        where = f"{self.path}, header"
        if not line.endswith(b"\n"):
            raise BadInput(
                f"{where}: expected one line of text (Ugglan's data log) or 'ULog', "
                f"found {line[:20]!r}"
            )
        try:
            packed = base64.b64decode(line.rstrip(b"\r\n"), validate=True)
            unzip = zlib.decompressobj(wbits=31)  # gzip
            text = unzip.decompress(packed, 16 * LONGEST_LINE)
            if not unzip.eof:
                raise BadInput(f"{where}: expected a whole gzip file, found a cut or endless one")
            return text.decode("utf-8")
        except (binascii.Error, zlib.error, UnicodeDecodeError) as error:
            raise BadInput(f"{where}: expected base64(gzip(JSON)), found: {error}") from None

    def _walk(self, content: bytes, sizes: dict[int, int], begin: int) -> tuple[list[int], int]:
        """Where the whole packages begin, and where the last of them ends."""
        starts: list[int] = []
        at, last = 0, len(content) - 2
        while at <= last:
            size = sizes.get(content[at] | content[at + 1] << 8)
            if size is None:
                found = content[at] | content[at + 1] << 8
                known = ", ".join(map(str, sorted(sizes)[:8])) + (", …" if len(sizes) > 8 else "")
                raise BadInput(
                    f"{self.path}, byte {begin + at}: expected the id of a signal of the header "
                    f"({known or 'it has none'}), found {found}"
                )
            end = at + 3 + size
            if end > len(content):
                break
            starts.append(at)
            at = end
        return starts, at

    def _chunk(
        self, content: bytes, starts: list[int], begin: int, time_ms: int
    ) -> tuple[Chunk, int]:
        all_bytes = np.frombuffer(content, dtype=np.uint8)
        places = np.array(starts, dtype=np.int64)
        if not places.size:
            return Chunk(end=begin), time_ms
        ids = all_bytes[places] + 256 * all_bytes[places + 1].astype(np.int64)
        numbers = np.unique(ids).tolist()
        widths = np.zeros(65536, dtype=np.int64)
        for number in numbers:
            widths[number] = self.topics[number].dtype.itemsize - 8
        pauses = all_bytes[places + 2 + widths[ids]].astype(np.int64)
        times_ms = time_ms + np.cumsum(pauses)

        records: dict[int, Records] = {}
        for number in numbers:
            its, dtype = ids == number, self.topics[number].dtype
            rows = np.empty(int(its.sum()), dtype=dtype)
            rows["timestamp"] = times_ms[its].astype(np.uint64) * np.uint64(1000)
            values = sliding_window_view(all_bytes, int(widths[number]))[places[its] + 2]
            rows["value"] = values.view(dtype["value"])[:, 0]
            records[number] = rows
        whereabouts = {number: places[ids == number] + begin for number in numbers}
        end = begin + int(places[-1] + 3 + widths[ids[-1]])
        return Chunk(records, whereabouts, end=end), int(times_ms[-1])


def write_ugglan(source: LogSource, file: BinaryIO) -> list[str]:
    """Writes a log as Ugglan does; gives what was lost, in words.

    Times are rounded down to ms. uint64 and int64 become DOUBLE, which Ugglan's own reader knows:
    exact up to 2^53. A header that came with the log from Ugglan is given back as it was.
    """
    for _ in source.chunks():  # the header needs every topic
        pass
    table = _old_table(source) or _new_table(source)
    file.write(base64.b64encode(gzip.compress(table.header.encode(), mtime=0)) + b"\n")

    packer = _Packer(table)
    kept: list[_Waiting] = []
    messages = 0
    for chunk in source.chunks():
        messages += len(chunk.messages)
        kept += [_Waiting(n, rows, chunk.places[n]) for n, rows in chunk.records.items()]
        newest_us = max((int(w.rows["timestamp"].max()) for w in kept), default=0)
        settled_us = np.uint64(max(newest_us - SETTLED_US, 0))
        old = [w.rows["timestamp"] < settled_us for w in kept]
        file.write(packer.pack([w.part(o) for w, o in zip(kept, old, strict=True) if o.any()]))
        kept = [w.part(~o) for w, o in zip(kept, old, strict=True) if not o.all()]
    file.write(packer.pack(kept))

    lost = []
    if packer.shortened:
        lost.append(f"{packer.shortened} pauses longer than {LONGEST_PAUSE_MS} ms are that now")
    if messages:
        lost.append(f"{messages} messages are left out: the format has no texts")
    return lost


@dataclass(frozen=True)
class _Waiting:
    """Records that are not written yet, as an older one of another topic may follow."""

    id: int
    rows: Records
    places: Places

    def part(self, these: NDArray[np.bool_]) -> _Waiting:
        return _Waiting(self.id, self.rows[these], self.places[these])


@dataclass(frozen=True)
class _Table:
    header: str
    columns: dict[int, list[tuple[int, str, str]]]  # by topic: signal id, field, NumPy type


def _old_table(source: LogSource) -> _Table | None:
    """The header that the log brought with it, if its topics are still those of the log."""
    header = source.info.get(HEADER_INFO, "")
    try:
        topics = _topics(parse_header(HEADER_INFO, header))
    except BadInput:
        return None
    for number, topic in source.topics.items():
        old = topics.get(number)
        if old is None or (old.name, old.dtype) != (topic.name, topic.dtype):
            return None
    return _Table(header, {n: [(n, "value", t.dtype["value"].str)] for n, t in topics.items()})


def _new_table(source: LogSource) -> _Table:
    """One signal for every field, one group for every topic."""
    names = {np.dtype(kind).str: name for name, kind in TYPES.items()}
    type_ids = {name: number for number, name in enumerate(TYPES) if not name.endswith("64")}
    groups: dict[str, str] = {}
    signals: dict[str, dict[str, Any]] = {}
    columns: dict[int, list[tuple[int, str, str]]] = {}
    for group, topic in enumerate(source.topics.values()):
        groups[str(group)] = topic.label
        for column in topic.columns:
            kind = topic.dtype[column]
            if column == "timestamp" or kind.kind == "S":
                continue
            name = "DOUBLE" if kind.itemsize == 8 else names[kind.str]
            row = {"name": column, "group": group, "type": type_ids[name]}
            columns.setdefault(topic.id, []).append((len(signals), column, TYPES[name]))
            signals[str(len(signals))] = row
    if len(signals) > 65536:
        raise BadInput(f"{source.path}: expected at most 65536 fields, found {len(signals)}")
    header = {
        "start_time": "1970-01-01T00:00:00Z",  # unknown: a flight has no calendar
        "types": {str(number): name for name, number in type_ids.items()},
        "groups": groups,
        "signals": signals,
        "info": {key: text for key, text in source.info.items() if key != HEADER_INFO},
    }
    return _Table(json.dumps(header, indent=4), columns)


class _Packer:
    """Makes packages of records: one a field, the first of a record with the time."""

    def __init__(self, table: _Table) -> None:
        self.shortened = 0  # pauses
        self._time_ms: int | None = None
        self._columns = table.columns
        self._layouts = {
            number: np.dtype(
                [
                    field
                    for signal, _, kind in its
                    for field in ((f"id{signal}", "<u2"), (f"{signal}", kind), (f"+{signal}", "u1"))
                ]
            )
            for number, its in table.columns.items()
        }

    def pack(self, waiting: list[_Waiting]) -> bytes:
        """The packages of the records, in order of time; of equal times, in that of the file."""
        waiting = [w for w in waiting if w.id in self._columns]
        if not waiting:
            return b""
        times_ms = np.concatenate([w.rows["timestamp"] // 1000 for w in waiting]).astype(np.int64)
        order = np.lexsort((np.concatenate([w.places for w in waiting]), times_ms))
        if self._time_ms is None:
            self._time_ms = int(times_ms[order[0]])
        sorted_ms = np.maximum(times_ms[order], self._time_ms)  # what comes too late is now
        pauses, ranks = np.empty_like(order), np.empty_like(order)
        pauses[order] = np.diff(sorted_ms, prepend=self._time_ms)
        ranks[order] = np.arange(order.size)
        self._time_ms = int(sorted_ms[-1])
        self.shortened += int((pauses > LONGEST_PAUSE_MS).sum())
        pauses = pauses.clip(0, LONGEST_PAUSE_MS)

        packages = []
        splits = np.cumsum([w.rows.size for w in waiting])[:-1]
        for w, its_pauses in zip(waiting, np.split(pauses, splits), strict=True):
            out = np.zeros(w.rows.size, dtype=self._layouts[w.id])
            for signal, field, _ in self._columns[w.id]:
                out[f"id{signal}"] = signal
                out[f"{signal}"] = w.rows[field]
            out[f"+{self._columns[w.id][0][0]}"] = its_pauses
            packages.append(out)
        return merge(packages, np.split(ranks, splits))
