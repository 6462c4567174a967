"""The model for Spin is the compiled state machine, and Spin proves the properties on it."""

from __future__ import annotations

import random
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from strix.errors import BadInput
from strix.promela import PROPERTIES, model, write_model
from strix.state_table import Row, cubes, first_row, hazards_of, meanings, rows, states

MISSING = [tool for tool in ("spin", "gcc") if shutil.which(tool) is None]
needs_spin = pytest.mark.skipif(
    bool(MISSING), reason=f"no proof without {' and '.join(MISSING)}: apt-get install spin"
)


def outcomes(text: str, folder: Path, names: Sequence[str]) -> dict[str, bool]:
    """Whether each property holds for the model; Spin searches all that can happen."""
    (folder / "model.pml").write_text(text)
    for command in (
        ["spin", "-a", "model.pml"],
        # At most 1 GB; the model takes 3 MB.
        ["gcc", "-O1", "-w", "-DMEMLIM=1024", "-o", "pan", "pan.c"],
    ):
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
    found = {}
    for name in names:
        run = subprocess.run(
            ["./pan", "-a", "-m500000", "-N", name],
            cwd=folder,
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        errors = re.search(r"errors: (\d+)", run)
        assert errors is not None, run
        # A search that was cut short proves nothing.
        assert errors[1] != "0" or "Search not completed" not in run, run
        assert "max search depth too small" not in run, run
        found[name] = errors[1] == "0"
    return found


def changed(table: Sequence[Row], said: str, **what: object) -> list[Row]:
    assert sum(row.said == said for row in table) == 1
    return [replace(row, **what) if row.said == said else row for row in table]  # type: ignore[arg-type]


@needs_spin
def test_every_property_is_proven_of_the_table_that_flies(tmp_path: Path) -> None:
    text = write_model(tmp_path / "strix.pml").read_text()
    assert outcomes(text, tmp_path, list(PROPERTIES)) == dict.fromkeys(PROPERTIES, True)


@needs_spin
@pytest.mark.parametrize(
    ("said", "what", "broken"),
    [
        # A hazard that nobody answers any more; a way home that never lands.
        ("magnetometer lost: returning home", {"from_states": ("HOLD",)}, "lands"),
        ("home: landing", {"to": "HOLD", "failsafe": False}, "motors_off"),
        ("landed after a failsafe: motors off", {"to": "IDLE"}, "failsafe_ends_in_safe"),
        ("armed", {"when": ()}, "no_arming_by_power_up"),
        ("calibrated", {"to": "HOLD"}, "no_flight_by_power_up"),
        ("re-armed on the ground", {"when": ()}, "arming_is_an_edge"),
        ("killed: motors off", {"unless": ("Failsafe",)}, "kill"),
        ("armed", {"unless": ("PreArmFailure",)}, "killed_stays_off"),
        ("disarmed in flight: motors off", {"unless": ("Start",)}, "disarm"),
        ("re-armed on the ground", {"to": "TAKEOFF"}, "safe_is_left_by_an_edge"),
    ],
)
def test_spin_finds_the_flaw_of_a_table(
    said: str, what: dict[str, object], broken: str, tmp_path: Path
) -> None:
    text = model(changed(rows(), said, **what), states())
    assert outcomes(text, tmp_path, [broken]) == {broken: False}


@needs_spin
@pytest.mark.parametrize("was", [1, 0])
def test_that_nobody_looked_at_the_switch_before_is_what_forbids_power_up(
    was: int, tmp_path: Path
) -> None:
    # Even if BOOT armed: without the memory of a switch that is on, holding it would.
    table = [
        replace(row, to="ARMED") if row.from_states == ("BOOT",) and "ArmEdge" in row.when else row
        for row in rows()
    ]
    text = model(table, states())
    assert text.count("bool was = 1;") == 1
    text = text.replace("bool was = 1;", f"bool was = {was};")
    name = "no_arming_by_power_up"
    assert outcomes(text, tmp_path, [name]) == {name: was == 1}


def test_every_hazard_of_the_table_is_one_of_the_model() -> None:
    text = model(rows(), states())
    for hazard in hazards_of(rows()):
        assert f"      :: held = c_{hazard}\n" in text
    assert {"Kill", "Upset", "GpsLost", "BatteryLow", "Crash", "LogFailed"} <= {*hazards_of(rows())}


def test_the_cubes_of_a_state_are_all_sets_each_once_with_its_first_row() -> None:
    names = list(meanings())
    draw = random.Random(8)
    table = rows()
    for state in states():
        found = list(cubes(table, state.name))
        size = sum(2 ** (len(names) - len(c.all_of | c.none_of)) for c in found)
        assert size == 2 ** len(names)
        for _ in range(200):
            some = frozenset(draw.sample(names, draw.choice([0, 1, 2, 3, 5, 8, 20, 40])))
            (cube,) = [c for c in found if some >= c.all_of and not some & c.none_of]
            row = None if cube.row is None else table[cube.row]
            assert row == first_row(table, state.name, some)


def test_another_table_is_another_model() -> None:
    table = rows()
    assert model(table[:-1], states()) != model(table, states())


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"--out .*: expected a file that can be written"):
        write_model(tmp_path)
