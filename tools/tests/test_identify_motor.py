"""`strix identify motor`: the time constant comes back, within what the command says of it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from typer.testing import CliRunner
from ulog_writer import ULogWriter

from strix.calibrate.outcome import Incomplete
from strix.errors import BadInput
from strix.identify.cli import identify_app
from strix.identify.lag import Record, find_steps, share_done
from strix.identify.motor import identify_motor, read_records

runner = CliRunner()
Array = NDArray[np.float64]
FINE_S = 0.0005  # of the simulated rotor


def lagging(tau_s: float, dead_s: float = 0.0, steps: int = 12, hold_s: float = 1.1) -> Array:
    """Columns time, command, speed of a rotor that follows 60 or 160 rev/s with a lag. Euler's
    method with the exact factor of a step, sharing nothing with the code but the definition.
    """
    time_s = np.arange(0.0, (steps + 1) * hold_s, FINE_S)
    which = np.minimum((time_s / hold_s).astype(int), steps)
    wanted = np.where(which % 2 == 0, 60.0, 160.0)
    late = np.concatenate([np.full(round(dead_s / FINE_S), wanted[0]), wanted])[: len(wanted)]
    speed = np.empty(len(time_s))
    now = 60.0
    for i, target in enumerate(late):
        speed[i] = now
        now = target + (now - target) * np.exp(-FINE_S / tau_s)
    return np.column_stack([time_s, 1195.0 + wanted**2 * 755.0 / 160000.0, speed])


def table_record(rows: Array, noise: float, seed: int, every: int = 4) -> Record:
    """A stand that reads every 2 ms."""
    random = np.random.default_rng(seed)
    rows = rows[::every]
    speed = rows[:, 2] + noise * random.standard_normal(len(rows))
    return Record("stand", 1, rows[:, 0], rows[:, 1], rows[:, 0], speed, 0.0, "rev/s")


def write_log(path: Path, taus_s: list[float], seed: int = 1) -> Path:
    """ESCs of 7 pole pairs that count turns of the field, read every 200 ms."""
    random = np.random.default_rng(seed)
    motors = [lagging(tau) for tau in taus_s]
    time_s = motors[0][:, 0]
    read_s = np.arange(0.2 + float(random.uniform(0.0, 0.2)), time_s[-1], 0.2)
    revolutions = np.full((len(read_s) - 1, 4), np.nan)
    output = np.full((len(time_s[::4]), 4), 1150.0)
    for i, rows in enumerate(motors):
        turns = np.floor(7.0 * np.interp(read_s, time_s, np.cumsum(rows[:, 2]) * FINE_S))
        revolutions[:, i] = np.diff(turns) / 7.0 / 0.2
        output[:, i] = rows[::4, 1]
    log = ULogWriter()
    log.info("vehicle", "Quad5in")
    log.topic("actuator_outputs", 5.0 + time_s[::4], {"noutputs": 4, "output": output})
    status = {
        "timestamp_sample": np.rint((5.0 + read_s[1:]) * 1e6),
        "revolutions": revolutions,
        "voltage": 22.0,
    }
    log.topic("esc_status", 5.0 + read_s[1:], status)
    return log.write(path)


@pytest.mark.parametrize("window_s", [0.0, 0.01, 0.2])
@pytest.mark.parametrize("tau_s", [0.01, 0.04, 0.2])
def test_a_reading_s_share_of_the_step_is_the_mean_over_its_window(
    tau_s: float, window_s: float
) -> None:
    def answer(s: float) -> float:
        return 1.0 - float(np.exp(-s / tau_s)) if s > 0.0 else 0.0

    for since_s in (-0.1, 0.0, 0.03, 0.15, 0.5):
        if window_s == 0.0:
            expected = answer(since_s)
        else:
            area = quad(answer, since_s - window_s, since_s, points=[0.0], limit=200)[0]
            expected = area / window_s
        found = share_done(np.array([since_s]), tau_s, window_s)[0]
        assert found == pytest.approx(expected, abs=1e-7)  # quad's own accuracy


@pytest.mark.parametrize("tau_s", [0.02, 0.04, 0.08])
def test_time_constant_and_dead_time_come_back_from_a_stand(tau_s: float) -> None:
    rows = lagging(tau_s, dead_s=0.006)
    misses = []
    for seed in range(20):
        lag = identify_motor([table_record(rows, 2.0, seed)]).motors[0]
        assert lag.dead_time_s is not None
        # The command is read every 2 ms: half of that, and noise of 2 rev/s on 100.
        assert lag.dead_time_s == pytest.approx(0.006, abs=0.002)
        assert lag.steps == 12
        misses.append((lag.tau_s - tau_s) / lag.sigma_s)
    # What it says of its own uncertainty is true: 20 normal numbers of sigma 1.
    assert np.abs(misses).max() < 4.0
    assert 0.6 < np.std(misses) < 1.5
    assert abs(np.mean(misses)) < 4.0 / 20**0.5


def test_four_motors_come_back_from_a_log_of_esc_status(tmp_path: Path) -> None:
    taus_s = [0.04, 0.05, 0.06, 0.08]
    found = identify_motor(read_records(write_log(tmp_path / "steps.ulg", taus_s), None))
    assert found.window_s == pytest.approx(0.2, abs=1e-5)
    for lag, tau_s in zip(found.motors, taus_s, strict=True):
        assert lag.dead_time_s is None  # 5 Hz cannot tell it
        assert abs(lag.tau_s - tau_s) < 3.0 * lag.sigma_s
        assert lag.sigma_s < 0.01
    assert found.mean_s == pytest.approx(np.mean([lag.tau_s for lag in found.motors]))


def test_a_motor_slower_than_its_command_curve_is_told(tmp_path: Path) -> None:
    records = read_records(write_log(tmp_path / "steps.ulg", [0.04] * 4), None)
    weak = replace(records[2], speed=0.9 * records[2].speed)
    found = identify_motor([*records[:2], weak, records[3]])
    # A turn of the field, 0.7 rev/s of 60, and the mean of a dozen.
    shares = [lag.of_curve for lag in found.motors]
    assert shares == pytest.approx([1.0, 1.0, 0.9, 1.0], abs=0.01)
    assert "90.0% of the command curve" in "\n".join(found.sentences())


def test_the_command_prints_numbers_for_a_program_and_draws(tmp_path: Path) -> None:
    log = write_log(tmp_path / "steps.ulg", [0.04, 0.04, 0.04, 0.04])
    result = runner.invoke(identify_app, ["motor", str(log), "-o", str(tmp_path), "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.output)
    assert found["motor_time_constant_s"] == pytest.approx(0.04, abs=0.003)
    assert Path(found["figure"]).read_bytes().startswith(b"\x89PNG")
    result = runner.invoke(identify_app, ["motor", str(log), "-o", str(tmp_path)])
    assert "Vehicle::motorTimeConstant" in result.output


def test_a_table_of_several_motors_is_told_motor_by_motor(tmp_path: Path) -> None:
    lines = ["time_s,command,speed,motor"]
    for motor, tau_s in ((2, 0.03), (4, 0.06)):
        lines += [f"{t},{c},{w},{motor}" for t, c, w in lagging(tau_s)[::4]]
    table = tmp_path / "stand.csv"
    table.write_text("\n".join(lines) + "\n")
    found = identify_motor(read_records(table, None))
    assert [lag.motor for lag in found.motors] == [2, 4]
    # The command's sample is up to 2 ms late; the dead time takes that up.
    assert [lag.tau_s for lag in found.motors] == pytest.approx([0.03, 0.06], rel=0.01)


def test_motors_whose_esc_is_silent_are_named(tmp_path: Path) -> None:
    found = identify_motor(read_records(write_log(tmp_path / "two.ulg", [0.04, 0.04]), None))
    assert [lag.motor for lag in found.motors] == [1, 2]
    assert [reason[:2] for reason in found.silent] == ["M3", "M4"]
    assert "tells no revolutions" in found.silent[0]


def test_a_ramp_and_a_flight_of_small_moves_hold_no_step() -> None:
    time_s = np.arange(0.0, 10.0, 0.002)
    for command in (1200.0 + 20.0 * time_s, np.full(len(time_s), 1300.0)):
        record = Record("x", 1, time_s, command, time_s, command, 0.0, "rev/s")
        assert find_steps(record) == []
        with pytest.raises(Incomplete, match="M1: expected steps of the command"):
            identify_motor([record])


def test_too_few_readings_in_the_range_are_refused() -> None:
    rows = lagging(0.04, steps=1)
    with pytest.raises(Incomplete, match="expected 5 readings between 15% and 95%"):
        identify_motor([table_record(rows, 0.0, 1, every=100)])  # 50 ms


def test_a_motor_that_does_not_follow_is_refused() -> None:
    rows = lagging(0.04)
    rows[:, 2] = 100.0
    with pytest.raises(Incomplete, match=r"expected the speed to follow|expected a time constant"):
        identify_motor([table_record(rows, 2.0, 1)])


def test_bad_tables_are_refused_with_their_place(tmp_path: Path) -> None:
    table = tmp_path / "bad.csv"
    cases = {
        "": "empty file",
        "time_s,command\n0,1\n": "column speed",
        "time_s,command,speed\n": "expected rows",
        "time_s,command,speed\n0,1200,ten\n": "line 2, column speed: expected a number",
        "time_s,command,speed\n0,1200,nan\n": "line 2, column speed: expected a number",
        "time_s,command,speed\n0,1200\n": "line 2: expected 3 columns",
        "time_s,command,speed\n1,1200,5\n0,1200,5\n": "column time_s",
    }
    for text, message in cases.items():
        table.write_text(text)
        with pytest.raises(BadInput, match=message):
            read_records(table, None)
        assert runner.invoke(identify_app, ["motor", str(table)]).exit_code == 2
    with pytest.raises(BadInput, match="expected a readable table"):
        read_records(tmp_path / "none.csv", None)


def test_a_log_without_steps_ends_with_status_1(tmp_path: Path) -> None:
    time_s = np.arange(0.0, 5.0, 0.2)
    log = ULogWriter()
    log.info("vehicle", "Quad5in")
    log.topic("actuator_outputs", time_s, {"output": np.full((len(time_s), 4), 1300.0)})
    log.topic("esc_status", time_s, {"timestamp_sample": time_s * 1e6, "revolutions": 100.0})
    result = runner.invoke(identify_app, ["motor", str(log.write(tmp_path / "x.ulg"))])
    assert result.exit_code == 1
    assert "M1: expected steps" in result.output
