"""A log as MCAP, for Foxglove: a channel a topic in Protobuf, the messages as foxglove.Log.

A Protobuf record of fixed-width fields always has the same length, so whole tables are encoded at
once, and floats keep their bits, NaN among them, which JSON could not say.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from mcap.writer import Writer

from strix.flightlog import LEVELS, Message
from strix.log.stream import LogSource, LogTopic, Records

# Numbers of descriptor.proto: types and labels of a field.
DOUBLE, FLOAT, FIXED64, FIXED32, BYTES, SFIXED32, SFIXED64 = 1, 2, 6, 7, 12, 15, 16
OPTIONAL, REPEATED = 1, 3
LOG_SCHEMA = {
    "title": "foxglove.Log",
    "type": "object",
    "properties": {
        "timestamp": {
            "type": "object",
            "title": "time",
            "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
        },
        "level": {"type": "integer"},
        "message": {"type": "string"},
        "name": {"type": "string"},
        "file": {"type": "string"},
        "line": {"type": "integer"},
    },
}


@dataclass(frozen=True)
class _Field:
    """One Protobuf field: a column of the log, or all elements of an array."""

    name: str
    number: int
    columns: list[str]
    repeated: bool
    kind: int  # of Protobuf
    wire: str  # NumPy type of an element as encoded


class _Encoder:
    """Protobuf of one topic: its descriptor, and its records as bytes of one length."""

    def __init__(self, topic: LogTopic) -> None:
        self.name = "strix." + re.sub(r"[^A-Za-z0-9_]", "_", topic.name)
        self._fields = _fields(topic)
        layout: list[tuple[str, Any]] = []
        self._constants: dict[str, bytes] = {}
        for f in self._fields:
            width = np.dtype(f.wire).itemsize
            if f.repeated:  # packed: tag, bytes, elements
                prefix = _varint(f.number << 3 | 2) + _varint(width * len(f.columns))
            elif f.kind == BYTES:
                prefix = _varint(f.number << 3 | 2) + _varint(width)
            else:
                prefix = _varint(f.number << 3 | (1 if width == 8 else 5))
            self._constants[f"tag{f.number}"] = prefix
            layout += [
                (f"tag{f.number}", f"V{len(prefix)}"),
                (f"{f.number}", (f.wire, (len(f.columns),))),
            ]
        self._dtype = np.dtype(layout)

    def descriptor(self) -> bytes:
        """A FileDescriptorSet of one file with one message."""
        package, _, name = self.name.partition(".")
        fields = b""
        for f in self._fields:
            label = REPEATED if f.repeated else OPTIONAL
            content = _part(1, f.name.encode()) + _number(3, f.number)
            fields += _part(2, content + _number(4, label) + _number(5, f.kind))
        message = _part(4, _part(1, name.encode()) + fields)
        file = _part(1, f"{name}.proto".encode()) + _part(2, package.encode()) + message
        return _part(1, file + _part(12, b"proto3"))

    def encode(self, rows: Records) -> tuple[bytes, int]:
        """All records one after another, and the bytes of each."""
        out = np.zeros(rows.size, dtype=self._dtype)
        for tag, prefix in self._constants.items():
            out[tag] = np.void(prefix)
        for f in self._fields:
            for index, column in enumerate(f.columns):
                out[f"{f.number}"][:, index] = rows[column]
        return out.tobytes(), self._dtype.itemsize


def _fields(topic: LogTopic) -> list[_Field]:
    arrays: dict[str, list[str]] = {}
    for column in topic.columns:
        arrays.setdefault(re.sub(r"\[\d+\]$", "", column), []).append(column)
    fields, names = [], set()
    for number, (array, columns) in enumerate(arrays.items(), start=1):
        dtype = topic.dtype[columns[0]]
        name = re.sub(r"[^A-Za-z0-9_]", "_", array)  # of a format inside a format: a[0].b
        name = f"{name}_{number}" if name in names else name
        names.add(name)
        wide = dtype.itemsize == 8
        match dtype.kind:
            case "f":
                kind, wire = (DOUBLE, "<f8") if wide else (FLOAT, "<f4")
            case "u":
                kind, wire = (FIXED64, "<u8") if wide else (FIXED32, "<u4")
            case "i":
                kind, wire = (SFIXED64, "<i8") if wide else (SFIXED32, "<i4")
            case _:
                kind, wire = BYTES, dtype.str
        repeated = columns[0].endswith("]")
        fields.append(_Field(name, number, columns, repeated, kind, wire))
    return fields


def write_mcap(source: LogSource, file: BinaryIO) -> None:
    """Writes the log; times are ns of log time, which begins at power-up."""
    writer = Writer(file)
    writer.start(profile="", library="strix")
    channels: dict[int, tuple[int, _Encoder]] = {}
    log_channel: int | None = None
    for chunk in source.chunks():
        if chunk.messages and log_channel is None:
            schema = writer.register_schema("foxglove.Log", "jsonschema", _json(LOG_SCHEMA))
            log_channel = writer.register_channel("/log", "json", schema)
        for message in chunk.messages:
            time_ns = round(message.time_s * 1e6) * 1000
            writer.add_message(log_channel or 0, time_ns, _log(message, time_ns), time_ns)

        encoded: list[tuple[int, bytes, int]] = []
        for number, rows in chunk.records.items():
            if number not in channels:
                topic = source.topics[number]
                encoder = _Encoder(topic)
                schema = writer.register_schema(encoder.name, "protobuf", encoder.descriptor())
                name = "/" + topic.label.replace(".", "/")
                channels[number] = (writer.register_channel(name, "protobuf", schema), encoder)
            channel, encoder = channels[number]
            encoded.append((channel, *encoder.encode(rows)))
        if not encoded:
            continue
        sizes = [rows.size for rows in chunk.records.values()]
        times_ns = np.concatenate([r["timestamp"] for r in chunk.records.values()]) * np.uint64(
            1000
        )
        table = np.repeat(np.arange(len(sizes)), sizes)
        row = np.concatenate([np.arange(size) for size in sizes])
        order = np.argsort(times_ns, kind="stable")
        in_order = zip(
            times_ns[order].tolist(), table[order].tolist(), row[order].tolist(), strict=True
        )
        for time_ns, which, index in in_order:
            channel, content, size = encoded[which]
            record = content[index * size : (index + 1) * size]
            writer.add_message(channel, time_ns, record, time_ns)
    writer.add_metadata("info", source.info)
    writer.finish()  # type: ignore[no-untyped-call]


def _log(message: Message, time_ns: int) -> bytes:
    severity = LEVELS.index(
        message.level
    )  # foxglove's: 1 debug, 2 info, 3 warning, 4 error, 5 fatal
    return _json(
        {
            "timestamp": {"sec": time_ns // 10**9, "nsec": time_ns % 10**9},
            "level": (5, 5, 5, 4, 3, 2, 2, 1)[severity],
            "message": message.text,
            "name": "",
            "file": "",
            "line": 0,
        }
    )


def _json(content: Any) -> bytes:
    return json.dumps(content).encode()


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    out.append(value)
    return bytes(out)


def _part(number: int, content: bytes) -> bytes:
    return _varint(number << 3 | 2) + _varint(len(content)) + content


def _number(number: int, value: int) -> bytes:
    return _varint(number << 3) + _varint(value)
