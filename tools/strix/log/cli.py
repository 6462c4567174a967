"""The commands `strix log check` and `strix log recover`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from strix.command import reading, says_what_is_wrong
from strix.log import cli_spectrum, cli_view

log_app = typer.Typer(
    name="log",
    help="Check a flight log's file, recover it, look into it.",
    no_args_is_help=True,
)


@log_app.command(epilog="Example: strix log check out/flight.ulg")
@says_what_is_wrong
def check(
    file: Annotated[Path, typer.Argument(help="A log, .ulg")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON")] = False,
) -> None:
    """Is this log whole? Blocks, gaps, drops, and what else is in the file.

    Exits with 0 when all of it is there, with 1 when it is damaged or records were dropped.
    """
    from strix.log import check as library

    with reading(file) as progress:
        found = library.check(file, progress)
    if as_json:
        print(json.dumps(found.to_dict()))
    else:
        library.print_check(found)
    if not found.intact:
        raise typer.Exit(1)


@log_app.command(epilog="Example: strix log recover card.ulg -o flight.ulg")
@says_what_is_wrong
def recover(
    file: Annotated[Path, typer.Argument(help="A damaged log; it is not changed")],
    out: Annotated[Path, typer.Option("--out", "-o", help="The file to write")],
    header_from: Annotated[
        Path | None,
        typer.Option(help="An intact log of the same firmware, for when the header is lost"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file")] = False,
) -> None:
    """Take every intact block of a damaged log, and nothing else, into a new file."""
    from strix.log import recover as library

    with reading(file) as progress:
        done = library.recover(file, out, header_from, force, progress)
    library.print_recovery(done)


log_app.command(epilog="Example: strix log info out/flight.ulg")(cli_view.info)
log_app.command(epilog="Example: strix log tail out/flight.ulg vehicle_attitude -n 5")(
    cli_view.tail
)
log_app.command(epilog="Example: strix log plot out/flight.ulg vehicle_local_position.z -o z.png")(
    cli_view.plot
)
log_app.command(epilog="Example: strix log spectrum out/flight.ulg --topic gyro -o spectrum.png")(
    cli_spectrum.spectrum
)
