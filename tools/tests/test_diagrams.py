"""docs/state-machine.md and docs/signals.md are what the source says."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from strix import _core
from strix.diagrams import (
    NODES,
    SIGNALS,
    SOURCE,
    calls_of,
    rows,
    signal_page,
    state_diagram,
    state_page,
    write_diagrams,
)
from strix.errors import BadInput

DOCS = Path(__file__).resolve().parents[2] / "docs"


def spoilt(tmp_path: Path, what: str, by: str) -> Path:
    text = SOURCE.read_text()
    assert text.count(what) == 1
    path = tmp_path / SOURCE.name
    path.write_text(text.replace(what, by))
    return path


def test_the_pages_in_the_manual_are_those_of_the_source(tmp_path: Path) -> None:
    for path in write_diagrams(tmp_path):
        assert (DOCS / path.name).read_text() == path.read_text(), "strix diagrams --out docs"


def test_every_row_that_leads_on_is_an_arrow_with_its_condition() -> None:
    lines = list(state_diagram(rows()))
    inner = lines[lines.index('  state "in flight" as FLYING {') + 1 : lines.index("  }")]
    states = {s["name"] for s in _core.states()}
    flying = {word for line in inner for word in re.findall(r"[A-Z_]{3,}", line) if word in states}
    arrows: dict[tuple[str, str], list[str]] = {}
    for line in lines:
        if found := re.fullmatch(r" *(\w+) --> (\w+) : (.*)", line):
            arrows[found[1], found[2]] = found[3].split("<br/>")
    expected: dict[tuple[str, str], set[str]] = {}
    for row in rows():
        for state in row.from_states:
            if row.from_states != (row.to,):
                frame = state in flying and flying <= set(row.from_states)
                expected.setdefault(("FLYING" if frame else state, row.to), set()).add(
                    row.condition
                )
    assert {ends: set(said) for ends, said in arrows.items()} == expected


def test_every_row_stands_in_the_table_in_its_order() -> None:
    page = state_page(rows())
    said = re.findall(r"^\| (\d+) \|.*\| ([^|]+) \|$", page, re.MULTILINE)
    assert said == [(str(i), row.said) for i, row in enumerate(rows(), 1)]


def test_another_table_is_another_page() -> None:
    table = rows()
    changed = [*table[:-1], replace(table[-1], to="SAFE")]
    assert state_page(changed) != state_page(table)


def test_a_call_that_the_diagram_lacks_is_named(tmp_path: Path) -> None:
    path = spoilt(
        tmp_path, "    readPower(time);\n", "    readPower(time);\n    board_.toggleLamp();\n"
    )
    with pytest.raises(BadInput, match=r"controlTick: .*found board_\.toggleLamp besides"):
        signal_page(path)


def test_a_call_that_is_gone_from_the_source_is_named(tmp_path: Path) -> None:
    path = spoilt(tmp_path, "    controller_.setAchieved(motors_.achieved());\n", "")
    with pytest.raises(BadInput, match=r"and not controller_\.setAchieved, motors_\.achieved"):
        signal_page(path)


def test_calls_in_comments_are_none(tmp_path: Path) -> None:
    path = spoilt(tmp_path, "    readPower(time);\n", "    readPower(time);  // not lamp_.on()\n")
    assert calls_of(path, "controlTick") == calls_of(SOURCE, "controlTick")


def test_every_box_has_an_arrow_and_every_arrow_two_boxes() -> None:
    names = {node.name for node in NODES}
    ends = {end for signal in SIGNALS for end in (signal.source, signal.target)}
    assert ends == names
