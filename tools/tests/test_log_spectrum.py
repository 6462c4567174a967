"""`strix log spectrum` on logs whose lines are known."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest
import scipy.signal
import typer
from numpy.typing import NDArray
from shaking_log import NOISE, RATE_HZ, Array, hover, wave, write
from typer.testing import CliRunner
from written_log import fly_for

from strix import _core
from strix.errors import BadInput
from strix.log.cli_spectrum import spectrum as command
from strix.log.spectrum import Spectrum, spectrum
from strix.log.spectrum_input import commanded_turns, read_samples
from strix.log.spectrum_view import sentences

DATA = Path(os.environ.get("STRIX_DATA", Path(__file__).parents[3] / "shared" / "data"))
runner = CliRunner()
app = typer.Typer()
app.command()(command)


def said(found: Spectrum) -> str:
    return "\n".join(sentences(found))


def test_the_density_is_that_of_welchs_method(tmp_path: Path) -> None:
    found = spectrum(write(tmp_path / "a.ulg", lambda t: 0.0 * t))
    assert found.rate_hz == pytest.approx(RATE_HZ, rel=1e-6)
    assert found.samples == 22_500
    assert not found.resampled
    # White noise: all its power below Nyquist, 2 % of it below 20 Hz. 22500 samples: 0.5 %.
    share = np.sqrt(1.0 - 20.0 / (RATE_HZ / 2.0))
    np.testing.assert_allclose(found.noise_rms, NOISE * share, rtol=0.02)
    assert found.peaks == []
    assert not found.aliased
    assert "notch: no proposal" in said(found)  # no motor command in this log


def test_each_line_is_found_with_its_strength_and_axis(tmp_path: Path) -> None:
    def two(t: Array) -> Array:
        return 0.02 * np.sin(2 * np.pi * 97.3 * t) + 0.005 * np.sin(2 * np.pi * 310.0 * t)

    found = spectrum(write(tmp_path / "a.ulg", two))
    for peak, hz, amplitude in zip(found.peaks, (97.3, 310.0), (0.02, 0.005), strict=True):
        assert peak.hz == pytest.approx(hz, abs=0.6)  # half a bin
        # A sine's RMS is its amplitude / sqrt(2); y has a third of x.
        assert peak.rms == pytest.approx(amplitude / np.sqrt(2) * np.sqrt(10) / 3, rel=0.05)
        assert peak.axis == "x"


@pytest.mark.parametrize(("rate_hz", "true_hz", "seen_hz"), [(1125, 700, 425), (1000, 1190, 190)])
def test_a_line_beyond_nyquist_shows_up_folded(
    tmp_path: Path, rate_hz: float, true_hz: float, seen_hz: float
) -> None:
    log = write(
        tmp_path / "a.ulg", lambda t: 0.02 * np.sin(2 * np.pi * true_hz * t), rate_hz=rate_hz
    )
    (peak,) = spectrum(log).peaks
    assert peak.hz == pytest.approx(seen_hz, abs=0.6)  # half a bin


def test_the_notch_proposed_takes_the_motors_line_out(tmp_path: Path) -> None:
    """Judged by the flight code's own filter, on the log it was proposed from."""
    found = spectrum(write(tmp_path / "a.ulg", lambda t: wave(hover, 1.0, 0.1, t), hover))
    assert found.motor_lines is not None
    first, second, third = found.motor_lines
    assert first.found_order == pytest.approx(1.0, abs=0.005)
    assert first.rms == pytest.approx(0.1 / np.sqrt(2) * np.sqrt(10) / 3, rel=0.05)
    assert first.from_hz == pytest.approx(150.0, abs=2.0)
    assert first.to_hz == pytest.approx(200.0, abs=2.0)
    assert first.share > 0.95
    assert second.found_order is None
    assert third.found_order is None
    notch = found.notch
    assert notch is not None
    assert notch.min_hz < 150.0
    assert notch.max_hz > 200.0
    assert notch.harmonics == 1
    text = said(found)
    assert f"config.gyroFilter.notchMin = {notch.min_hz:.1f}F;" in text
    assert f"config.gyroFilter.notchQ = {notch.q:.1f}F;" in text

    config = _core.GyroFilterConfig()
    config.notchMin, config.notchMax, config.notchQ = notch.min_hz, notch.max_hz, notch.q
    filter_ = _core.GyroFilter(config, RATE_HZ, 500.0, 0.0)
    time_s = np.arange(0.0, 20.0, 1.0 / RATE_HZ)
    line = wave(hover, 1.0, 0.1, time_s)
    left = np.empty_like(line)
    for i, speed in enumerate(hover(time_s)):
        filter_.setMotorSpeed(speed)
        left[i] = filter_.update(np.full((1, 3), line[i], dtype=np.float32))[0, 0]
    assert np.std(left[1000:]) < np.std(line) / 3.0  # what SPREADS promises


