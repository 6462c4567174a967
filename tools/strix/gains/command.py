"""`strix gains`: design, report, refuse, write."""

from __future__ import annotations

import json
from pathlib import Path

from strix import _core
from strix.errors import BadInput
from strix.gains.analysis import design_and_analyse, refuse_thin_margins
from strix.gains.corners import corner_table, render_corners
from strix.gains.header import render_header
from strix.gains.report import render_report, report_dict
from strix.vehicles import vehicle_name

GAINS_FOLDER = Path(__file__).resolve().parents[3] / "include" / "gains"


def run_gains(
    vehicle: str | None,
    check: bool,
    folder: Path = GAINS_FOLDER,
    *,
    corners: bool = False,
    figures: Path | None = None,
    as_json: bool = False,
) -> bool:
    """Design the gains of one vehicle, or of all; print their reports; write the headers.

    With check no header is written. Returns whether every header was as it must be.
    """
    names = _core.vehicle_names() if vehicle is None else [vehicle_name(vehicle)]
    current, told = True, []
    for name in names:
        reports = design_and_analyse(_core.vehicle(name))
        flown = reports[0].design
        table = corner_table(flown) if corners or as_json else []
        said = []
        if not as_json:
            print(render_report(reports), end="\n\n")
        if corners and not as_json:
            print(render_corners(flown, table), end="\n\n")
        refuse_thin_margins([report.design for report in reports])
        header = render_header([report.design for report in reports])
        same, sentence = _put_header(folder / f"{name}.h", header, check)
        current = current and same
        said.append(sentence)
        if figures is not None:
            from strix.gains.figures import write_figures

            said += [str(path) for path in write_figures(reports, figures)]
        told.append({**report_dict(reports, table), "header_as_designed": same})
        if not as_json:
            print("\n".join(said))
    if as_json:
        print(json.dumps(told))
    return current


def _put_header(file: Path, text: str, check: bool) -> tuple[bool, str]:
    """Whether it is as it must be now, and what was done."""
    try:
        same = file.exists() and file.read_bytes() == text.encode()
        if check:
            return same, f"{file}: {'as designed' if same else 'not what the vehicle file gives'}"
        if not same:
            file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadInput(f"{file}: expected a file to write, found: {error.strerror}") from None
    return True, f"{file}: {'unchanged' if same else 'written; build again (make setup)'}"
