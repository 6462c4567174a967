"""A ULog read in bounded memory: a chunk of the file at a time, its records as NumPy arrays.

strix.flightlog reads a whole log at once, which is handier while the log fits into memory.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from strix.errors import BadInput
from strix.flightlog import LEVELS, MAGIC, Message

CHUNK = 1 << 22  # bytes of the file at a time
HEADER = 16  # bytes before the first message: magic, version, time of the start
LONGEST = 65535  # bytes of a message, by its uint16 size

KINDS = np.zeros(256, dtype=bool)  # of messages
KINDS[np.frombuffer(b"ABCDFILMOPQRS", dtype=np.uint8)] = True
DATA = ord("D")
NO_ID = 65536  # of a message that is no data; ids are less

# As NumPy has them. A bool stays the byte it is: nothing says that it is 0 or 1.
NUMPY_TYPES = {
    "bool": "u1",
    "char": "S",
    "double": "<f8",
    "float": "<f4",
    "int16_t": "<i2",
    "int32_t": "<i4",
    "int64_t": "<i8",
    "int8_t": "i1",
    "uint16_t": "<u2",
    "uint32_t": "<u4",
    "uint64_t": "<u8",
    "uint8_t": "u1",
}
# A topic's name becomes a file's name: it may not lead out of the output folder.
TOPIC_NAME = re.compile(r"[A-Za-z0-9_-]+(/[A-Za-z0-9_-]+)*")
FIELD = re.compile(r"([A-Za-z0-9_/-]+)(?:\[([1-9][0-9]{0,4})\])? ([A-Za-z0-9_]+)")

Records = NDArray[np.void]  # a row a record, a field a column: timestamp, q[0], q[1], ...
Bytes = NDArray[np.uint8]
Places = NDArray[np.int64]  # bytes from the file's begin


@dataclass(frozen=True)
class LogTopic:
    """One instance of a topic."""

    id: int  # in the file
    name: str
    instance: int
    dtype: np.dtype[np.void]
    longest: int  # bytes of a record with the padding that may follow dtype's

    @property
    def label(self) -> str:
        """The name, with the number of an instance that is not the first."""
        return f"{self.name}.{self.instance}" if self.instance else self.name

    @property
    def columns(self) -> list[str]:
        """Names, in the order of the log; an element of an array is name[index]."""
        return list(self.dtype.names or ())


@dataclass(frozen=True)
class Chunk:
    """What a part of the file holds, by topic id."""

    records: Mapping[int, Records] = field(default_factory=dict)
    places: Mapping[int, Places] = field(default_factory=dict)  # of each record
    messages: list[Message] = field(default_factory=list)
    dropouts_ms: int = 0  # that the log itself reports (ULog's 'O')
    end: int = 0  # bytes of the file read so far


class LogSource(Protocol):
    """A log of any format. chunks() may be called again; what stands below is as far as it went."""

    path: Path

    @property
    def info(self) -> dict[str, str]:
        """Texts about the whole log."""
        ...

    @property
    def topics(self) -> dict[int, LogTopic]:
        """By id."""
        ...

    @property
    def stopped_at(self) -> int | None:
        """Byte of the file where damage ended the reading."""
        ...

    def chunks(self) -> Iterator[Chunk]:
        """The log, part by part."""
        ...


class ULogSource:
    """A ULog. It is read up to the first thing that is no message of it: `strix log recover` gives
    back what stands behind damage.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._forget()

    def _forget(self) -> None:
        self.info: dict[str, str] = {}
        self.topics: dict[int, LogTopic] = {}
        self.stopped_at: int | None = None
        self._formats: dict[str, str] = {}
        # Bytes of a record by id. None is short enough for an id without a topic.
        self._shortest = np.full(NO_ID + 1, LONGEST + 1)
        self._longest = np.zeros(NO_ID + 1, dtype=np.int64)

    def chunks(self) -> Iterator[Chunk]:
        """The log, part by part. BadInput if it does not begin like a ULog."""
        self._forget()
        try:
            with self.path.open("rb") as file:
                head = file.read(HEADER)
                if len(head) < HEADER or not head.startswith(MAGIC):
                    raise BadInput(
                        f"{self.path}: expected a ULog file, which begins with 'ULog', "
                        f"found {head[: len(MAGIC)]!r}"
                    )
                begin, rest = HEADER, b""
                while self.stopped_at is None:
                    fresh = file.read(CHUNK)
                    content = rest + fresh
                    starts, used = _walk(content)
                    if not fresh:
                        self.stopped_at = begin if content else None
                        return
                    yield self._chunk(content, starts, used, begin)
                    begin, rest = begin + used, content[used:]
        except OSError as error:
            raise BadInput(
                f"{self.path}: expected a readable log, found: {error.strerror}"
            ) from None

    def _chunk(self, content: bytes, starts: list[int], used: int, begin: int) -> Chunk:
        all_bytes = np.frombuffer(content, dtype=np.uint8)
        places = np.array(starts, dtype=np.int64)
        ends = np.append(places[1:], used)
        sound = KINDS[all_bytes[places + 2]]
        if not sound.all():
            places, ends = self._stop(places, ends, int(np.argmin(sound)), begin)

        is_data = all_bytes[places + 2] == DATA
        texts, dropouts_ms = self._define(content, places[~is_data], ends[~is_data])

        sizes = ends - places - 5  # of the records, behind their msg_id
        ids = np.full(places.size, NO_ID)
        known = is_data & (sizes >= 0)
        ids[known] = all_bytes[places[known] + 3] + 256 * all_bytes[places[known] + 4].astype(int)
        sound = ~is_data | ((sizes >= self._shortest[ids]) & (sizes <= self._longest[ids]))
        if not sound.all():
            cut = int(np.argmin(sound))
            places, ends = self._stop(places, ends, cut, begin)
            ids = ids[:cut]

        records, whereabouts = {}, {}
        order = np.argsort(ids, kind="stable")
        numbers, firsts = np.unique(ids[order], return_index=True)
        for number, its in zip(numbers.tolist(), np.split(order, firsts)[1:], strict=True):
            if number != NO_ID:
                dtype, at = self.topics[number].dtype, places[its]
                rows = sliding_window_view(all_bytes, dtype.itemsize)[at + 5]
                records[number] = rows.view(dtype)[:, 0]
                whereabouts[number] = at + begin
        end = int(ends[-1]) if ends.size else 0
        messages = [message for place, message in texts if place < end]
        return Chunk(records, whereabouts, messages, dropouts_ms, begin + end)

    def _stop(self, places: Places, ends: Places, cut: int, begin: int) -> tuple[Places, Places]:
        self.stopped_at = begin + int(places[cut])
        return places[:cut], ends[:cut]

    def _define(
        self, content: bytes, places: Places, ends: Places
    ) -> tuple[list[tuple[int, Message]], int]:
        """Takes in every message but data; gives the texts with their places, and the dropouts."""
        texts: list[tuple[int, Message]] = []
        dropouts_ms = 0
        for place, end in zip(places.tolist(), ends.tolist(), strict=True):
            kind, body = content[place + 2 : place + 3], content[place + 3 : end]
            if kind == b"F":
                name, _, fields = body.decode("latin-1").partition(":")
                self._formats[name] = fields
            elif kind == b"A" and len(body) > 3:
                self._subscribe(int.from_bytes(body[1:3], "little"), body[0], body[3:])
            elif kind == b"I":
                self._take_info(body)
            elif kind == b"L" and len(body) >= 9:
                texts.append((place, _text(body[0], body[1:9], body[9:])))
            elif kind == b"C" and len(body) >= 11:  # the same with a tag
                texts.append((place, _text(body[0], body[3:11], body[11:])))
            elif kind == b"O":
                dropouts_ms += int.from_bytes(body[:2], "little")
        return texts, dropouts_ms

    def _take_info(self, body: bytes) -> None:
        key = body[1 : 1 + body[0]].decode("latin-1") if body else ""
        kind, _, name = key.partition(" ")
        value = body[1 + len(key) :]
        if kind.startswith("char["):
            self.info[name] = value.decode("utf-8", "replace")
        elif kind in NUMPY_TYPES and len(value) == np.dtype(NUMPY_TYPES[kind]).itemsize:
            self.info[name] = str(np.frombuffer(value, NUMPY_TYPES[kind])[0])

    def _subscribe(self, number: int, instance: int, name_bytes: bytes) -> None:
        name = name_bytes.decode("latin-1")
        if not TOPIC_NAME.fullmatch(name):
            raise BadInput(f"{self.path}: expected a topic's name, found {name!r}")
        columns: list[tuple[str, str, int]] = []
        longest = self._flatten(name, "", 0, columns)
        if ("timestamp", "<u8", 0) not in columns:
            raise BadInput(
                f"{self.path}: topic {name}: expected uint64_t timestamp as its first field, "
                f"found {self._formats[name][:40]!r}"
            )
        last = columns[-1]
        dtype = np.dtype(
            {
                "names": [column[0] for column in columns],
                "formats": [column[1] for column in columns],
                "offsets": [column[2] for column in columns],
                "itemsize": last[2] + np.dtype(last[1]).itemsize,  # less padding at the end
            }
        )
        self.topics[number] = LogTopic(number, name, instance, dtype, longest)
        self._shortest[number], self._longest[number] = dtype.itemsize, longest

    def _flatten(
        self, name: str, prefix: str, offset: int, columns: list[tuple[str, str, int]]
    ) -> int:
        """Adds the columns of a format, those of a format inside it too; gives where they end."""
        where = f"{self.path}: topic {name}"
        if name not in self._formats:
            raise BadInput(f"{where}: expected a format of this name, found none")
        for text in filter(None, self._formats[name].split(";")):
            parsed = FIELD.fullmatch(text)
            # Formats that contain themselves have no end: too long a column name stops them.
            if parsed is None or len(prefix) > 200:
                raise BadInput(f"{where}: expected fields as 'float[3] name', found {text[:60]!r}")
            kind, length, column = parsed[1], int(parsed[2] or 1), prefix + parsed[3]
            if kind == "char":  # a text is one column
                columns.append((column, f"S{length}", offset))
                offset += length
                continue
            for index in range(length):
                element = f"{column}[{index}]" if parsed[2] else column
                if kind in NUMPY_TYPES:
                    if not parsed[3].startswith("_padding"):
                        columns.append((element, NUMPY_TYPES[kind], offset))
                    offset += np.dtype(NUMPY_TYPES[kind]).itemsize
                else:
                    offset = self._flatten(kind, element + ".", offset, columns)
                if offset > LONGEST:
                    raise BadInput(f"{where}: expected at most {LONGEST} bytes, found more")
        if len({column[0] for column in columns}) < len(columns):
            raise BadInput(f"{where}: expected fields of different names, found one twice")
        return offset


