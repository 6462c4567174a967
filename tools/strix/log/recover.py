"""Takes the intact blocks out of a damaged file and makes a log of them that any reader opens."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from rich.console import Console

from strix.errors import BadInput
from strix.flightlog import MAGIC
from strix.log.blocks import Block, Progress, silent
from strix.log.check import SHOWN_GAPS, gap_text
from strix.log.survey import Definitions, Message, Survey, read_block, survey


@dataclass(frozen=True)
class Recovery:
    """What was done."""

    log: Survey
    out: Path
    written_bytes: int
    header_from: Path | None
    """None: the log's own first block is intact."""


def recover(
    path: Path,
    out: Path,
    header_from: Path | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Recovery:
    """Write every intact block of the log in `path`, byte for byte and in order, to `out`.

    When the first block is lost, the records have no meaning: then the formats come from another
    log of the same firmware, if the user gives one. They are checked against every record.
    """
    _check_out(out, [path] if header_from is None else [path, header_from], force)
    log = survey(path, progress)
    start = b""
    if log.definitions is not None:
        header_from = None
    elif header_from is None:
        raise BadInput(
            f"{path}: expected an intact first block, which holds the records' formats, found "
            f"{len(log.blocks)} blocks from number {log.blocks[0].sequence} on; give an intact log "
            "of the same firmware with --header-from"
        )
    else:
        start = _foreign_header(log, header_from)

    unfinished = out.with_name(out.name + ".part")
    try:
        with path.open("rb") as file, unfinished.open("xb") as copy:  # "x": it may be an input
            try:
                copy.write(start)
                for block in log.blocks:
                    copy.write(read_block(file, block))
                unfinished.replace(out)
            except OSError:
                unfinished.unlink()
                raise
    except OSError as error:
        where = error.filename or out
        raise BadInput(f"{where}: expected to write {out}, found: {error.strerror}") from None
    return Recovery(log, out, len(start) + log.kept_bytes, header_from)


def _check_out(out: Path, inputs: list[Path], force: bool) -> None:
    for path in inputs:
        if out.exists() and path.exists() and out.samefile(path):
            raise BadInput(f"{out}: expected another file than the input, found the input")
    if out.is_dir():
        raise BadInput(f"{out}: expected a file to write, found a folder")
    if out.exists() and not force:
        raise BadInput(f"{out}: expected no file of that name, found one (--force overwrites it)")


def _foreign_header(log: Survey, header_from: Path) -> bytes:
    """Formats and ids of another log. What it says about its own flight is left out."""
    definitions = survey(header_from).definitions
    if definitions is None:
        raise BadInput(f"{header_from}: expected an intact first block, found it damaged too")
    with log.path.open("rb") as file:
        start_us = _check_fit(log, file, definitions, header_from)
    name = header_from.name.encode()
    key = b"char[%d] header_from" % len(name)
    told = Message(b"I", bytes([len(key)]) + key + name)
    kept = [message for message in definitions.messages if message.kind in b"BFA"]
    kept.insert(1, told)  # behind 'B', which must come first
    return (
        MAGIC
        + b"\x01"
        + struct.pack("<Q", start_us)
        + b"".join(message.packed() for message in kept)
    )


def _check_fit(log: Survey, file: BinaryIO, definitions: Definitions, header_from: Path) -> int:
    """BadInput unless all records fit. Returns the time of the earliest, us."""
    start_us = log.blocks[0].time_us
    for block in log.blocks:
        topic = definitions.topics.get(block.topic_id)
        for message in _records(log, file, block):
            record = definitions.record(message)
            if record is None or topic is None or topic.name != "log_block":
                raise BadInput(
                    f"{header_from}: expected the formats of {log.path}, found others (a record of "
                    f"{len(message.payload)} bytes in block {block.sequence} does not fit): "
                    "they are of different firmware"
                )
            start_us = min(start_us, int(record[1]["timestamp"]))
    return start_us


def _records(log: Survey, file: BinaryIO, block: Block) -> Iterator[Message]:
    return (message for message in log.messages(file, block) if message.kind == b"D")


def print_recovery(done: Recovery, console: Console | None = None) -> None:
    """What was kept and what was lost."""
    console = console or Console()
    log = done.log

    def say(text: str, style: str = "") -> None:
        console.print(text, style=style, highlight=False, markup=False, soft_wrap=True)

    say(
        f"kept: {len(log.blocks)} blocks, {log.kept_bytes} of {log.size} bytes, "
        f"to {log.blocks[-1].time_us * 1e-6:.3f} s of boot {log.boot_id:08x}"
    )
    if done.header_from is not None:
        say(
            f"formats: from {done.header_from}; vehicle and version are not known. The file's "
            "beginning is lost: make sure by the times that this is not an older log",
            "yellow",
        )
    for gap in log.gaps[:SHOWN_GAPS]:
        say(f"lost: {gap_text(gap)}", "red")
    if len(log.gaps) > SHOWN_GAPS:
        say(f"lost: {len(log.gaps) - SHOWN_GAPS} gaps more (strix log check --json)", "red")
    if log.torn_bytes:
        say(f"lost: {log.torn_bytes} bytes after the last block, its end or an older log's", "red")
    for boot_id, stale in log.stale.items():
        say(f"left out: {stale.blocks} blocks of an older log, boot {boot_id:08x}")
    if log.repeated:
        say(f"left out: {log.repeated} blocks that were there before")
    say(f"{done.out}: {done.written_bytes} bytes")
