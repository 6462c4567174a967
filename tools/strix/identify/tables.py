"""Tables that a person writes by hand: CSV with a line of names, `#` before remarks."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from strix.errors import BadInput
from strix.flightlog import Array


def read_rows(path: Path, required: Sequence[str]) -> list[tuple[int, dict[str, str]]]:
    """The rows by column name, each with its line number; no row is shorter than the header."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        found = error.strerror if isinstance(error, OSError) else "bytes that are no text"
        raise BadInput(f"{path}: expected a readable table, found: {found}") from None
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise BadInput(f"{path}: expected a line with {','.join(required)}, found an empty file")
    header = [name.strip() for name in next(csv.reader([lines[0][1]]))]
    for name in required:
        if name not in header:
            raise BadInput(
                f"{path}: line {lines[0][0]}: expected a column {name}, found {','.join(header)}"
            )
    rows = []
    for number, line in lines[1:]:
        cells = [cell.strip() for cell in next(csv.reader([line]))]
        if len(cells) != len(header):
            raise BadInput(
                f"{path}: line {number}: expected {len(header)} columns "
                f"({','.join(header)}), found {len(cells)}"
            )
        rows.append((number, dict(zip(header, cells, strict=True))))
    if not rows:
        raise BadInput(f"{path}: expected rows behind the line of names, found none")
    return rows


def number_of(path: Path, line: int, name: str, text: str) -> float:
    """A finite number, or BadInput with its place."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadInput(f"{path}: line {line}, column {name}: expected a number, found {text!r}")
    return value


def read_columns(
    path: Path, required: Sequence[str], optional: Sequence[str] = ()
) -> Mapping[str, Array]:
    """Columns of finite numbers; an optional one is there when the header has it."""
    rows = read_rows(path, required)
    names = [*required, *(name for name in optional if name in rows[0][1])]
    return {
        name: np.array([number_of(path, line, name, row[name]) for line, row in rows])
        for name in names
    }