def _walk(content: bytes) -> tuple[list[int], int]:
    """Where the whole messages begin, and where the last of them ends."""
    starts: list[int] = []
    add = starts.append
    at, last = 0, len(content) - 3
    while at <= last:  # every message of a log passes here: nothing else is done with it
        end = at + 3 + (content[at] | content[at + 1] << 8)
        if end > last + 3:
            break
        add(at)
        at = end
    return starts, at


def _text(level: int, time_us: bytes, text: bytes) -> Message:
    return Message(
        int.from_bytes(time_us, "little") * 1e-6, LEVELS[level & 7], text.decode("utf-8", "replace")
    )


def merge(tables: Sequence[Records], keys: Sequence[NDArray[Any]]) -> bytes:
    """The bytes of the rows of several tables, one row after another by key."""
    if not tables:
        return b""
    widths = np.concatenate([np.full(rows.size, rows.itemsize) for rows in tables])
    order = np.argsort(np.concatenate(keys), kind="stable")
    begins = np.empty(order.size, dtype=np.int64)
    begins[order] = np.cumsum(widths[order]) - widths[order]
    out = np.empty(int(widths.sum()), dtype=np.uint8)
    first = 0
    for rows in tables:
        at = begins[first : first + rows.size, None] + np.arange(rows.itemsize)
        out[at] = np.frombuffer(rows.tobytes(), dtype=np.uint8).reshape(rows.size, rows.itemsize)
        first += rows.size
    return out.tobytes()
