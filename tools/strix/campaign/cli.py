"""`strix campaign`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from strix.command import says_what_is_wrong
from strix.errors import BadInput


@says_what_is_wrong
def campaign(
    faults: Annotated[str, typer.Option(help="all, or names: imu-freeze,gps-jump,…")] = "all",
    n: Annotated[int, typer.Option("--n", min=1, help="Flights")] = 500,
    seed: Annotated[int, typer.Option(min=0, help="Of all flights")] = 1,
    out: Annotated[
        Path, typer.Option(help="Folder for flights.jsonl, campaign.csv and campaign.html")
    ] = Path("out/campaign"),
    jobs: Annotated[str, typer.Option(help="Processes; auto: all cores")] = "auto",
    scheduler: Annotated[
        str | None, typer.Option(help="Of a Dask cluster, tcp://HOST:PORT, which flies instead")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the campaign that is in --out")
    ] = False,
    only: Annotated[
        int | None,
        typer.Option(min=0, help="Fly this flight again, and leave its log and report in --out"),
    ] = None,
) -> None:
    """Fly many flights with one fault each, and judge them by what really happened.

    Exits with 1 when a flight ended as none may. An interrupted campaign goes on by --resume.
    """
    from strix.campaign.run import fly_again, fly_campaign
    from strix.campaign.table import print_campaign, print_flight

    if only is not None:
        flight = fly_again(faults, only, seed, out)
        print_flight(flight)
        for text in flight.said:
            print(f"  {text}")
        print(f"{out}/flight.ulg, {out}/report.html")
        raise typer.Exit(0 if flight.passes else 1)
    try:
        found = fly_campaign(faults, n, seed, out, _processes(jobs), scheduler, resume)
    except KeyboardInterrupt:
        print(f"interrupted; go on by: strix campaign --resume --out {out}, and the same options")
        raise typer.Exit(130) from None
    print_campaign(found)
    print(f"{out}/campaign.html, {out}/campaign.csv")
    if not found.passes:
        raise typer.Exit(1)


def _processes(jobs: str) -> int | None:
    if jobs == "auto":
        return None
    if not (jobs.isascii() and jobs.isdigit()) or int(jobs) < 1:
        raise BadInput(f"--jobs: expected auto or a number from 1 on, found '{jobs}'")
    return int(jobs)
