"""The commands `strix identify ...`: thin functions over the modules beside this one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import typer

from strix.calibrate.cli import draw_into, says_what_is_missing
from strix.errors import BadInput

if TYPE_CHECKING:
    from matplotlib.figure import Figure

identify_app = typer.Typer(
    name="identify",
    help="A vehicle's numbers, from logs, a thrust stand, scales and strings "
    "(docs/identification.md). Exits with 1 when the input is sound and does not suffice, and says "
    "what is missing.",
    no_args_is_help=True,
)

Out = Annotated[Path, typer.Option("--out", "-o", help="Folder for the figure")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON")]
FIGURES = Path("out")


class Result(Protocol):
    """One identification."""

    def sentences(self) -> list[str]:
        """For a person, with the lines for the vehicle's header."""

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""

    def draw(self, figure: Figure) -> None:
        """The figure."""


@identify_app.command(epilog="Example: strix identify motor steps.ulg -o out")
@says_what_is_missing
def motor(
    source: Annotated[
        Path, typer.Argument(help="Flight log, .ulg, or table: time_s,command,speed[,motor]")
    ],
    window: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=1.0,
            help="Each speed is the mean of so many s before it. Left out: of a log the time "
            "between readings, of a table 0",
        ),
    ] = None,
    out: Out = FIGURES,
    as_json: AsJson = False,
) -> None:
    """Time constant of the motors' lag, from steps of the command, 0.5 s or more between them."""
    from strix.identify.motor import identify_motor, read_records

    _finish("motor", source, identify_motor(read_records(source, window)), out, as_json)


@identify_app.command(epilog="Example: strix identify thrust stand.csv --vehicle Quad5in")
@says_what_is_missing
def thrust(
    table: Annotated[
        Path, typer.Argument(help="Of a thrust stand: command,rate,thrust[,torque][,voltage]")
    ],
    vehicle: Annotated[
        str, typer.Option(help="Airframe whose units the table has, and to compare with")
    ] = "Quad5in",
    out: Out = FIGURES,
    as_json: AsJson = False,
) -> None:
    """Thrust and torque constant and the command curve of one rotor. Thrust in N, torque in N m."""
    from strix import _core
    from strix.identify.thrust import identify_thrust
    from strix.vehicles import vehicle_name

    numbers = _core.vehicle(vehicle_name(vehicle))
    _finish("thrust", table, identify_thrust(table, numbers), out, as_json)


@identify_app.command(
    epilog="Example: strix identify inertia parts.csv --bifilar swings.csv --mass 0.83"
)
@says_what_is_missing
def inertia(
    parts: Annotated[
        Path | None,
        typer.Argument(help="CSV or TOML: name,shape,size,mass,position[,orientation]"),
    ] = None,
    bifilar: Annotated[
        Path | None, typer.Option(help="Timings of a pendulum: axis,distance,length,swings,time")
    ] = None,
    mass: Annotated[
        float | None,
        typer.Option(min=0.001, help="On the pendulum, kg. Left out: that of the parts list"),
    ] = None,
    ruler: Annotated[
        float, typer.Option(min=0.0, help="One sigma of the pendulum's lengths, m")
    ] = 0.0005,
    out: Out = FIGURES,
    as_json: AsJson = False,
) -> None:
    """Mass, centre of mass and inertia: of a parts list, of a bifilar pendulum, or of both."""
    from strix.identify.inertia import InertiaResult, combine, read_parts, read_swings

    body = combine(read_parts(parts), parts.name) if parts is not None else None
    source = parts or bifilar
    if source is None:
        raise BadInput("expected a parts list, or timings with --bifilar, found neither")
    swings = []
    if bifilar is not None:
        swung_kg = mass if mass is not None or body is None else body.mass_kg
        if swung_kg is None:
            raise BadInput("--mass: expected the mass on the pendulum, kg, found none")
        swings = read_swings(bifilar, swung_kg, ruler)
    _finish("inertia", source, InertiaResult(body, tuple(swings)), out, as_json)


def _finish(command: str, source: Path, found: Result, out: Path, as_json: bool) -> None:
    """Draw and tell."""
    figure = draw_into(
        out / f"identify_{command}.png", f"strix identify {command} {source.name}", found.draw
    )
    if as_json:
        print(json.dumps({**found.to_dict(), "figure": str(figure)}))
        return
    print("\n".join(found.sentences()))
    print(figure)
