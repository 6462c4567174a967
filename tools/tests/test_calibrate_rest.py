"""`strix calibrate gyro`, `altimeter`, `gps` and `allan`: what a sensor at rest tells."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_bench import (
    GYRO_NOISE,
    RATE_HZ,
    Array,
    Errors,
    bench_imu,
    imu_log,
    tilted,
    write_imu,
)
from typer.testing import CliRunner
from ulog_writer import ULogWriter

from strix.calibrate.allan import axis_noise, measure_allan
from strix.calibrate.cli import calibrate_app
from strix.calibrate.gyro import calibrate_gyro
from strix.calibrate.outcome import Incomplete, rotation
from strix.calibrate.readings import Imu, Mag
from strix.calibrate.standstill import still_stretches

runner = CliRunner()
UP = np.array([0.0, 0.0, -1.0])


def resting(duration_s: float, seed: int = 1) -> Imu:
    return bench_imu([UP], Errors(), seed, still_s=duration_s)


def changed(imu: Imu, **columns: Array) -> Imu:
    return Imu(
        imu.where,
        imu.time_s,
        columns.get("accel", imu.accel_m_s2),
        columns.get("gyro", imu.gyro_rad_s),
        columns.get("temperature", imu.temperature_degc),
    )


# ---- standstill ----


def test_each_rest_is_found_whole_and_by_itself() -> None:
    ups = [tilted(UP, 10.0 * i, np.random.default_rng(4)) for i in range(4)]
    found = still_stretches(bench_imu(ups, Errors(), still_s=3.0))
    begins = 2.0 + 4.0 * np.arange(4)
    # The ends cut off by 0.3 s, and at most half a second more by the shaking beside them.
    assert [s.begin_s for s in found] == pytest.approx(begins + 0.3, abs=0.5)
    assert [s.end_s for s in found] == pytest.approx(begins + 2.7, abs=0.5)


def test_a_jump_between_two_rests_parts_them() -> None:
    first, second = resting(4.0, 1), bench_imu([np.array([1.0, 0.0, 0.0])], Errors(), 2, 4.0)
    imu = Imu(
        "bench",
        np.concatenate([first.time_s, second.time_s + 4.0]),
        np.concatenate([first.accel_m_s2, second.accel_m_s2]),
        np.concatenate([first.gyro_rad_s, second.gyro_rad_s]),
        np.concatenate([first.temperature_degc, second.temperature_degc]),
    )
    assert [round(s.begin_s, 1) for s in still_stretches(imu)] == [2.3, 6.3]


def test_a_gap_in_the_log_parts_a_rest() -> None:
    imu = resting(8.0)
    late = imu.time_s + np.where(imu.time_s > 6.0, 0.5, 0.0)
    imu = Imu("bench", late, imu.accel_m_s2, imu.gyro_rad_s, imu.temperature_degc)
    assert len(still_stretches(imu)) == 2


# ---- gyro ----


def test_the_bias_comes_back_with_an_honest_sigma() -> None:
    scores = []
    for seed in range(20):
        found = calibrate_gyro(resting(20.0, seed))
        scores += list((found.bias_rad_s - Errors().gyro_bias) / found.sigma_rad_s)
    # White noise over 19.4 s; 6 sigma as 60 numbers are looked at.
    sigma = GYRO_NOISE / np.sqrt(19.4 * RATE_HZ)
    assert found.bias_rad_s == pytest.approx(Errors().gyro_bias, abs=6.0 * sigma)
    assert found.noise_rad_s == pytest.approx(GYRO_NOISE, rel=0.05)  # 1 / sqrt(2 x 9700) is 0.7 %
    # 60 numbers of Student's t with 18 degrees of freedom (sigma 1.06): RMS +- 0.1, 4 of them.
    assert np.sqrt(np.mean(np.square(scores))) == pytest.approx(1.06, abs=0.4)


def test_the_temperature_slope_comes_back() -> None:
    imu = resting(120.0)
    temperature = 25.0 + 12.0 * (1.0 - np.exp(-(imu.time_s - 2.0) / 40.0))
    slope = np.array([3e-4, -5e-4, 0.0])
    gyro = imu.gyro_rad_s + np.outer(temperature - 30.0, slope)
    found = calibrate_gyro(changed(imu, gyro=gyro, temperature=temperature))
    assert found.slope_rad_s_k is not None
    # A line through 60000 samples whose temperature spreads by 3 K; 6 sigma.
    limit = 6.0 * GYRO_NOISE / 3.0 / np.sqrt(60_000)
    assert found.slope_rad_s_k == pytest.approx(slope, abs=limit)


def test_no_slope_is_made_of_a_log_that_did_not_warm() -> None:
    imu = resting(30.0)
    warm = changed(imu, temperature=np.linspace(30.0, 34.0, len(imu.time_s)))
    found = calibrate_gyro(warm)
    assert found.slope_rad_s_k is None
    assert "5 K are needed" in "\n".join(found.sentences())


def test_a_short_rest_is_refused_with_its_length() -> None:
    with pytest.raises(Incomplete, match=r"expected 10 s of standstill, found 4\.4 s at 2\.3 s"):
        calibrate_gyro(resting(5.0))


def test_a_hand_is_no_table() -> None:
    with pytest.raises(Incomplete, match=r"found 0\.0 s in a log of 20\.0 s"):
        calibrate_gyro(bench_imu([UP], Errors(), still_s=20.0, tremble=15.0))


def test_a_slow_turn_is_seen_by_gravity_or_by_the_field() -> None:
    imu = resting(20.0)
    angle = np.linspace(0.0, np.radians(10.0), len(imu.time_s))  # 0.5 deg/s: below all thresholds
    accel = imu.accel_m_s2 + np.column_stack([9.8 * np.sin(angle), 0.0 * angle, 0.0 * angle])
    with pytest.raises(Incomplete, match=r"gravity turned by \d\.\d\d deg"):
        calibrate_gyro(changed(imu, accel=accel))

    time_s = imu.time_s[::5]
    noise = 0.3 * np.random.default_rng(1).standard_normal((len(time_s), 3))
    about_z = [rotation(np.array([0.0, 0.0, a])) @ [20.0, 0.0, 45.0] for a in angle[::5]]
    with pytest.raises(Incomplete, match=r"the field turned by \d\.\d\d deg"):
        calibrate_gyro(imu, Mag("bench mag", time_s, np.array(about_z) + noise))


def test_the_gyro_command_prints_json(tmp_path: Path) -> None:
    log = imu_log(tmp_path / "still.ulg", resting(15.0))
    done = runner.invoke(calibrate_app, ["gyro", str(log), "--json", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["bias_rad_s"] == pytest.approx(list(Errors().gyro_bias), abs=3e-4)
    assert Path(found["figure"]).exists()


# ---- Allan ----


def noise_of(
    white: float, walk: float, flicker: float, duration_s: float, rate_hz: float, seed: int
) -> Array:
    """White noise of a density, the walk of another, and a sum of correlated noises, one for each
    octave of time, which together have a level Allan deviation.
    """
    random = np.random.default_rng(seed)
    count = round(duration_s * rate_hz)
    out = white * np.sqrt(rate_hz) * random.standard_normal(count)
    out += walk / np.sqrt(rate_hz) * np.cumsum(random.standard_normal(count))
    if flicker > 0.0:
        spectrum = np.fft.rfft(random.standard_normal(count))
        hz = np.fft.rfftfreq(count, 1.0 / rate_hz)
        # One-sided density B^2 / (pi f) (IEEE 952-1997, C.1.3, twice its two-sided one); white
        # noise of unit variance has 2 / rate.
        shape = np.zeros_like(hz)
        shape[1:] = np.sqrt(flicker**2 / (np.pi * hz[1:]) * rate_hz / 2.0)
        out += np.fft.irfft(spectrum * shape, count)
    return np.asarray(out)


def test_white_noise_instability_and_random_walk_come_back() -> None:
    found = axis_noise(noise_of(1e-3, 2e-4, 0.0, 3600.0, 50.0, 1), 50.0)
    assert found.white_sigma is not None
    assert found.walk_sigma is not None
    # Short averages are many: 0.2 % at 0.02 s. Of 400 s there are nine: 25 %, of 1 s curves less.
    assert found.white == pytest.approx(1e-3, rel=0.03)
    assert found.walk == pytest.approx(2e-4, rel=0.3)
    assert found.instability < 5e-4


def test_bias_instability_comes_back() -> None:
    found = axis_noise(noise_of(1e-3, 0.0, 4e-4, 3600.0, 50.0, 2), 50.0)
    assert found.instability_sigma is not None
    assert found.instability == pytest.approx(4e-4, rel=0.25)  # level from 10 to 400 s: 25 % there


def test_what_the_log_does_not_show_is_not_reported() -> None:
    imu = resting(90.0)
    found = measure_allan(imu)
    suggested = found.suggestions()
    assert suggested["gyroBiasWalk"] is None
    # GYRO_NOISE a sample at RATE_HZ is this density; three axes, the largest.
    density = GYRO_NOISE / np.sqrt(RATE_HZ)
    assert suggested["gyroNoise"] == pytest.approx(density, rel=0.05)
    words = "\n".join(found.sentences())
    assert "gyroBiasWalk: not seen in this log" in words
    assert "10 min at rest" in words


def test_allan_refuses_less_than_a_minute(tmp_path: Path) -> None:
    log = imu_log(tmp_path / "short.ulg", resting(30.0))
    done = runner.invoke(calibrate_app, ["allan", str(log), "--out", str(tmp_path)])
    assert done.exit_code == 1
    assert "expected a standstill of 60 s at least" in done.stderr


# ---- altimeter ----


def baro_log(path: Path, duration_s: float, slope_pa_k: float = 0.0, moved: bool = False) -> Path:
    random = np.random.default_rng(3)
    time_s = 2.0 + np.arange(0.0, duration_s, 0.02)
    degrees = 20.0 + (8.0 if slope_pa_k else 0.5) * (1.0 - np.exp(-(time_s - 2.0) / 20.0))
    pressure = 98_000.0 + 0.05 * (time_s - 2.0) + slope_pa_k * (degrees - 20.0)
    pressure = pressure + 2.0 * random.standard_normal(len(time_s))
    log = ULogWriter()
    fields = {"timestamp_sample": np.rint(time_s * 1e6), "pressure": pressure}
    log.topic("sensor_baro", time_s, {**fields, "temperature": degrees})
    write_imu(log, bench_imu([UP], Errors(), still_s=duration_s, tremble=15.0 if moved else 1.0))
    return log.write(path)


def altimeter(log: Path) -> dict[str, Any]:
    done = runner.invoke(calibrate_app, ["altimeter", str(log), "--json", "--out", str(log.parent)])
    assert done.exit_code == 0, done.output
    return dict(json.loads(done.stdout))


def test_noise_and_drift_of_the_altimeter(tmp_path: Path) -> None:
    found = altimeter(log=baro_log(tmp_path / "b.ulg", 120.0))
    assert found["noise_pa"] == pytest.approx(2.0, rel=0.05)  # 6000 samples: 1 %, and float32
    # 3 Pa/min; a line through 120 s of 2 Pa: 2 / 34.6 s / sqrt(6000) x 60; 5 sigma.
    assert found["drift_pa_min"] == pytest.approx(3.0, abs=5.0 * 0.045)
    assert found["slope_pa_k"] is None
    # 2 Pa and 0.13 Pa of wander, at 0.086 m/Pa there.
    assert found["height_sigma_m"] == pytest.approx(0.172, rel=0.06)


def test_the_altimeters_temperature_coefficient(tmp_path: Path) -> None:
    found = altimeter(log=baro_log(tmp_path / "b.ulg", 120.0, slope_pa_k=4.0))
    # The drift of 0.05 Pa/s is not told from it: 6 Pa over 8 K at most.
    assert found["slope_pa_k"] == pytest.approx(4.0, abs=0.75)


@pytest.mark.parametrize(
    ("duration_s", "moved", "words"),
    [(20.0, False, "expected 30 s at rest"), (40.0, True, "found it still for 0 s of 40 s")],
)
def test_an_altimeter_that_was_not_at_rest(
    duration_s: float, moved: bool, words: str, tmp_path: Path
) -> None:
    log = baro_log(tmp_path / "b.ulg", duration_s, moved=moved)
    done = runner.invoke(calibrate_app, ["altimeter", str(log), "--out", str(tmp_path)])
    assert done.exit_code == 1
    assert words in done.stderr


# ---- GPS ----

PLACE = (59.6512345, 17.9187654, 42.0)


def gps_log(path: Path, duration_s: float = 600.0, fix: int = 3, speed_m_s: float = 0.0) -> Path:
    """Errors of 2 m that last 30 s, at 10 Hz."""
    random = np.random.default_rng(4)
    time_s = 2.0 + np.arange(0.0, duration_s, 0.1)
    keep = np.exp(-0.1 / 30.0)
    error = np.zeros((len(time_s), 3))
    error[0] = 2.0 * random.standard_normal(3)
    kicks = 2.0 * np.sqrt(1.0 - keep**2) * random.standard_normal(error.shape)
    for i in range(1, len(error)):
        error[i] = keep * error[i - 1] + kicks[i]
    error[:, 0] += speed_m_s * (time_s - 2.0)
    cosine = np.cos(np.radians(PLACE[0]))
    log = ULogWriter()
    fields = {
        "timestamp_sample": np.rint(time_s * 1e6),
        "lat": np.rint((PLACE[0] + np.degrees(error[:, 0] / 6.371e6)) * 1e7),
        "lon": np.rint((PLACE[1] + np.degrees(error[:, 1] / (6.371e6 * cosine))) * 1e7),
        "alt": np.rint((PLACE[2] + error[:, 2]) * 1e3),
        "speed_knots": np.abs(0.1 * random.standard_normal(len(time_s))) + speed_m_s / 0.514444,
        "course_deg": 360.0 * random.random(len(time_s)),
        "hdop": 1.1,
        "fix_type": np.where(time_s < 5.0, 0, fix),
        "satellites_used": 9,
    }
    log.topic("vehicle_gps_position", time_s, fields)
    return log.write(path)


def test_the_place_comes_back_within_what_it_claims(tmp_path: Path) -> None:
    log = gps_log(tmp_path / "g.ulg")
    done = runner.invoke(calibrate_app, ["gps", str(log), "--json", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["left_out"] == 30
    # Ten stretches of 60 s are worth something of their own: a third, of scatter and of time.
    assert found["scatter_neu_m"] == pytest.approx([2.0, 2.0, 2.0], rel=0.45)
    assert found["correlation_s"] == pytest.approx(30.0, rel=0.6)
    sigma = found["mean_sigma_neu_m"]
    assert 0.3 < max(sigma) < 1.2  # 2 m / sqrt(10); not 2 m / sqrt(6000)
    off = (np.array([found["lat_deg"], found["lon_deg"]]) - PLACE[:2]) * [111_195.0, 56_170.0]
    assert np.abs(off / sigma[:2]).max() < 3.0
    # |speed| of 0.1 knots any way: its square is shared by two components.
    assert found["velocity_sigma_m_s"] == pytest.approx(0.0514 / np.sqrt(2.0), rel=0.05)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"duration_s": 30.0}, "over 60 s, found 270 of 300 over 26.9 s"),
        ({"fix": 2}, "found 0 of 6000"),
        ({"speed_m_s": 2.0}, "expected an aircraft at rest, found a median speed of 2."),
    ],
)
def test_gps_logs_that_tell_no_place(changes: dict[str, float], words: str, tmp_path: Path) -> None:
    log = gps_log(tmp_path / "g.ulg", **changes)  # type: ignore[arg-type]
    done = runner.invoke(calibrate_app, ["gps", str(log), "--out", str(tmp_path)])
    assert done.exit_code == 1, done.output
    assert words in done.stderr
