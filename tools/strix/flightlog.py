"""Reading a flight log (ULog, .ulg): topics as NumPy columns, and what the log says in words."""

from __future__ import annotations

import contextlib
import io
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog
from pyulog.exceptions import ULogException

from strix.errors import BadInput

Array = NDArray[np.float64]

MAGIC = b"ULog\x01\x12\x35"
LEVELS = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")


@dataclass(frozen=True)
class Topic:
    """One instance of a topic, a row a record. Values are float64, those of integer fields too; a
    field that is an array in the log has shape (N, length).
    """

    where: str  # file and topic, for error messages
    time_s: Array
    fields: Mapping[str, Array]

    def __getitem__(self, field: str) -> Array:
        if field not in self.fields:
            raise BadInput(f"{self.where}: expected a field {field}, found {_list(self.fields)}")
        return self.fields[field]


@dataclass(frozen=True)
class Message:
    """A line the flight software wrote for a person."""

    time_s: float
    level: str  # one of LEVELS
    text: str


class FlightLog:
    """One log. Its times are log time in s: since power-up, on the flight software's clock."""

    def __init__(self, path: Path, ulog: ULog) -> None:
        self.path = path
        self.info: dict[str, str] = {key: str(text) for key, text in ulog.msg_info_dict.items()}
        self.messages = tuple(
            Message(m.timestamp * 1e-6, LEVELS[m.log_level & 7], m.message)  # levels '0' to '7'
            for m in sorted(ulog.logged_messages, key=lambda m: m.timestamp)
        )
        self.damaged: bool = ulog.file_corruption
        self._data: dict[tuple[str, int], dict[str, NDArray[Any]]] = {
            (topic.name, topic.multi_id): topic.data for topic in _with_time(ulog)
        }
        self._topics: dict[tuple[str, int], Topic] = {}
        times_us = [columns["timestamp"] for columns in self._data.values()]
        self.begin_s = float(min(t[0] for t in times_us)) * 1e-6  # first record of any topic
        self.end_s = float(max(t[-1] for t in times_us)) * 1e-6  # and the last

    @property
    def duration_s(self) -> float:
        """From the first record to the last."""
        return self.end_s - self.begin_s

    def has(self, name: str, instance: int = 0) -> bool:
        """True when there is at least one record."""
        return (name, instance) in self._data

    def instances(self, name: str) -> list[int]:
        """Numbers (ULog's multi_id) of a topic's instances that have records."""
        return sorted(instance for topic, instance in self._data if topic == name)

    def topic(self, name: str, instance: int = 0) -> Topic:
        """One instance of a topic; BadInput when the log has no record of it."""
        key = (name, instance)
        if key not in self._topics:
            where = f"{self.path}: topic {name}" + (f", instance {instance}" if instance else "")
            if key not in self._data:
                others = _list({topic for topic, _ in self._data})
                raise BadInput(f"{where}: expected records, found only those of {others}")
            self._topics[key] = _topic(where, self._data[key])
        return self._topics[key]


def read_flight_log(path: Path) -> FlightLog:
    """Read a whole log. Damage inside it is passed over, and told by FlightLog.damaged."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadInput(f"{path}: expected a readable log, found: {error.strerror}") from None
    if not content.startswith(MAGIC):
        found = content[: len(MAGIC)]
        raise BadInput(f"{path}: expected a ULog file, which begins with 'ULog', found {found!r}")
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it prints what it thinks of damage
            ulog = ULog(_Stream(content))
    except (ULogException, EOFError, struct.error, LookupError, TypeError, ValueError) as error:
        raise BadInput(f"{path}: expected a ULog file, found damage: {error}") from None
    if not _with_time(ulog):
        raise BadInput(f"{path}: expected a log with records, found none")
    return FlightLog(path, ulog)


class _Stream(io.BytesIO):
    """A file that ends pyulog's search: a damaged size can send it back to where it was before.

    While it makes way it seeks less than once a byte. It would go on after a ValueError.
    """

    def __init__(self, content: bytes) -> None:
        super().__init__(content)
        self._seeks_left = len(content)

    def seek(self, offset: int, whence: int = 0, /) -> int:
        self._seeks_left -= 1
        if self._seeks_left < 0:
            raise EOFError("its parts do not fit together")
        return super().seek(offset, whence)


def _with_time(ulog: ULog) -> list[ULog.Data]:
    """A damaged format may have lost the name of its time."""
    return [topic for topic in ulog.data_list if "timestamp" in topic.data]


def refuse_backwards(where: str, what: str, time_s: Array) -> None:
    """Time that goes back: whoever wrote it was confused, or the file is damaged."""
    backwards = np.flatnonzero(np.diff(time_s) < 0.0)
    if backwards.size:
        row = int(backwards[0])
        raise BadInput(
            f"{where}, record {row + 2}: expected a {what} of at least {time_s[row]:.6f} s "
            f"(that of the record before), found {time_s[row + 1]:.6f} s"
        )


def _topic(where: str, columns: Mapping[str, NDArray[Any]]) -> Topic:
    time_s = columns["timestamp"] * 1e-6
    refuse_backwards(where, "time", time_s)
    elements: dict[str, list[NDArray[Any]]] = {}
    for column, values in columns.items():
        elements.setdefault(re.sub(r"\[\d+\]$", "", column), []).append(values)
    fields = {
        name: np.stack(values, axis=1).astype(np.float64)
        if f"{name}[0]" in columns
        else values[0].astype(np.float64)
        for name, values in elements.items()
        if name != "timestamp"
    }
    return Topic(where, time_s, fields)


def _list(names: Mapping[str, Any] | set[str]) -> str:
    return ", ".join(sorted(names)) or "nothing"
