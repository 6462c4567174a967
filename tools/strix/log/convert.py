"""`strix convert`: a log in another format."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from strix.errors import BadInput
from strix.flightlog import MAGIC
from strix.log.mcap_file import write_mcap
from strix.log.stream import NUMPY_TYPES, Chunk, LogSource, LogTopic, Records, ULogSource, merge
from strix.log.ugglan import UgglanSource, write_ugglan

FOLDERS = ("csv", "parquet")  # a file a topic; the others are one file
FORMATS = (*FOLDERS, "mcap", "ugglan", "ulg")
ENDINGS = {"dat": "ugglan"}  # as Ugglan calls its own
MESSAGES = "logged_messages"  # the texts' file; no topic has this name
ROWS = 1 << 17  # of a topic, gathered before they are written: a Parquet row group
CLASSIC_TYPES = {np.dtype(kind).str: name for name, kind in NUMPY_TYPES.items() if name != "bool"}

Progress = Callable[[int], None]  # told how many bytes of the log are read


def open_log(path: Path, progress: Progress = lambda _: None) -> Watched:
    """A ULog, or what must be Ugglan's."""
    try:
        with path.open("rb") as file:
            begin = file.read(len(MAGIC))
    except OSError as error:
        raise BadInput(f"{path}: expected a readable log, found: {error.strerror}") from None
    is_ulog = begin.startswith(b"ULog")
    return Watched(ULogSource(path) if is_ulog else UgglanSource(path), is_ulog, progress)


class Watched:
    """A log that tells how far it is read."""

    def __init__(self, source: LogSource, is_ulog: bool, progress: Progress) -> None:
        self.is_ulog = is_ulog
        self.path = source.path
        self._source = source
        self._progress = progress

    @property
    def info(self) -> dict[str, str]:
        return self._source.info

    @property
    def topics(self) -> dict[int, LogTopic]:
        return self._source.topics

    @property
    def stopped_at(self) -> int | None:
        return self._source.stopped_at

    def chunks(self) -> Iterator[Chunk]:
        for chunk in self._source.chunks():
            self._progress(chunk.end)
            yield chunk


def format_of(out: Path, to: str | None) -> str:
    """What the user asked for: --to, or the ending of the output's name."""
    ending = out.suffix.lstrip(".").lower()
    wanted = to if to is not None else ENDINGS.get(ending, ending)
    if wanted not in FORMATS:
        place = "--to" if to is not None else f"-o {out}"
        raise BadInput(
            f"{place}: expected a format of {', '.join(FORMATS)}"
            f"{'' if to is not None else ' as its ending (or --to)'}, found {wanted!r}"
        )
    return wanted


def convert(
    path: Path,
    out: Path,
    to: str | None = None,
    force: bool = False,
    progress: Progress = lambda _: None,
) -> list[str]:
    """Writes the log `path` into `out`: a file, or a folder with a file a topic (CSV, Parquet).

    @return what the new form lacks, in words
    """
    wanted = format_of(out, to)
    source = open_log(path, progress)
    if out.exists() and out.samefile(path):
        raise BadInput(f"-o {out}: expected another file than the log itself")
    if out.exists() and not force and not (wanted in FOLDERS and _is_empty(out)):
        raise BadInput(f"-o {out}: expected a new name (or --force), found one that exists")
    if wanted == "ulg" and source.is_ulog:
        raise BadInput(f"{path}: expected Ugglan's data log to make a ULog of, found a ULog")
    lost: list[str] = []
    try:
        if wanted in FOLDERS:
            lost += _write_folder(source, out, wanted)
        else:
            lost += _write_file(source, out, wanted)
    except OSError as error:
        raise BadInput(f"-o {out}: expected to write there, found: {error.strerror}") from None
    except pa.ArrowInvalid as error:  # the same topic with other fields further on
        raise BadInput(f"{path}: expected one format a topic, found: {error}") from None
    if (rest := unread(source)) > 0:
        at = source.stopped_at
        lost.append(f"{rest} bytes from byte {at} on are damaged or cut and were not read")
    return lost


def unread(source: LogSource) -> int:
    """Bytes behind the place where reading stopped, but for zeros at the file's end."""
    if source.stopped_at is None:
        return 0
    end = source.stopped_at
    with source.path.open("rb") as file:
        file.seek(end)
        at = end
        while content := file.read(1 << 20):
            if used := len(content.rstrip(b"\0")):
                end = at + used
            at += len(content)
    return end - source.stopped_at


def _is_empty(out: Path) -> bool:
    return out.is_dir() and not any(out.iterdir())


