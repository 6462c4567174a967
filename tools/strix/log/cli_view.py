"""`strix convert` and `strix log info|tail|plot`: thin functions over convert.py and view.py."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from strix.command import reading, says_what_is_wrong

LogFile = Annotated[Path, typer.Argument(help="A log: .ulg, or Ugglan's data log")]


@says_what_is_wrong
def convert(
    log: LogFile,
    out: Annotated[Path, typer.Option("-o", "--out", help="File, or folder of CSV or Parquet")],
    to: Annotated[
        str | None,
        typer.Option(help="csv, parquet, mcap, ugglan or ulg; by the ending of OUT if left out"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over what is there")] = False,
) -> None:
    """Convert a log: ULog or Ugglan's into CSV, Parquet, MCAP (Foxglove), Ugglan's or ULog."""
    from strix.log import convert as library

    with reading(log) as tell:
        lost = library.convert(log, out, to, force, tell)
    for line in lost:
        print(f"strix: {line}", file=sys.stderr)
    print(out)


@says_what_is_wrong
def info(
    log: LogFile,
    as_json: Annotated[bool, typer.Option("--json", help="Print it as JSON")] = False,
) -> None:
    """Show what a log holds: aircraft, duration, topics, messages, drops."""
    from strix.log.view import summarise

    with reading(log) as tell:
        found = summarise(log, tell)
    if as_json:
        print(json.dumps(found.to_dict()))
        return
    boot = "" if found.boot_id is None else f", boot {found.boot_id:08x}"
    identity = ", ".join(f"{key} {text}" for key, text in found.identity.items())
    print(f"{log}: {found.size / 1e6:.1f} MB, {found.duration_s:.1f} s from {found.begin_s:.3f} s")
    print(f"{_plain(identity) or 'no identity'}{boot}")
    table = Table("topic", box=None, pad_edge=False)
    for heading in ("records", "rate, Hz", "MB", "from, s", "to, s"):
        table.add_column(heading, justify="right")
    for topic in found.topics:
        mb, rate = f"{topic.bytes / 1e6:.3f}", f"{topic.rate_hz:.1f}"
        span = (f"{topic.first_s:.3f}", f"{topic.last_s:.3f}")
        table.add_row(topic.name, str(topic.count), rate, mb, *span)
    _console().print(table)
    for message in found.messages[:50]:
        print(f"{message.time_s:9.3f} s  {message.level:9}  {_plain(message.text)}")
    if found.message_count > 50:
        print(f"and {found.message_count - 50} more messages (strix log tail)")
    print(f"dropped: {found.dropped} records, {found.dropouts_ms} ms")
    if found.unread:
        print(f"damaged or cut: {found.unread} bytes not read (strix log check)")


@says_what_is_wrong
def tail(
    log: LogFile,
    topic: Annotated[
        str | None, typer.Argument(help="Topic, or topic.3 for instance 3; messages if left out")
    ] = None,
    count: Annotated[int, typer.Option("-n", min=1, max=100_000, help="How many")] = 10,
) -> None:
    """Print the last records of a topic, or the last messages."""
    from strix.log import view

    with reading(log) as tell:
        names, rows = view.tail(log, topic, count, tell)
    cells = [names, *([_cell(value) for value in row] for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(names))]
    for row in cells:
        shown = (text.rjust(width) for text, width in zip(row, widths, strict=True))
        if topic is None:  # text reads from the left
            shown = (text.ljust(width) for text, width in zip(row, widths, strict=True))
        print("  ".join(shown).rstrip())


@says_what_is_wrong
def plot(
    log: LogFile,
    fields: Annotated[
        list[str], typer.Argument(help="topic.field, topic.field[0] or topic.3.field (instance 3)")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The figure, a .png")] = Path("log.png"),
) -> None:
    """Draw fields over time into a PNG."""
    from strix.log import view

    with reading(log) as tell:
        view.plot(log, fields, out, tell)
    print(out)


def _console() -> Console:
    """As wide as it needs to be where nobody's window limits it."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else 120)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.7g}"
    return _plain(value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value))


def _plain(text: str) -> str:
    """Nothing in a log steers the terminal."""
    return "".join(c if c.isprintable() else "?" for c in text)
