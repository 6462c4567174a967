"""What every command does: refuse bad input in one line, show long work."""

from __future__ import annotations

import functools
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import ParamSpec

import typer

from strix.errors import BadInput
from strix.log.blocks import Progress

PATIENCE_S = 2.0  # what takes no longer needs no bar

P = ParamSpec("P")


def says_what_is_wrong(command: Callable[P, None]) -> Callable[P, None]:
    """Bad input ends in one line on stderr and status 2, never in a traceback."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            command(*args, **kwargs)
        except BadInput as error:
            print(f"strix: {error}", file=sys.stderr)
            raise typer.Exit(2) from None

    return run


@contextmanager
def reading(path: Path) -> Iterator[Progress]:
    """A bar on stderr when the reading of a file takes long, on a terminal only.

    Gives a function that takes the bytes read so far.
    """
    from rich.console import Console
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    bar = Bar(console=console, transient=True, disable=not console.is_terminal)
    size = path.stat().st_size if path.is_file() else None
    task = bar.add_task(f"reading {path.name}", total=size)
    begun_s = time.monotonic()

    def tell(done: int) -> None:
        if not bar.live.is_started and time.monotonic() - begun_s > PATIENCE_S:
            bar.start()
        bar.update(task, completed=done)

    try:
        yield tell
    finally:
        bar.stop()
