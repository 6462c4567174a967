"""Reading a recording: a folder with one CSV file a sensor, plain or gzipped.

imu is required, the others may be missing. All times are seconds on one clock; the body frame is
FRD (x forward, y right, z down), the world NED.

    imu      t_s, ax, ay, az, gx, gy, gz                specific force m/s^2, rate rad/s
    mag      t_s, mx_uT, my_uT, mz_uT                   magnetic field
    baro     t_s, alt_m                                 height, up positive
    gps      t_s, fix, lat_deg, lon_deg, alt_m, vn, ve, vd     fix 3 is three-dimensional; m/s
    ref_att  t_s, qw, qx, qy, qz, scored                body to NED; nan where unknown
"""

from __future__ import annotations

import gzip
import math
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strix.errors import BadInput

Array = NDArray[np.float64]

TIME = "t_s"
# int64 microseconds and float64 seconds are both exact to a microsecond up to here (year 2255).
MAX_TIME_S = 9e9
COLUMNS = {
    "imu": (TIME, "ax", "ay", "az", "gx", "gy", "gz"),
    "mag": (TIME, "mx_uT", "my_uT", "mz_uT"),
    "baro": (TIME, "alt_m"),
    "gps": (TIME, "fix", "lat_deg", "lon_deg", "alt_m", "vn", "ve", "vd"),
}
FIX, PLACE, VELOCITY = 1, slice(2, 5), slice(5, 8)  # columns of gps
FIX_3D = 3.0
LIMITS = {TIME: MAX_TIME_S, "lat_deg": 90.0, "lon_deg": 180.0, "alt_m": 100_000.0}

END_OF_FILE = "the end of the file"


@dataclass(frozen=True)
class Recording:
    """One array a sensor, columns as in COLUMNS; no rows where the sensor is missing."""

    folder: Path
    imu: Array
    mag: Array
    baro: Array
    gps: Array


def read_recording(folder: Path) -> Recording:
    """Read every sensor file of a recording folder."""
    if not folder.is_dir():
        found = "a file" if folder.exists() else "nothing"
        raise BadInput(f"{folder}: expected a folder with imu.csv or imu.csv.gz, found {found}")
    sensors: dict[str, Array] = {}
    for sensor, columns in COLUMNS.items():
        path = find_table(folder, sensor)
        if path is not None:
            sensors[sensor] = read_table(path, columns)
        elif sensor == "imu":
            raise BadInput(f"{folder}: expected imu.csv or imu.csv.gz, found neither")
        else:
            sensors[sensor] = np.empty((0, len(columns)))
    return Recording(folder=folder, **sensors)


def find_table(folder: Path, name: str) -> Path | None:
    """NAME.csv or NAME.csv.gz in the folder; None when there is neither."""
    return next(
        (p for p in (folder / f"{name}.csv", folder / f"{name}.csv.gz") if p.exists()), None
    )


def read_table(path: Path, columns: tuple[str, ...], may_be_nan: tuple[str, ...] = ()) -> Array:
    """Read the named columns of a CSV file, in the order asked for; others are passed over.

    The first column must be the time, which may not go backwards. Every value must be finite in
    single precision (the filter's), or nan in a column of `may_be_nan`.
    """
    lines = _read_lines(path)
    if not lines:
        raise BadInput(
            f"{path}: expected a line with the columns {','.join(columns)}, found an empty file"
        )
    header = [name.strip() for name in lines[0].split(",")]
    for name in columns:
        if name not in header:
            raise BadInput(
                f"{path}: line 1: expected a column {name}, found {_quoted(','.join(header))}"
            )
    if len(lines) == 1:
        raise BadInput(f"{path}: line 2: expected a row of numbers, found the end of the file")

    places = [header.index(name) for name in columns]
    rows: list[list[float]] = []
    for number, line in enumerate(lines[1:], start=2):
        fields = line.split(",")
        if len(fields) != len(header):
            place = f"column {header[len(fields)]}" if len(fields) < len(header) else "its end"
            raise BadInput(
                f"{path}: line {number}, {place}: expected {len(header)} columns, "
                f"found {len(fields)}: {_quoted(line)}"
            )
        try:
            rows.append([float(fields[place]) for place in places])
        except ValueError:
            _refuse_text(path, number, columns, [fields[place] for place in places])

    table = np.array(rows)
    _check_values(path, columns, table, may_be_nan)
    return table


def _read_lines(path: Path) -> list[str]:
    """Lines of the file without their ends. A last line without an end is a file cut in a row:
    its last number may have lost digits and still be a number.
    """
    content, end = _read_bytes(path)
    lines = content.decode("utf-8-sig", errors="replace").split("\n")
    last = lines.pop()
    if last or end != END_OF_FILE:
        header = (lines or [last])[0].split(",")
        column = header[min(last.count(","), len(header) - 1)]
        raise BadInput(
            f"{path}: line {len(lines) + 1}, column {column.strip()}: "
            f"expected the rest of the row and a line end, found {end}"
        )
    return [line.removesuffix("\r") for line in lines]


def _read_bytes(path: Path) -> tuple[bytes, str]:
    """Content of the file, as far as it can be had, and what ends it."""
    content = bytearray()
    end = END_OF_FILE
    try:
        with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
            while chunk := file.read(1 << 16):
                content += chunk
    except EOFError:
        end = "the end of the compressed data (the file is cut)"
    except (gzip.BadGzipFile, zlib.error) as error:
        end = f"damaged gzip data ({error})"
    except OSError as error:
        raise BadInput(f"{path}: expected a readable file, found: {error.strerror}") from None
    return bytes(content), end


def _refuse_text(path: Path, number: int, columns: tuple[str, ...], fields: list[str]) -> None:
    for name, field in zip(columns, fields, strict=True):
        try:
            float(field)
        except ValueError:
            raise BadInput(
                f"{path}: line {number}, column {name}: expected a number, found {_quoted(field)}"
            ) from None


def _check_values(
    path: Path, columns: tuple[str, ...], table: Array, may_be_nan: tuple[str, ...]
) -> None:
    """Refuse the first value, in reading order, that is not finite or out of its range."""
    limits = np.array([LIMITS.get(name, float(np.finfo(np.float32).max)) for name in columns])
    good = np.abs(table) <= limits  # false for nan
    good |= np.isnan(table) & np.isin(columns, may_be_nan)
    if not good.all():
        row, column = (int(i) for i in np.argwhere(~good)[0])
        value = float(table[row, column])
        limit = limits[column]
        expected = f"a number from {-limit:g} to {limit:g}"
        if not math.isfinite(value):
            expected = "a finite number"
        place = f"{path}: line {row + 2}, column {columns[column]}"
        raise BadInput(f"{place}: expected {expected}, found {value:g}")
    backwards = np.flatnonzero(np.diff(table[:, 0]) < 0.0)
    if backwards.size:
        row = int(backwards[0]) + 1
        raise BadInput(
            f"{path}: line {row + 2}, column {columns[0]}: expected a time of at least "
            f"{table[row - 1, 0]:.6f} s (that of the line before), found {table[row, 0]:.6f} s"
        )


def _quoted(text: str) -> str:
    """The text as it is found, kept short and on one line."""
    return repr(text if len(text) <= 60 else text[:57] + "...")
