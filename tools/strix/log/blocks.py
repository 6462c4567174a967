"""Finds the intact blocks of a log's file, whatever happened to the file.

Every block ends with a log_block record that holds its length and a CRC-32 over all of it but the
CRC itself (lib/Logger/SectorStream.h). So a block is known by its end alone: where something looks
like a log_block, the bytes that it claims are a block if and only if their sum is right. Nothing
else is trusted, least of all what surrounds it, and nothing outside an intact block is given out.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable, Iterator
from typing import BinaryIO, NamedTuple

MAX_BLOCK = 8192  # of the first, which has the header; of the others 4096
SECTOR = 512  # what the card writes at a time

_END = struct.Struct("<HcHQIIII")  # size, 'D', msg_id, then log_block's fields
_SUM_SIZE = 4
_CHUNK = 1 << 20  # bytes in memory at a time

# What may be a log_block, whatever its msg_id: a data message of its size whose length is that of a
# block: more than the 29 bytes of its end, at most 8192. Other topics have its size.
_LOOKS_LIKE_END = re.compile(
    rb"\x1A\x00D.{18}(?:[\x1E-\xFF]\x00|.[\x01-\x1F]|\x00\x20)\x00\x00.{4}", re.DOTALL
)

Progress = Callable[[int], None]  # bytes read so far


def silent(_done: int) -> None:
    """For who does not want to know."""


class Block(NamedTuple):
    """An intact block: whole ULog messages, the last of which is its log_block."""

    start: int  # in the file, bytes
    length: int
    boot_id: int
    sequence: int
    time_us: int  # when it was closed
    topic_id: int  # msg_id of log_block

    @property
    def end(self) -> int:
        return self.start + self.length


class Stray(NamedTuple):
    """Bytes that belong to no intact block, between two of them or at an end of the file."""

    start: int
    length: int
    zeros: int  # so many stand at its beginning
    blank: bool  # all bytes are 0x00 or 0xFF: never written, or erased

    @property
    def end(self) -> int:
        return self.start + self.length


def block_ending_at(content: bytes | bytearray, end: int) -> Block | None:
    """The block whose log_block ends there, if its sum is right. Its start counts in `content`."""
    if end < _END.size or end > len(content):
        return None
    size, kind, topic_id, time_us, boot_id, sequence, length, crc = _END.unpack_from(
        content, end - _END.size
    )
    if size != _END.size - 3 or kind != b"D" or not _END.size < length <= min(MAX_BLOCK, end):
        return None
    if zlib.crc32(content[end - length : end - _SUM_SIZE]) != crc:
        return None
    return Block(end - length, length, boot_id, sequence, time_us, topic_id)


class _StrayBytes:
    """Collects stray bytes without keeping them: there may be a card full of zeros."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        self.length = 0
        self._zeros = 0
        self._blank = True

    def add(self, content: bytes | bytearray) -> None:
        if self._zeros == self.length:
            self._zeros += len(content) - len(content.lstrip(b"\x00"))
        self._blank = self._blank and not content.strip(b"\x00\xff")
        self.length += len(content)

    def ending_at(self, end: int) -> Stray:
        return Stray(end - self.length, self.length, self._zeros, self._blank)


def scan(file: BinaryIO, progress: Progress = silent) -> Iterator[Block | Stray]:
    """All of the file from its first byte to its last: intact blocks, and what lies between them.

    Blocks of every boot, in the file's order, never overlapping. One pass, in bounded memory.
    """
    window = bytearray()
    base = 0  # window[0] in the file
    done = 0  # in the window: all before it was given out or is in `stray`
    search = 0  # in the window: where the next log_block may begin
    stray = _StrayBytes()
    while chunk := file.read(_CHUNK):
        window += chunk
        while (found := _LOOKS_LIKE_END.search(window, search)) is not None:
            block = block_ending_at(window, found.end())
            if block is None or block.start < done:
                search = found.start() + 1
                continue
            stray.add(window[done : block.start])
            if stray.length:
                yield stray.ending_at(base + block.start)
                stray.clear()
            yield block._replace(start=base + block.start)
            done = search = block.end
        search = max(search, len(window) - _END.size + 1)
        # No block that is still to be found reaches back further than this.
        keep = max(done, search + _END.size - MAX_BLOCK)
        stray.add(window[done:keep])
        del window[:keep]
        base += keep
        search -= keep
        done = 0
        progress(base + len(window))
    stray.add(window)
    if stray.length:
        yield stray.ending_at(base + len(window))