def test_the_motors_come_after_their_command(tmp_path: Path) -> None:
    def quick(t: Array) -> Array:  # the command is up to 6 rev/s ahead of it
        return 175.0 + 25.0 * np.sin(6.0 * t)

    turns = read_samples(write(tmp_path / "a.ulg", quick, quick), "gyro").turns
    assert turns is not None
    after = turns.time_s > 1.0  # the motors have started
    # Half a control period of 2 ms at up to 150 rev/s^2, and the steps of the command.
    np.testing.assert_allclose(turns.hz[after, 0], quick(turns.time_s[after]), atol=0.5)


def test_motors_slower_than_their_curve_are_seen_and_make_the_notch_wider(tmp_path: Path) -> None:
    exact = spectrum(write(tmp_path / "a.ulg", lambda t: wave(hover, 1.0, 0.1, t), hover))
    slow = spectrum(write(tmp_path / "b.ulg", lambda t: wave(hover, 0.93, 0.1, t), hover))
    assert exact.motor_lines is not None
    assert slow.motor_lines is not None
    assert slow.motor_lines[0].found_order == pytest.approx(0.93, abs=0.005)
    assert "at 0.930 of the predicted speed" in said(slow)
    assert exact.notch is not None
    assert slow.notch is not None
    assert slow.notch.q == pytest.approx(1.0 / (6.0 * 0.07), abs=0.11)
    assert exact.notch.q > 1.5 * slow.notch.q
    assert slow.notch.lag_deg > exact.notch.lag_deg


def test_two_harmonics_are_both_proposed_and_fit_below_nyquist(tmp_path: Path) -> None:
    found = spectrum(
        write(
            tmp_path / "a.ulg",
            lambda t: wave(hover, 1.0, 0.1, t) + wave(hover, 2.0, 0.06, t),
            hover,
        )
    )
    assert found.notch is not None
    assert found.notch.harmonics == 2
    assert 400.0 <= 2 * found.notch.max_hz <= 0.45 * RATE_HZ


def test_a_motor_line_beyond_nyquist_is_told_and_gets_no_notch(tmp_path: Path) -> None:
    """Three blades: 450 to 600 Hz, where 1125 Hz sees 525 to 562.5 Hz and back."""

    def fast(t: Array) -> Array:
        return 225.0 + 20.0 * np.sin(0.7 * t)

    log = write(tmp_path / "a.ulg", lambda t: wave(fast, 3.0, 0.1, t), fast)
    found = spectrum(log)
    assert found.motor_lines is not None
    third = found.motor_lines[2]
    assert third.found_order == pytest.approx(3.0, abs=0.01)
    assert third.folds_to_hz is not None
    assert third.folds_to_hz[0] == pytest.approx(RATE_HZ - 3 * 205.0, abs=6.0)
    assert third.folds_to_hz[1] == pytest.approx(RATE_HZ - 3 * 245.0, abs=6.0)
    assert found.aliased
    assert found.notch is None
    assert "beyond Nyquist (562.5 Hz)" in said(found)
    assert "notch: none reaches the line at motors x 3" in said(found)
    result = runner.invoke(app, [str(log), "-o", str(tmp_path / "a.png")])
    assert result.exit_code == 1


def test_no_notch_where_the_motors_are_quiet(tmp_path: Path) -> None:
    found = spectrum(write(tmp_path / "a.ulg", lambda t: wave(hover, 1.0, 0.0018, t), hover))
    assert found.motor_lines is not None
    line = found.motor_lines[0]
    assert line.found_order == pytest.approx(1.0, abs=0.01)  # it is there,
    assert 0.04 < line.share < 0.1  # and a notch would lower the RMS by less than 5 %
    assert found.notch is None
    assert "notch: none needed" in said(found)


def test_neither_a_fixed_line_nor_a_knock_is_taken_for_the_motors(tmp_path: Path) -> None:
    """410 Hz is 2.05 to 2.73 times the turns, within reach of twice and of three times."""

    def fixed(t: Array) -> Array:
        return np.asarray(0.02 * np.sin(2 * np.pi * 410.0 * t))

    def knock(t: Array) -> Array:
        out = 0.0 * t
        out[9000:9040] += 50.0
        return out

    for signal in (fixed, knock):
        found = spectrum(write(tmp_path / "a.ulg", signal, hover))
        assert found.motor_lines is not None
        assert [line.found_order for line in found.motor_lines] == [None, None, None]
    both = spectrum(
        write(tmp_path / "b.ulg", lambda t: fixed(t) + knock(t) + wave(hover, 1.0, 0.1, t), hover)
    )
    assert both.motor_lines is not None
    assert [line.found_order is not None for line in both.motor_lines] == [True, False, False]
    assert both.motor_lines[0].share > 0.9
    assert both.notch is not None


