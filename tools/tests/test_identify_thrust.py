"""`strix identify thrust`: constants and curve come back from a noisy stand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from strix import _core
from strix.calibrate.outcome import Incomplete
from strix.errors import BadInput
from strix.identify.cli import identify_app
from strix.identify.thrust import (
    BOTH,
    LINEAR,
    SQUARE,
    ThrustResult,
    command_curve,
    identify_thrust,
)

runner = CliRunner()
Array = NDArray[np.float64]
QUAD, UGGLAN = _core.vehicle("Quad5in"), _core.vehicle("UgglanQ450")
KT, KM = 6.583e-5, 7.51e-7  # Quad5in, DESIGN.md
RATES = np.linspace(80.0, 380.0, 16)
SCALE_N, BALANCE_NM, PULSE_US = 0.05, 0.001, 1.0  # noise of the stand


def write_stand(path: Path, seed: int = 1, tare_n: float = 0.0, voltage: float = 22.8) -> Path:
    random = np.random.default_rng(seed)
    lines = ["# thrust stand, one rotor", "command,rate,thrust,torque,voltage"]
    for n in RATES:
        command = 1195.0 + n**2 / 160000.0 * 755.0 + PULSE_US * random.standard_normal()
        thrust = KT * n**2 + tare_n + SCALE_N * random.standard_normal()
        torque = KM * n**2 + BALANCE_NM * random.standard_normal()
        lines.append(f"{command:.2f},{n:.3f},{thrust:.4f},{torque:.5f},{voltage:.2f}")
    path.write_text("\n".join(lines) + "\n")
    return path


def test_the_constants_come_back_within_what_is_said_of_them(tmp_path: Path) -> None:
    thrust, torque, offsets = [], [], 0
    for seed in range(40):
        found = identify_thrust(write_stand(tmp_path / "stand.csv", seed), QUAD)
        assert found.torque is not None
        thrust.append((found.thrust.constant - KT) / found.thrust.sigma)
        torque.append((found.torque.constant - KM) / found.torque.sigma)
        offsets += found.thrust.has_offset
    for misses in (thrust, torque):
        assert np.abs(misses).max() < 4.5  # Student's t, 15 degrees, of 40
        assert 0.7 < np.std(misses) < 1.5
    assert offsets <= 3  # of a tared scale: 1 % each


def test_a_scale_that_was_not_tared_does_not_bend_the_constant(tmp_path: Path) -> None:
    found = identify_thrust(write_stand(tmp_path / "stand.csv", tare_n=0.4), QUAD)
    assert found.thrust.has_offset
    assert found.thrust.offset == pytest.approx(0.4, abs=4.0 * found.thrust.offset_sigma)
    assert found.thrust.constant == pytest.approx(KT, abs=4.0 * found.thrust.sigma)
    assert "the scale was not at zero" in "\n".join(found.sentences())


def test_the_form_of_the_curve_is_chosen_by_what_is_left_over() -> None:
    random = np.random.default_rng(3)
    noise = random.standard_normal(len(RATES))
    quad = command_curve(RATES, 1195.0 + RATES**2 * 755.0 / 160000.0 + noise)
    assert quad.name == SQUARE
    assert (quad.offset, quad.quadratic) == pytest.approx((1195.0, 755.0 / 160000.0), rel=0.003)
    assert quad.linear == 0.0
    ugglan = command_curve(2.0 * RATES, 57.0 * 2.0 * RATES - 9675.0 + 50.0 * noise)
    assert ugglan.name == LINEAR
    assert (ugglan.offset, ugglan.linear) == pytest.approx((-9675.0, 57.0), rel=0.01)
    both = command_curve(RATES, 1100.0 + 1.2 * RATES + 0.002 * RATES**2 + noise)
    assert both.name == BOTH
    # Six sigma of a fit whose columns look alike.
    assert both.at(RATES) == pytest.approx(1100.0 + 1.2 * RATES + 0.002 * RATES**2, abs=3.0)


def test_exact_numbers_have_no_offset_and_the_fewest_terms() -> None:
    assert command_curve(RATES, 57.0 * RATES - 9675.0).name == LINEAR


def test_the_lines_for_the_header_compile_into_the_same_numbers(tmp_path: Path) -> None:
    found = identify_thrust(write_stand(tmp_path / "stand.csv"), QUAD)
    thrust, torque, curve, voltage = (line.split("//")[0].strip() for line in found.header_lines())
    assert float(thrust.rstrip("F,")) == pytest.approx(found.thrust.constant, rel=1e-3)
    assert float(torque.rstrip("F,")) == pytest.approx(KM, rel=0.05)
    numbers = [float(v.strip().rstrip("F")) for v in curve.strip("{},").split(",")]
    assert numbers == pytest.approx(
        [found.curve.offset, found.curve.linear, found.curve.quadratic], rel=1e-5
    )
    assert all("." in v or "e" in v for v in curve.strip("{},").split(","))  # 1195F is no literal
    assert float(voltage.rstrip("F,")) == pytest.approx(22.8)


def test_a_sagging_battery_is_told(tmp_path: Path) -> None:
    table = write_stand(tmp_path / "stand.csv")
    lines = table.read_text().splitlines()
    for i in range(2, len(lines)):
        lines[i] = lines[i].rsplit(",", 1)[0] + f",{24.0 - 0.15 * i:.2f}"
    table.write_text("\n".join(lines) + "\n")
    assert "the battery sagged" in "\n".join(identify_thrust(table, QUAD).sentences())


def test_the_command_prints_numbers_for_a_program_and_draws(tmp_path: Path) -> None:
    table = write_stand(tmp_path / "stand.csv")
    arguments = ["thrust", str(table), "-o", str(tmp_path)]
    result = runner.invoke(identify_app, [*arguments, "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.output)
    assert found["thrust"]["constant"] == pytest.approx(KT, rel=0.01)
    assert found["command"]["name"] == SQUARE
    assert Path(found["figure"]).read_bytes().startswith(b"\x89PNG")
    result = runner.invoke(identify_app, arguments)
    assert "for include/vehicles/NAME.h:" in result.output
    assert runner.invoke(identify_app, [*arguments, "--vehicle", "Nothing"]).exit_code == 2


def test_too_little_of_the_range_is_refused(tmp_path: Path) -> None:
    table = tmp_path / "few.csv"
    table.write_text("command,rate,thrust\n" + "1300,150,1.5\n" * 4)
    with pytest.raises(Incomplete, match="expected 5 rows with a turning rotor"):
        identify_thrust(table, QUAD)
    table.write_text("command,rate,thrust\n" + "1300,150,1.5\n" * 10)
    with pytest.raises(Incomplete, match=r"2 times the slowest, found 10, 150 to 150"):
        identify_thrust(table, QUAD)
    assert runner.invoke(identify_app, ["thrust", str(table)]).exit_code == 1


def test_a_curve_that_falls_and_a_negative_speed_are_refused(tmp_path: Path) -> None:
    with pytest.raises(Incomplete, match="rises with the speed"):
        command_curve(RATES, 2000.0 - RATES)
    table = tmp_path / "bad.csv"
    rows = "\n".join(f"{1200 + n},{n},{KT * n**2}" for n in RATES)
    table.write_text(f"command,rate,thrust\n{rows}\n1300,-5,0.1\n")
    with pytest.raises(BadInput, match="column rate: expected no negative value, found -5"):
        identify_thrust(table, QUAD)
    table.write_text(f"command,rate,thrust\n{rows}\n1300,150,-1.5\n")
    with pytest.raises(BadInput, match="column thrust: expected no negative value"):
        identify_thrust(table, QUAD)


def test_a_row_at_rest_helps_the_offset_and_not_the_curve(tmp_path: Path) -> None:
    table = write_stand(tmp_path / "stand.csv")
    table.write_text(table.read_text() + "1150,0,0.0,0.0,22.8\n")
    found: ThrustResult = identify_thrust(table, QUAD)
    assert len(found.rate) == len(RATES)
    assert found.curve.offset == pytest.approx(1195.0, abs=3.0)


def test_units_are_those_of_the_vehicle(tmp_path: Path) -> None:
    table = tmp_path / "ugglan.csv"
    rates = np.linspace(250.0, 700.0, 10)
    rows = "\n".join(f"{57.0 * w - 9675.0},{w},{8.37e-6 * w**2}" for w in rates)
    table.write_text(f"command,rate,thrust\n{rows}\n")
    found = identify_thrust(table, UGGLAN)
    assert found.thrust.constant == pytest.approx(8.37e-6, rel=1e-6)
    assert any("N/(rad/s)^2" in line for line in found.header_lines())
    assert found.torque is None
