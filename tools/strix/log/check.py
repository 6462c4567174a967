"""Is a log whole? What it lost on the way to the card, and on the card."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from strix.errors import BadInput
from strix.log.blocks import Progress, silent
from strix.log.survey import Definitions, Gap, Survey, TopicId, survey

SHOWN_GAPS = 20  # in the table; --json has all of them


@dataclass(frozen=True)
class LoggerStatus:
    """What the flight software last wrote of its log: counts since power-up."""

    dropped: dict[str, int]
    """Records that found no room and were not logged, by topic, "estimator_aid_source[3]"; texts
    are "text". Only those above 0."""
    write_errors: int
    longest_stall_s: float


@dataclass(frozen=True)
class Check:
    """The findings about one file."""

    log: Survey
    has_header: bool
    begin_s: float | None
    """Log time. None: the header is lost."""
    status: LoggerStatus | None
    """None: no log_status is left, or its format is lost."""

    @property
    def damaged(self) -> bool:
        """The file is not as the flight software wrote it."""
        log = self.log
        return bool(log.gaps or log.damaged_bytes or log.torn_bytes or log.repeated)

    @property
    def dropped(self) -> int:
        """Records that never reached the file."""
        return sum(self.status.dropped.values()) if self.status is not None else 0

    @property
    def intact(self) -> bool:
        """Every record that was offered is there."""
        return not self.damaged and self.dropped == 0

    @property
    def end_s(self) -> float:
        """Log time at which the last block was closed."""
        return self.log.blocks[-1].time_us * 1e-6

    def to_dict(self) -> dict[str, Any]:
        """For --json: times in s of log time, null for what is not known."""
        log, status = self.log, self.status
        return {
            "file": str(log.path),
            "intact": self.intact,
            "damaged": self.damaged,
            "bytes": log.size,
            "boot_id": log.boot_id,
            "has_header": self.has_header,
            "begin_s": self.begin_s,
            "end_s": self.end_s,
            "blocks": len(log.blocks),
            "block_bytes": log.kept_bytes,
            "missing_blocks": log.missing_blocks,
            "gaps": [
                {
                    "first": gap.first,
                    "last": gap.last,
                    "from_s": None if gap.from_us is None else gap.from_us * 1e-6,
                    "to_s": gap.to_us * 1e-6,
                }
                for gap in log.gaps
            ],
            "repeated_blocks": log.repeated,
            "damaged_bytes": log.damaged_bytes,
            "torn_bytes": log.torn_bytes,
            "padding_bytes": log.padding_bytes,
            "stale": [
                {"boot_id": boot_id, "blocks": stale.blocks, "bytes": stale.bytes}
                for boot_id, stale in log.stale.items()
            ],
            "dropped": None if status is None else self.dropped,
            "dropped_by_topic": None if status is None else status.dropped,
            "write_errors": None if status is None else status.write_errors,
            "longest_stall_s": None if status is None else status.longest_stall_s,
        }


def check(path: Path, progress: Progress = silent) -> Check:
    """Read a log's file and judge it. BadInput when it holds no block of a log."""
    log = survey(path, progress)
    definitions = log.definitions
    if definitions is None:
        return Check(log, False, None, None)
    return Check(log, True, definitions.start_us * 1e-6, _last_status(log, definitions))


def _last_status(log: Survey, definitions: Definitions) -> LoggerStatus | None:
    """It only counts up, so the last one has it all."""
    with log.path.open("rb") as file:
        for block in reversed(log.blocks):
            for message in reversed(list(log.messages(file, block))):
                found = definitions.record(message) if message.kind == b"D" else None
                if found is not None and found[0].name == "log_status":
                    return _status(log, found[1], definitions)
    return None


def _status(log: Survey, record: np.void, definitions: Definitions) -> LoggerStatus:
    missing = {"dropped_by_id", "dropped_text", "write_errors", "longest_stall_us"}
    missing -= set(record.dtype.names or ())
    if missing:
        raise BadInput(
            f"{log.path}: expected {', '.join(sorted(missing))} in log_status, not found"
        )
    dropped = {}
    for topic_id, count in enumerate(record["dropped_by_id"].tolist()):
        if count:
            name, instance = definitions.topics.get(topic_id, TopicId(f"id {topic_id}", 0))
            several = sum(topic.name == name for topic in definitions.topics.values()) > 1
            dropped[f"{name}[{instance}]" if several else name] = int(count)
    if record["dropped_text"]:
        dropped["text"] = int(record["dropped_text"])
    return LoggerStatus(
        dropped, int(record["write_errors"]), float(record["longest_stall_us"]) * 1e-6
    )


def print_check(found: Check, console: Console | None = None) -> None:
    """For eyes: a line a finding, in words only where there is something to say."""
    console = console or Console()
    log, status = found.log, found.status
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True, justify="right")
    table.add_column(style="dim")

    def row(name: str, value: str, meaning: str, style: str = "") -> None:
        table.add_row(name, Text(value, style), meaning)

    def count(name: str, value: int, meaning: str, style: str = "red") -> None:
        row(name, f"{value}", meaning, style if value else "")

    row("blocks", f"{len(log.blocks)}", f"intact, {log.kept_bytes} of {log.size} bytes")
    count("missing", log.missing_blocks, "blocks, by their sequence numbers")
    count("damaged", log.damaged_bytes, "bytes between blocks that are no intact block")
    count("torn", log.torn_bytes, "bytes after the last block, or of an older log")
    if log.repeated:
        count("repeated", log.repeated, "blocks that were there before")
    row("padding", f"{log.padding_bytes}", "zeros after the last block")
    for boot_id, stale in log.stale.items():
        row("stale", f"{stale.blocks}", f"blocks of an older log, boot {boot_id:08x}")
    begin = "?" if found.begin_s is None else f"{found.begin_s:.3f}"
    row("time", f"{begin} to {found.end_s:.3f} s", f"of boot {log.boot_id:08x}")
    if status is not None:
        count("dropped", found.dropped, "records for which the rings had no room", "yellow")
        for name, lost in status.dropped.items():
            row(f"  {name}", f"{lost}", "")
        count("write errors", status.write_errors, "of the card", "yellow")
        row("longest stall", f"{status.longest_stall_s:.3f} s", "of the card")
    else:
        row("dropped", "?", "no log_status can be read")
    console.print(table)
    for gap in log.gaps[:SHOWN_GAPS]:
        console.print(gap_text(gap), style="red", highlight=False)
    if len(log.gaps) > SHOWN_GAPS:
        console.print(f"and {len(log.gaps) - SHOWN_GAPS} gaps more (--json has them)", style="red")
    console.print(verdict(found), highlight=False)


def gap_text(gap: Gap) -> str:
    """As "blocks 7 to 9 are missing, 1.250 to 1.375 s"."""
    what = f"block {gap.first} is" if gap.blocks == 1 else f"blocks {gap.first} to {gap.last} are"
    since = "the start" if gap.from_us is None else f"{gap.from_us * 1e-6:.3f}"
    what += f" missing, {since} to {gap.to_us * 1e-6:.3f} s"
    return what + (": the formats are lost" if gap.first == 0 else "")


def verdict(found: Check) -> str:
    """The file in one sentence."""
    if found.intact:
        return "intact"
    words = []
    if found.damaged:
        words.append("damaged: strix log recover takes the intact blocks out")
    if found.dropped:
        words.append(f"{found.dropped} records were dropped in flight")
    return "; ".join(words)