def test_energy_that_piles_up_at_nyquist_is_told(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)

    def hiss(t: Array) -> Array:  # noise from 515 Hz up: folded, no sensor's low-pass lets it pass
        high = scipy.signal.butter(6, 515.0, "high", fs=RATE_HZ, output="sos")
        return np.asarray(scipy.signal.sosfilt(high, 0.02 * rng.standard_normal(len(t))))

    found = spectrum(write(tmp_path / "a.ulg", hiss))
    assert found.piled_up
    assert found.aliased
    assert "towards Nyquist" in said(found)


def test_clipped_samples_are_counted_shown_and_end_in_status_1(tmp_path: Path) -> None:
    full = np.radians(2000.0)

    def knock(t: Array) -> Array:  # 12 samples of one wave
        out = 0.0 * t
        out[5000:5012] = 2.0 * full
        return out

    log = write(tmp_path / "a.ulg", knock)
    found = spectrum(log)
    assert found.clipped == (12, 0, 0)  # a third of it on y is within the range
    assert len(found.clipped_s) == 12
    assert "clipping: samples at 2000 deg/s: 12 on x, the first at 5.444 s" in said(found)
    out = tmp_path / "a.png"
    result = runner.invoke(app, [str(log), "--json", "-o", str(out)])
    assert result.exit_code == 1
    assert json.loads(result.stdout)["clipped"] == [12, 0, 0]
    assert out.read_bytes().startswith(b"\x89PNG")
    assert spectrum(log, full_scale=4000.0).clipped == (0, 0, 0)
    assert spectrum(log, full_scale=1000.0).clipped == (12, 12, 0)


def test_the_accelerometer_is_in_its_own_unit(tmp_path: Path) -> None:
    log = write(tmp_path / "a.ulg", lambda t: 0.02 * np.sin(2 * np.pi * 120.0 * t))
    found = spectrum(log, "accel")
    (peak,) = found.peaks
    assert peak.rms == pytest.approx(100.0 * 0.02 / np.sqrt(2) * np.sqrt(10) / 3, rel=0.05)
    assert found.unit == "m/s^2"
    assert found.full_scale == 30.0


def test_uneven_times_are_resampled_and_told(tmp_path: Path) -> None:
    """A sample in nine left out, as a task of 1000 Hz does with a sensor of 1125 Hz."""
    log = write(
        tmp_path / "a.ulg",
        lambda t: 0.02 * np.sin(2 * np.pi * 97.3 * t),
        keep=lambda n: np.arange(n) % 9 != 4,
        jitter_us=60.0,
    )
    found = spectrum(log)
    assert found.rate_hz == pytest.approx(RATE_HZ, rel=1e-4)
    assert found.missing == 2500
    assert found.resampled
    assert found.peaks[0].hz == pytest.approx(97.3, abs=0.6)
    assert found.peaks[0].rms == pytest.approx(0.02 / np.sqrt(2) * np.sqrt(10) / 3, rel=0.06)
    assert "2500 single samples missing (11.1 %)" in said(found)


def test_a_gap_is_refused_and_the_longest_part_named(tmp_path: Path) -> None:
    def keep(n: int) -> NDArray[np.bool_]:
        kept = np.ones(n, dtype=bool)
        kept[3000:3050] = False  # 45 ms, 2.67 s after the first
        return kept

    log = write(tmp_path / "a.ulg", lambda t: 0.0 * t, keep=keep)
    with pytest.raises(BadInput, match=r"found none for 45\.3 ms from 3\.666 s") as refusal:
        spectrum(log)
    part = re.search(r"--from ([\d.]+) --to ([\d.]+)$", str(refusal.value))
    assert part is not None
    found = spectrum(log, from_s=float(part[1]), to_s=float(part[2]))
    assert found.samples >= 22_500 - 3050 - 4  # both ends are rounded inwards to 1 ms
    assert not found.resampled


def test_the_part_asked_for_is_what_counts(tmp_path: Path) -> None:
    log = write(tmp_path / "a.ulg", lambda t: 0.02 * np.sin(2 * np.pi * 97.3 * t) * (t < 10.0))
    assert spectrum(log, from_s=1.0, to_s=9.9).peaks != []
    later = spectrum(log, from_s=10.1)
    assert later.peaks == []
    assert later.begin_s == pytest.approx(10.1, abs=1e-3)
    assert later.end_s == pytest.approx(21.0, abs=2e-3)