def _write_file(source: LogSource, out: Path, wanted: str) -> list[str]:
    """Under another name until it is whole."""
    part = out.with_name(out.name + ".part")
    if out.is_dir():
        raise BadInput(f"-o {out}: expected a file, found a folder")
    out.parent.mkdir(parents=True, exist_ok=True)
    lost: list[str] = []
    try:
        with part.open("wb") as file:
            if wanted == "mcap":
                write_mcap(source, file)
            elif wanted == "ugglan":
                lost = write_ugglan(source, file)
            else:
                write_ulog(source, file)
        part.replace(out)
    finally:
        part.unlink(missing_ok=True)
    return lost


def write_ulog(source: LogSource, file: BinaryIO) -> None:
    """Writes the log as ULog; its topics and their ids are those of the source."""
    begun = False
    for chunk in source.chunks():
        if not begun:
            file.write(_ulog_header(source))
            begun = True
        messages = [
            _ulog_messages(source.topics[number], rows) for number, rows in chunk.records.items()
        ]
        file.write(merge(messages, list(chunk.places.values())))
    if not begun:
        file.write(_ulog_header(source))


def _ulog_header(source: LogSource) -> bytes:
    header = MAGIC + b"\x01" + struct.pack("<Q", 0) + _message("B", bytes(40))
    infos = {"sys_name": "Ugglan", **source.info}
    for key, text in infos.items():
        value = text.encode()
        typed = f"char[{len(value)}] {key}".encode()
        if len(value) < 65000:  # else it has no room; only the header's own wording is lost
            header += _message("I", bytes([len(typed)]) + typed + value)
    for topic in source.topics.values():
        fields = "".join(f"{CLASSIC_TYPES[topic.dtype[c].str]} {c};" for c in topic.columns)
        header += _message("F", f"{topic.name}:{fields}".encode())
    for topic in source.topics.values():
        subscription = struct.pack("<BH", topic.instance, topic.id) + topic.name.encode()
        header += _message("A", subscription)
    return header


def _ulog_messages(topic: LogTopic, rows: Records) -> Records:
    content = [(column, topic.dtype[column]) for column in topic.columns]
    dtype = np.dtype([("size/", "<u2"), ("type/", "u1"), ("id/", "<u2"), *content])
    out = np.empty(rows.size, dtype=dtype)
    out["size/"], out["type/"], out["id/"] = dtype.itemsize - 3, ord("D"), topic.id
    for column in topic.columns:
        out[column] = rows[column]
    return out


def _message(kind: str, content: bytes) -> bytes:
    return struct.pack("<HB", len(content), ord(kind)) + content


def _write_folder(source: LogSource, out: Path, wanted: str) -> list[str]:
    tables = _Tables(out, wanted)
    try:
        for chunk in source.chunks():
            for number, rows in chunk.records.items():
                topic = source.topics[number]
                tables.add(topic.label, {c: _column(rows[c]) for c in topic.columns})
            if chunk.messages:
                texts = {
                    "timestamp": [round(m.time_s * 1e6) for m in chunk.messages],
                    "level": [m.level for m in chunk.messages],
                    "message": [m.text for m in chunk.messages],
                }
                tables.add(MESSAGES, {name: pa.array(value) for name, value in texts.items()})
    finally:
        tables.close()
    return []


def _column(values: Any) -> Any:
    if values.dtype.kind == "S":
        return pa.array([text.decode("utf-8", "replace") for text in values.tolist()])
    return pa.array(np.ascontiguousarray(values))


class _Tables:
    """The files of an output folder, one a topic; rows gather until a write is worth it."""

    def __init__(self, out: Path, wanted: str) -> None:
        self._out = out
        self._wanted = wanted
        self._writers: dict[str, Any] = {}
        self._waiting: dict[str, list[Any]] = {}
        out.mkdir(parents=True, exist_ok=True)

    def add(self, name: str, columns: dict[str, Any]) -> None:
        """Rows of a table."""
        waiting = self._waiting.setdefault(name, [])
        waiting.append(pa.table(columns))
        if sum(table.num_rows for table in waiting) >= ROWS:
            self._write(name)

    def _write(self, name: str) -> None:
        table = pa.concat_tables(self._waiting.pop(name))
        if name not in self._writers:
            path = self._out / f"{name}.{self._wanted}"
            path.parent.mkdir(parents=True, exist_ok=True)
            if self._wanted == "csv":
                self._writers[name] = pyarrow.csv.CSVWriter(path, table.schema, write_options=CSV)
            else:
                self._writers[name] = pyarrow.parquet.ParquetWriter(path, table.schema)
        self._writers[name].write_table(table)

    def close(self) -> None:
        for name in list(self._waiting):
            self._write(name)
        for writer in self._writers.values():
            writer.close()


CSV = pyarrow.csv.WriteOptions(quoting_style="needed")
