"""What a file holds of a log: its intact blocks in order, what is missing, what else is there."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from strix.errors import BadInput
from strix.flightlog import MAGIC
from strix.log.blocks import SECTOR, Block, Progress, Stray, scan, silent

FILE_START = 16  # bytes: magic, version, and the log's start in us
_DEFINING = b"BIMPQFA"  # kinds of messages that come before the first record
_NUMPY_TYPES = {
    "float": "<f4",
    "double": "<f8",
    "bool": "u1",
    "char": "S1",
    **{f"int{bits}_t": f"<i{bits // 8}" for bits in (8, 16, 32, 64)},
    **{f"uint{bits}_t": f"<u{bits // 8}" for bits in (8, 16, 32, 64)},
}


class Message(NamedTuple):
    """One message of the file."""

    kind: bytes  # one letter
    payload: bytes

    def packed(self) -> bytes:
        """As it stands in the file."""
        return struct.pack("<Hc", len(self.payload), self.kind) + self.payload


class TopicId(NamedTuple):
    """What a msg_id stands for."""

    name: str
    instance: int


@dataclass(frozen=True)
class Definitions:
    """What the header says: the first block of a log begins with it."""

    start_us: int
    messages: tuple[Message, ...]  # B, I, F, A ...: all before the first record
    layouts: dict[str, np.dtype[Any]]  # topic name: its record
    topics: dict[int, TopicId]

    def record(self, message: Message) -> tuple[TopicId, np.void] | None:
        """The topic and values of a data message; None when it does not fit the definitions."""
        topic = self.topics.get(int.from_bytes(message.payload[:2], "little"))
        if topic is None or len(message.payload) - 2 != self.layouts[topic.name].itemsize:
            return None
        return topic, np.frombuffer(message.payload, self.layouts[topic.name], 1, 2)[0]


class Gap(NamedTuple):
    """Blocks that are missing between two that are there. How many records they held, nobody knows;
    they were logged between the two times.
    """

    first: int  # sequence numbers of the missing
    last: int
    from_us: int | None  # None: nothing is known before
    to_us: int

    @property
    def blocks(self) -> int:
        return self.last - self.first + 1


@dataclass
class Stale:
    """What is left in the file of an older log."""

    blocks: int = 0
    bytes: int = 0


@dataclass
class Survey:
    """A log's file, read once."""

    path: Path
    size: int = 0
    blocks: list[Block] = field(default_factory=list)
    """The intact blocks of the log, by sequence, each once."""
    repeated: int = 0
    """Further intact blocks with a sequence number that was there before."""
    stale: dict[int, Stale] = field(default_factory=dict)
    """By boot id: intact blocks of other logs."""
    damaged_bytes: int = 0
    """In no intact block, and before the log's last."""
    last_end: int = 0
    """Where the last block of the log ends, in the file."""
    tail: Stray | None = None
    """What follows there, if it is no intact block."""

    @property
    def boot_id(self) -> int:
        return self.blocks[0].boot_id

    @property
    def kept_bytes(self) -> int:
        return sum(block.length for block in self.blocks)

    @cached_property
    def gaps(self) -> list[Gap]:
        found = []
        expected, time_us = 0, None
        for block in self.blocks:
            if block.sequence != expected:
                found.append(Gap(expected, block.sequence - 1, time_us, block.time_us))
            expected, time_us = block.sequence + 1, block.time_us
        return found

    @property
    def missing_blocks(self) -> int:
        return sum(gap.blocks for gap in self.gaps)

    @property
    def padding_bytes(self) -> int:
        """Zeros behind the last block that fill its sector or have never been written."""
        return self.tail.zeros if self.tail is not None else 0

    @property
    def torn_bytes(self) -> int:
        """Behind the last block, may be the beginning of another: the end of the log is lost.

        The last sector is filled with zeros when the log is made durable, and written again before
        the next. Where they still stand, nothing of this log came after them. (Three at least: a
        damaged message may begin with less.) Without them it may be an older log's, too.
        """
        if self.tail is None or self.tail.blank:
            return 0
        padding = -self.last_end % SECTOR
        ended = self.tail.zeros >= padding >= 3
        return 0 if ended else self.tail.length

    @cached_property
    def definitions(self) -> Definitions | None:
        """None: the first block is lost, and with it what the records mean."""
        if self.blocks[0].sequence != 0:
            return None
        try:
            with self.path.open("rb") as file:
                return _definitions(self, file)
        except (ValueError, struct.error) as error:
            raise BadInput(f"{self.path}: expected a ULog header, found: {error}") from None

    def messages(self, file: BinaryIO, block: Block) -> Iterator[Message]:
        """The messages of a block, its log_block last."""
        content = read_block(file, block)
        at = FILE_START if block.sequence == 0 and content.startswith(MAGIC) else 0
        while at < len(content):
            size = int.from_bytes(content[at : at + 2], "little")
            end = at + 3 + size
            if end > len(content):
                raise BadInput(
                    f"{self.path}, byte {block.start + at}: expected a message inside its block, "
                    f"found one of {size} bytes that exceeds it"
                )
            yield Message(content[at + 2 : at + 3], content[at + 3 : end])
            at = end