def test_by_default_the_ground_does_not_count(tmp_path: Path) -> None:
    def flight(t: Array) -> Array:  # 60 rev/s is idle
        return np.where((t > 6.0) & (t < 18.0), 175.0, 60.0)

    log = write(tmp_path / "a.ulg", lambda t: 0.0 * t, flight)
    found = spectrum(log)
    assert not found.whole
    assert found.begin_s == pytest.approx(6.0, abs=0.05)
    assert found.end_s == pytest.approx(18.0, abs=0.2)  # the lag: 66 rev/s, 0.12 s later


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--topic", "mag"], "--topic: expected gyro or accel, found 'mag'"),
        (["--from", "90"], "expected samples from 90.000 to 20.999 s, found those from 1.000 to"),
        (["--from", "2", "--to", "3"], "expected at least 3.6 s of samples, found 1.0 s"),
        (["-o", "a.pdf"], "expected a name that ends in .png, found '.pdf'"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(
    tmp_path: Path, arguments: list[str], message: str
) -> None:
    log = write(tmp_path / "a.ulg", lambda t: 0.0 * t)
    result = runner.invoke(app, [str(log), "-o", str(tmp_path / "x.png"), *arguments])
    assert result.exit_code == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_log_that_is_too_slow_for_vibration_is_refused(tmp_path: Path) -> None:
    slow = write(tmp_path / "a.ulg", lambda t: 0.0 * t, rate_hz=39.0)
    with pytest.raises(BadInput, match="expected at least 40 samples a second, found 39"):
        spectrum(slow)
    barely = spectrum(write(tmp_path / "b.ulg", lambda t: 0.0 * t, rate_hz=40.5))
    assert barely.peaks == []


def test_a_sample_that_is_no_number_is_named(tmp_path: Path) -> None:
    def broken(t: Array) -> Array:
        out = 0.0 * t
        out[41] = np.nan
        return out

    log = write(tmp_path / "a.ulg", broken)
    with pytest.raises(BadInput, match="sensor_combined, record 42: expected finite numbers"):
        spectrum(log)


@pytest.mark.parametrize("name", _core.vehicle_names())
def test_speeds_are_read_off_the_commands(name: str) -> None:
    vehicle = _core.vehicle(name)
    curve = vehicle["command"]
    per_rev = 2.0 * np.pi if vehicle["speed_unit"] == "rad/s" else 1.0
    n = np.linspace(vehicle["speed_flight_min"], 2.0 * vehicle["speed_flight_min"], 9)
    commands = curve["offset"] + (curve["linear"] + curve["quadratic"] * n) * n
    np.testing.assert_allclose(commanded_turns(vehicle, commands), n / per_rev, rtol=1e-9)
    assert commanded_turns(vehicle, np.array([vehicle["command_off"]])).tolist() == [0.0]


def test_a_simulated_flight_needs_no_notch(tmp_path: Path) -> None:
    """The simulator's IMU has white noise behind a 100 Hz low-pass; its motors do not shake."""
    log = tmp_path / "flight.ulg"
    fly_for(28.0, 5, log)
    found = spectrum(log)
    assert found.begin_s > 15.0  # take-off, after the start-up calibration
    assert not found.resampled
    assert found.clipped == (0, 0, 0)
    assert found.peaks == []
    assert not found.aliased
    assert found.motor_lines is not None
    # Quad5in's hover: 0.83 kg on four motors of 6.583e-5 N/(rev/s)^2.
    hover_hz = np.sqrt(0.83 * 9.80665 / 4.0 / 6.583e-5)
    assert found.motor_lines[0].from_hz < hover_hz < found.motor_lines[0].to_hz
    assert [line.found_order for line in found.motor_lines] == [None, None, None]
    assert "notch: none needed" in said(found)


def test_a_recording_has_a_spectrum_too() -> None:
    folder = DATA / "px4_hover"
    if not folder.is_dir():
        pytest.skip(f"no recording in {folder}")
    found = spectrum(folder, "accel")
    assert found.rate_hz == pytest.approx(222.4, abs=0.2)
    # Its three lines: as scipy.signal.welch and a look at the figure say.
    assert {52, 70, 85} <= {round(peak.hz) for peak in found.peaks}
    assert found.piled_up  # x rises tenfold from 90 Hz to Nyquist
    assert found.motor_lines is None


def test_a_recording_with_gaps_is_refused() -> None:
    folder = DATA / "quad_optflow"
    if not folder.is_dir():
        pytest.skip(f"no recording in {folder}")
    with pytest.raises(BadInput, match=r"found none for 484.0 ms from 427.660 s"):
        spectrum(folder)
