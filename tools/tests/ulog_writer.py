"""Writes ULog files for tests, with the topics that lib/Logger/Topics.def lists.

It follows the format's description (docs.px4.io, "ULog File Format") and shares nothing with the
flight code's logger but that list: a topic or field renamed there shows up in the tests here.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

TOPICS_DEF = Path(__file__).parents[2] / "lib" / "Logger" / "Topics.def"

NUMPY_TYPES = {
    "float": "<f4",
    "int32_t": "<i4",
    "uint8_t": "u1",
    "uint16_t": "<u2",
    "uint32_t": "<u4",
    "uint64_t": "<u8",
}

Field = tuple[str, str, int]  # type, name, length; length 0 is a scalar


def read_topics() -> dict[str, list[Field]]:
    """The fields of each topic in Topics.def."""
    topics = {}
    text = TOPICS_DEF.read_text()
    for name, body in re.findall(r"^TOPIC\(\w+, (\w+)\)(.*?)^END_TOPIC", text, re.M | re.S):
        fields = re.findall(r"(?:FIELD|ARRAY)\((\w+),(?: (\d+),)? (\w+)\)", body)
        topics[name] = [(kind, field, int(length or 0)) for kind, length, field in fields]
    return topics


TOPICS = read_topics()


class ULogWriter:
    """Collects the messages of one log; write() puts them into a file."""

    def __init__(self, start_us: int = 0) -> None:
        self._head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", start_us)
        self._head += _message("B", bytes(40))
        self._subscriptions = b""
        self._data = b""
        self._formats: set[str] = set()
        self._ids = 0

    def info(self, key: str, text: str) -> None:
        typed_key = f"char[{len(text)}] {key}".encode()
        self._head += _message("I", bytes([len(typed_key)]) + typed_key + text.encode())

    def text(self, time_s: float, level: int, text: str) -> None:
        """A line of the log; level as in syslog."""
        content = str(level).encode() + struct.pack("<Q", round(time_s * 1e6)) + text.encode()
        self._data += _message("L", content)

    def topic(self, name: str, time_s: Any, fields: Mapping[str, Any], instance: int = 0) -> None:
        """All rows of one instance of a topic. A field that is not given is zero."""
        if name not in self._formats:
            self._formats.add(name)
            self._head += _message("F", f"{name}:{_format(TOPICS[name])}".encode())
        content = struct.pack("<BH", instance, self._ids) + name.encode()
        self._subscriptions += _message("A", content)

        payload = [
            (field, NUMPY_TYPES[kind], (length,)) if length else (field, NUMPY_TYPES[kind])
            for kind, field, length in TOPICS[name]
        ]
        row = np.dtype([("size_", "<u2"), ("type_", "u1"), ("id_", "<u2"), *payload])
        rows = np.zeros(len(time_s), dtype=row)
        rows["size_"], rows["type_"], rows["id_"] = row.itemsize - 3, ord("D"), self._ids
        rows["timestamp"] = np.rint(np.asarray(time_s) * 1e6)
        for field, values in fields.items():
            rows[field] = values
        self._data += rows.tobytes()
        self._ids += 1

    def write(self, path: Path) -> Path:
        path.write_bytes(self._head + self._subscriptions + self._data)
        return path


def _message(kind: str, content: bytes) -> bytes:
    return struct.pack("<HB", len(content), ord(kind)) + content


def _format(fields: list[Field]) -> str:
    return "".join(
        f"{kind}[{length}] {name};" if length else f"{kind} {name};"
        for kind, name, length in fields
    )
