"""docs/parameters.md is what the table says; a refusal says what is wrong."""

from pathlib import Path

import numpy as np
import pytest

from strix import _core
from strix.parameters import CHANGED, Parameter, parameter_page, parameters, plain

DOCS = Path(__file__).resolve().parents[2] / "docs"
TABLE = Path(__file__).resolve().parents[2] / "lib/FlightSoftware/Parameters.def"


def test_the_page_in_the_manual_is_that_of_the_table() -> None:
    found = (DOCS / "parameters.md").read_text()
    assert found == parameter_page(parameters()), "strix diagrams --out docs"


def test_every_row_of_the_source_is_in_the_table_in_its_order() -> None:
    rows = [
        line.split(",")[1].strip()
        for line in TABLE.read_text().splitlines()
        if line.startswith("PARAMETER(")
    ]
    assert [p.name for p in parameters()] == rows
    page = parameter_page(parameters())
    assert [line.split("`")[1] for line in page.splitlines() if line.startswith("| `")] == rows


@pytest.mark.parametrize("parameter", parameters(), ids=lambda p: p.name)
def test_a_value_is_taken_within_its_range_and_when_it_may_change(parameter: Parameter) -> None:
    name = parameter.name
    for value in (parameter.default, parameter.lowest, parameter.highest):
        assert _core.check_parameter(name, value) is None
    for value in (parameter.lowest - 1.0, 2.0 * parameter.highest + 1.0, float("nan")):
        refusal = _core.check_parameter(name, value)
        assert refusal is not None
        assert refusal.startswith(name)
        assert refusal.split(" from ")[1].startswith(
            f"{plain(parameter.lowest)} to {plain(parameter.highest)}"
        )
    locked = _core.check_parameter(name, parameter.default, motors_on=True)
    assert (locked is None) == (parameter.lock == "air")
    assert parameter.lock in CHANGED


def test_a_number_on_the_page_is_the_float_that_flies() -> None:
    for parameter in parameters():
        for value in (parameter.default, parameter.lowest, parameter.highest):
            assert float(np.float32(plain(value))) == value


def test_a_parameter_that_there_is_not_is_refused() -> None:
    assert _core.check_parameter("FENCE", 1.0) == "there is no such parameter"
