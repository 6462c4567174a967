"""docs/state-machine.md and docs/signals.md are what the source says."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from strix.diagrams import NODES, SIGNALS, SOURCE, calls_of, signal_page, write_diagrams
from strix.errors import BadInput
from strix.state_page import frames, hazard_matrix, label, state_diagram, state_page
from strix.state_table import first_row, hazards_of, meanings, rows, states

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


def drawn() -> dict[tuple[str, str], list[str]]:
    """The diagram's arrows."""
    found = (re.fullmatch(r" *(\w+) --> (\w+) : (.*)", line) for line in state_diagram(rows()))
    return {(f[1], f[2]): f[3].split("<br/>") for f in found if f}


def test_every_row_that_leads_on_is_an_arrow_from_each_of_its_states_or_their_frame() -> None:
    arrows = drawn()
    for row in rows():
        if row.from_states == (row.to,):
            continue
        for state in row.from_states:
            ends = [state, *(f for f, members in frames().items() if state in members)]
            said = label(row, hazards_of(rows()))
            assert any(said in arrows.get((end, row.to), []) for end in ends), row


def test_every_arrow_is_a_row_of_all_states_that_it_leaves() -> None:
    for (source, target), labels in drawn().items():
        for state in frames().get(source, {source}):
            said = {
                label(row, hazards_of(rows()))
                for row in rows()
                if state in row.from_states and row.to == target
            }
            assert said >= {*labels}


def test_the_frames_of_the_diagram_hold_the_states_of_their_arrows() -> None:
    lines = list(state_diagram(rows()))
    flying = lines[lines.index('  state "in flight" as FLYING {') : lines.index("  }")]
    words = {word for line in flying for word in re.findall(r"\b[A-Z][A-Z_]{3,}\b", line)}
    assert words & {s.name for s in states()} == frames()["FLYING"]
    # An arrow drawn in a frame pulls its ends into it.
    outside = lines[lines.index("  }") :]
    assert any("BLIND" in line for line in outside)


def test_the_matrix_of_hazards_says_where_each_leads() -> None:
    head, _, *lines = list(hazard_matrix(rows(), states()))
    shown = [cell.strip() for cell in head.split("|")[2:-1]]
    found = {}
    for line in lines:
        hazard, *cells = [cell.strip() for cell in line.split("|")[1:-1]]
        found[hazard] = dict(zip(shown, cells, strict=True))
    assert [*found] == hazards_of(rows())
    # As docs/safety.md tells it.
    assert found["Upset"] == dict.fromkeys(shown, "SAFE")
    assert found["BatteryLow"]["WAYPOINT"] == "RETURN"
    assert found["BatteryLow"]["TAKEOFF"] == "LAND"
    assert found["GpsLost"]["RETURN"] == "LAND"
    assert found["GpsLost"]["MANUAL"] == "-"
    assert found["ImuLost"]["HOLD"] == "BLIND"
    for hazard, state in ((h, s) for h in found for s in shown):
        row = first_row(rows(), state, frozenset({hazard, "Sticks", "Guided"}))
        if row is not None and hazard in row.when:
            assert found[hazard][state] == row.to


def test_every_condition_stands_on_the_page_with_its_meaning() -> None:
    page = state_page(rows())
    for name, meaning in meanings().items():
        assert page.count(f"| {name} | {meaning} |") == 1


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