def survey(path: Path, progress: Progress = silent) -> Survey:
    """Read a file and find the log in it; BadInput when there is not one intact block.

    The log is the one that the file's first intact block belongs to: a new log is written from the
    file's start over an older one.
    """
    found = Survey(path)
    strays: list[Stray] = []
    try:
        with path.open("rb") as file:
            for item in scan(file, progress):
                found.size = item.end
                if isinstance(item, Stray):
                    strays.append(item)
                elif not found.blocks or item.boot_id == found.boot_id:
                    found.blocks.append(item)
                    found.last_end = item.end
                else:
                    stale = found.stale.setdefault(item.boot_id, Stale())
                    stale.blocks += 1
                    stale.bytes += item.length
    except OSError as error:
        raise BadInput(f"{path}: expected a readable log, found: {error.strerror}") from None
    if not found.blocks:
        raise BadInput(
            f"{path}: expected blocks that end with a log_block, found none in {found.size} bytes"
        )
    in_file = len(found.blocks)
    by_sequence: dict[int, Block] = {}
    for block in found.blocks:
        by_sequence.setdefault(block.sequence, block)
    found.blocks = sorted(by_sequence.values(), key=lambda block: block.sequence)
    found.repeated = in_file - len(found.blocks)
    found.damaged_bytes = sum(s.length for s in strays if s.start < found.last_end)
    found.tail = next((s for s in strays if s.start == found.last_end), None)
    return found


def read_block(file: BinaryIO, block: Block) -> bytes:
    """Its bytes."""
    file.seek(block.start)
    return file.read(block.length)


def _definitions(log: Survey, file: BinaryIO) -> Definitions | None:
    start = read_block(file, log.blocks[0])[:FILE_START]
    if not start.startswith(MAGIC):
        return None
    messages: list[Message] = []
    layouts: dict[str, np.dtype[Any]] = {}
    topics: dict[int, TopicId] = {}
    for message in log.messages(file, log.blocks[0]):
        if message.kind not in _DEFINING:
            break
        messages.append(message)
        if message.kind == b"F":
            name, _, fields = message.payload.decode().partition(":")
            layouts[name] = _layout(fields)
        elif message.kind == b"A":
            instance, topic_id = struct.unpack_from("<BH", message.payload)
            topics[topic_id] = TopicId(message.payload[3:].decode(), instance)
    unknown = {topic.name for topic in topics.values()} - set(layouts)
    if unknown:
        raise ValueError(f"no format of {', '.join(sorted(unknown))}")
    return Definitions(struct.unpack_from("<Q", start, 8)[0], tuple(messages), layouts, topics)


def _layout(fields: str) -> np.dtype[Any]:
    """Of "float[4] q;uint8_t count;"."""
    layout: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    for text in filter(None, fields.split(";")):
        parts = re.fullmatch(r"(\w+)(?:\[(\d+)\])? (\w+)", text)
        if parts is None or parts[1] not in _NUMPY_TYPES:
            raise ValueError(f"a field {text!r}")
        kind, length, name = _NUMPY_TYPES[parts[1]], parts[2], parts[3]
        layout.append((name, kind, (int(length),)) if length else (name, kind))
    return np.dtype(layout)
