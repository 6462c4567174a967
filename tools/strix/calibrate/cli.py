"""The commands `strix calibrate ...`: thin functions over the modules beside this one."""

from __future__ import annotations

import functools
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ParamSpec

import numpy as np
import typer

from strix.calibrate import header
from strix.calibrate.outcome import Incomplete, Result
from strix.calibrate.readings import Readings
from strix.command import says_what_is_wrong
from strix.errors import BadInput
from strix.flightlog import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

P = ParamSpec("P")

calibrate_app = typer.Typer(
    name="calibrate",
    help="What the sensors add to the truth, from logs made on the bench (docs/calibration.md). "
    "Exits with 1 when a log is sound and does not suffice, and says what is missing.",
    no_args_is_help=True,
)

Log = Annotated[Path, typer.Argument(help="Flight log, .ulg")]
LogOrFolder = Annotated[
    Path, typer.Argument(help="Flight log, .ulg, or a folder with imu.csv and mag.csv")
]
Out = Annotated[Path, typer.Option(help="Folder for the figure")]
Write = Annotated[
    Path | None, typer.Option(help="Put the values into this file, include/Calibration.h")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON")]
Mounting = Annotated[
    str, typer.Option(help="sensorToBody of the IMU, nine numbers row by row, without any trim")
]
FIGURES = Path("out")
UPRIGHT = "1,0,0, 0,1,0, 0,0,1"


def says_what_is_missing(command: Callable[P, None]) -> Callable[P, None]:
    """A log that does not suffice ends in one line and status 1, bad input in status 2."""

    @says_what_is_wrong
    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            command(*args, **kwargs)
        except Incomplete as error:
            print(f"strix: {error}", file=sys.stderr)
            raise typer.Exit(1) from None

    return run


@calibrate_app.command(epilog="Example: strix calibrate gyro still.ulg")
@says_what_is_missing
def gyro(log: LogOrFolder, out: Out = FIGURES, as_json: AsJson = False) -> None:
    """Bias at standstill, and its temperature slope. 20 s on a firm table, motors off."""
    from strix.calibrate.gyro import calibrate_gyro

    readings = Readings(log)
    mag = readings.mag() if readings.has_mag() else None
    _finish("gyro", log, calibrate_gyro(readings.imu(), mag), out, as_json)


@calibrate_app.command(
    epilog="Example: strix calibrate accel six.ulg --write include/Calibration.h"
)
@says_what_is_missing
def accel(
    log: LogOrFolder,
    mounting: Mounting = UPRIGHT,
    gravity: Annotated[
        float, typer.Option(min=9.7, max=9.9, help="Where you are, m/s^2")
    ] = 9.80665,
    write: Write = None,
    out: Out = FIGURES,
    as_json: AsJson = False,
) -> None:
    """Bias and scale. The aircraft rests on each of its six faces, 5 s each, in any order."""
    from strix.calibrate.accel import calibrate_accel

    found = calibrate_accel(Readings(log).imu(), parse_mounting(mounting), gravity)
    _finish("accel", log, found, out, as_json, write)


@calibrate_app.command(epilog="Example: strix calibrate mag turns.ulg --field 50.2")
@says_what_is_missing
def mag(
    log: LogOrFolder,
    field: Annotated[
        float | None,
        typer.Option(min=20.0, max=70.0, help="Length of the earth's field where you are, uT"),
    ] = None,
    write: Write = None,
    out: Out = FIGURES,
    as_json: AsJson = False,
) -> None:
    """Hard and soft iron. Turn the aircraft slowly every way for a minute, outside, motors off."""
    from strix.calibrate.mag import calibrate_mag

    _finish("mag", log, calibrate_mag(Readings(log).mag(), field), out, as_json, write)


@calibrate_app.command(epilog="Example: strix calibrate throttle steps.ulg")
@says_what_is_missing
def throttle(log: Log, write: Write = None, out: Out = FIGURES, as_json: AsJson = False) -> None:
    """The motors' field. PROPS OFF, tied down: 3 s off, steps of 3 s, 3 s off."""
    from strix.calibrate.throttle import calibrate_throttle

    readings = Readings(log)
    imu = readings.imu() if readings.has_imu() else None
    found = calibrate_throttle(readings.mag(), readings.throttle(), imu)
    _finish("throttle", log, found, out, as_json, write)


@calibrate_app.command(epilog="Example: strix calibrate level table.ulg")
@says_what_is_missing
def level(
    log: LogOrFolder,
    mounting: Mounting = UPRIGHT,
    calibration: Annotated[
        Path, typer.Option(help="Where the accelerometer's bias and scale stand")
    ] = header.HEADER,
    write: Write = None,
    out: Out = FIGURES,
    as_json: AsJson = False,
) -> None:
    """Roll and pitch of the mounting. Level on a table 5 s, turned by 180 deg, 5 s more."""
    from strix.calibrate.level import calibrate_level

    known = header.read_header(calibration)
    bias, scale = known.values["accelBias"], known.matrix("accelScale")
    found = calibrate_level(Readings(log).imu(), parse_mounting(mounting), bias, scale)
    _finish("level", log, found, out, as_json, write)


@calibrate_app.command(epilog="Example: strix calibrate altimeter still.ulg")
@says_what_is_missing
def altimeter(log: Log, out: Out = FIGURES, as_json: AsJson = False) -> None:
    """Noise, drift and temperature coefficient at rest, doors and windows shut."""
    from strix.calibrate.altimeter import calibrate_altimeter

    readings = Readings(log)
    imu = readings.imu() if readings.has_imu() else None
    _finish("altimeter", log, calibrate_altimeter(readings.baro(), imu), out, as_json)


@calibrate_app.command(epilog="Example: strix calibrate gps outside.ulg")
@says_what_is_missing
def gps(log: Log, out: Out = FIGURES, as_json: AsJson = False) -> None:
    """Mean position and scatter. 10 minutes at rest under open sky."""
    from strix.calibrate.gps import calibrate_gps

    _finish("gps", log, calibrate_gps(Readings(log).gps()), out, as_json)


@calibrate_app.command(epilog="Example: strix calibrate allan night.ulg")
@says_what_is_missing
def allan(log: LogOrFolder, out: Out = FIGURES, as_json: AsJson = False) -> None:
    """Noise of the IMU, as the filter wants it. 10 minutes at rest; an hour is better."""
    from strix.calibrate.allan import measure_allan

    _finish("allan", log, measure_allan(Readings(log).imu()), out, as_json)


def parse_mounting(text: str) -> Array:
    """Nine numbers, row by row, that turn vectors and do nothing else."""
    try:
        numbers = [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if len(numbers) != 9:
        raise BadInput(f"--mounting: expected nine numbers, row by row, found {text!r}")
    matrix = np.array(numbers).reshape(3, 3)
    # As the flight code's isMounting: a matrix typed with four digits.
    off = float(np.abs(matrix @ matrix.T - np.eye(3)).max())
    determinant = float(matrix[0] @ np.cross(matrix[1], matrix[2]))
    if not off < 1e-4 or determinant < 0.0:
        raise BadInput(
            f"--mounting: expected a rotation (rows of length one at right angles, determinant "
            f"+1), found rows off by {off:.2g} and determinant {determinant:+.3f}"
        )
    return matrix


def _finish(
    command: str,
    log: Path,
    found: Result,
    out: Path,
    as_json: bool,
    write: Path | None = None,
) -> None:
    """Draw, write, tell."""
    source = header.source_of(command, log)
    figure = draw_into(
        out / f"calibrate_{command}.png", f"strix calibrate {command} {log.name}", found.draw
    )
    members = found.members()
    if write is not None:
        header.write_members(write, members, source)
    if as_json:
        print(json.dumps({**found.to_dict(), "figure": str(figure)}))
        return
    print("\n".join(found.sentences()))
    if write is not None:
        print(f"{', '.join(members)} written to {write}")
    elif members:
        print("for include/Calibration.h (--write puts it there):")
        print("\n".join(header.snippet(members, source)))
    print(figure)


def draw_into(path: Path, title: str, draw: Callable[[Figure], None]) -> Path:
    """A figure as PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure)
    figure.suptitle(title)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=110, metadata={"Software": None})
    except OSError as error:
        expected = f"--out {path.parent}: expected to write there"
        raise BadInput(f"{expected}, found: {error.strerror}") from None
    return path
