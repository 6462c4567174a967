"""Logs as they were written, known without the code that recovers them, and ways to damage them."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

from hypothesis import strategies as st

from strix.fly import make_plan
from strix.simulation import fly

SECTOR = 512
BLOCK_END = struct.Struct("<HBHQIIII")  # the log_block message


@dataclass(frozen=True)
class Written:
    """A log as it was written: known without the code under test."""

    path: Path
    content: bytes
    blocks: tuple[bytes, ...]

    def starts(self) -> list[int]:
        """Where each block begins, and the end."""
        return [sum(map(len, self.blocks[:i])) for i in range(len(self.blocks) + 1)]


def messages(content: bytes) -> list[bytes]:
    """All messages, by their sizes alone."""
    found = []
    at = 16 if content.startswith(b"ULog") else 0
    while at < len(content):
        end = at + 3 + content[at] + 256 * content[at + 1]
        found.append(content[at:end])
        at = end
    return found


def topic_ids(content: bytes) -> dict[str, int]:
    """By name; of several instances the last."""
    return {m[6:].decode(): m[4] + 256 * m[5] for m in messages(content) if m[2:3] == b"A"}


def records(content: bytes) -> list[bytes]:
    """What was logged: data and texts."""
    return [m for m in messages(content) if m[2:3] in b"DL"]


def as_written(path: Path) -> Written:
    content = path.read_bytes()
    block_id = topic_ids(content)["log_block"]
    parts, at = [], 0
    position = 16
    for message in messages(content):
        position += len(message)
        if message[2:3] == b"D" and message[3] + 256 * message[4] == block_id:
            parts.append(content[at:position])
            at = position
    assert b"".join(parts) == content
    return Written(path, content, tuple(parts))


def fly_for(seconds: float, seed: int, path: Path) -> Written:
    plan = make_plan("Quad5in", "first-flight", "calm", 0.0, seed)
    fly(plan, path, lambda _time_s, _state: None, give_up_s=seconds)
    return as_written(path)


def flipped(content: bytes, bit: int) -> bytes:
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def resealed(block: bytes | bytearray) -> bytes:
    """With the sum that its bytes have."""
    return bytes(block[:-4]) + struct.pack("<I", zlib.crc32(block[:-4]))


def padded(content: bytes) -> bytes:
    return content + bytes(-len(content) % SECTOR)


def preallocated(new: bytes, old: bytes) -> bytes:
    """A file of the older log's size, written over from its start by the sector."""
    return padded(new) + old[len(padded(new)) :]


POSITION = st.floats(0.0, 1.0)


@st.composite
def damages(draw: st.DrawFn, new: bytes, old: bytes) -> bytes:
    """Some of the log, cut, flipped, zeroed, overwritten, with parts inserted or doubled."""
    content = bytearray(draw(st.sampled_from([new, preallocated(new, old), new + old])))
    for _ in range(draw(st.integers(1, 6))):
        a, b = sorted(round(draw(POSITION) * len(content)) for _ in range(2))
        if draw(st.booleans()):
            b = min(b, a + draw(st.integers(0, 600)))
        match draw(st.sampled_from(["cut", "end", "flip", "zero", "insert", "double", "random"])):
            case "cut":
                del content[a:b]
            case "end":
                del content[max(a, b) :]
            case "flip" if a < len(content):
                content[a] ^= 1 << draw(st.integers(0, 7))
            case "zero":
                content[a:b] = bytes(b - a)
            case "insert":
                content[a:a] = draw(st.binary(max_size=64))
            case "double":
                to = round(draw(POSITION) * len(content))
                content[to:to] = content[a:b]
            case "random":
                noise = draw(st.binary(min_size=1, max_size=64))
                content[a:b] = (noise * (b - a))[: b - a]
    return bytes(content)
