"""`strix log spectrum`: a thin function over spectrum.py and spectrum_view.py."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from strix.command import says_what_is_wrong


@says_what_is_wrong
def spectrum(
    log: Annotated[Path, typer.Argument(help="A flight log, .ulg, or a recording's folder")],
    topic: Annotated[str, typer.Option(help="gyro or accel")] = "gyro",
    from_s: Annotated[
        float | None, typer.Option("--from", help="s; where the motors pull, if left out")
    ] = None,
    to_s: Annotated[float | None, typer.Option("--to", help="s")] = None,
    full_scale: Annotated[
        float | None,
        typer.Option(
            "--range", min=1e-3, help="Full scale: deg/s of the gyro (2000), g of accel (30)"
        ),
    ] = None,
    out: Annotated[Path, typer.Option("-o", "--out", help="The figure, a .png")] = Path(
        "spectrum.png"
    ),
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON")] = False,
) -> None:
    """Find vibration in a log: peaks, the motors' lines, clipping, aliasing; propose a notch.

    Exits with 1 when samples are clipped or something from above Nyquist has folded back.
    """
    from strix.log import spectrum as library
    from strix.log.spectrum_view import draw, sentences

    found = library.spectrum(log, topic, from_s, to_s, full_scale)
    draw(found, out)
    if as_json:
        print(json.dumps(found.to_dict()))
    else:
        for line in sentences(found):
            print("".join(c if c.isprintable() else "?" for c in line))
        print(out)
    if any(found.clipped) or found.aliased:
        raise typer.Exit(1)
