"""Sensors: when they deliver, what of, and how well."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2
from test_plant_vehicle import QUAD5IN

from strix.plant import Plant, SensorConstants, SensorSuite, Surroundings, Truth
from strix.plant.earth import MAGNETIC_DECLINATION_RAD, pressure_pa
from strix.plant.frames import IDENTITY, Matrix, level_at_heading
from strix.plant.samples import Samples

G = 9.80665
CALM = Surroundings()
MAGNETIC = Surroundings(motor_field_at_hover_ut=(3.0, -2.0, 3.5))
AT_REST = Plant(QUAD5IN, CALM, 0.0, seed=0).truth
SPECIFIED = SensorConstants()
# What the devices would say without noise, bias and steps: for tests of everything else.
EXACT = SensorConstants(
    accel_sigma_m_s2=0.0,
    gyro_sigma_rad_s=0.0,
    accel_bias_sigma_m_s2=0.0,
    gyro_bias_sigma_rad_s=0.0,
    gyro_bias_walk_rad_s_sqrt_s=0.0,
    accel_lsb_m_s2=1e-9,
    gyro_lsb_rad_s=1e-9,
    mag_sigma_ut=0.0,
    mag_lsb_ut=1e-9,
    baro_sigma_pa=0.0,
    baro_lsb_pa=1e-9,
    gps_position_sigma_m=0.0,
    gps_altitude_sigma_m=0.0,
    gps_velocity_sigma_m_s=0.0,
)
RARE = [1e-6, 1.0 - 1e-6]  # a right model fails one of a million seeds on either side


def readings(
    duration_ms: int,
    truth_at: Callable[[int], Truth] = lambda time_us: replace(AT_REST, time_us=time_us),
    constants: SensorConstants = SPECIFIED,
    seed: int = 0,
    call_ms: int = 1,
) -> Iterator[Samples]:
    suite = SensorSuite(CALM, seed, constants)
    for time_us in range(0, duration_ms * 1000, call_ms * 1000):
        yield suite.sample(truth_at(time_us))


# --- when ----------------------------------------------------------------------------------


def test_each_sensor_keeps_its_rate_and_no_two_slow_ones_start_together() -> None:
    times: dict[str, list[int]] = {"imu": [], "mag": [], "baro": [], "gps": []}
    for millisecond, samples in enumerate(readings(3000)):
        for name, list_ms in times.items():
            if getattr(samples, name) is not None:
                list_ms.append(millisecond)
    expected = {"imu": (1, 0), "mag": (10, 3), "baro": (20, 7), "gps": (100, 41)}
    for name, (period_ms, phase_ms) in expected.items():
        assert set(np.diff(times[name])) == {period_ms}
        assert times[name][0] % period_ms == phase_ms
        assert times[name][-1] + period_ms >= 3000  # to the end
    # Nothing is delivered that was measured before there was anything to measure.
    assert (times["mag"][0], times["baro"][0], times["gps"][0]) == (13, 27, 141)


@pytest.mark.parametrize("call_us", [250, 700, 1000, 3000])
def test_each_delivery_is_of_the_truth_one_delay_ago(call_us: int) -> None:
    suite = SensorSuite(CALM, 0, EXACT)
    delays_us = {"imu": 0, "mag": 5000, "baro": 15_000, "gps": 100_000}
    seen = dict.fromkeys(delays_us, 0)
    for time_us in range(0, 1_000_000, call_us):
        samples = suite.sample(replace(AT_REST, time_us=time_us))
        for name, delay_us in delays_us.items():
            sample = getattr(samples, name)
            if sample is not None:
                # The newest there was at that time: less than one call older.
                assert 0 <= time_us - delay_us - sample.sampled_us < call_us
                seen[name] += 1
    assert min(seen.values()) >= 8


def test_what_is_measured_belongs_to_the_time_it_is_stamped_with() -> None:
    def moving(time_us: int) -> Truth:
        t = time_us * 1e-6
        return replace(
            AT_REST,
            time_us=time_us,
            position_ned_m=(100.0 * t, -50.0 * t, -20.0 * t),
            q_body_to_ned=level_at_heading(t),
        )

    checked = 0
    for samples in readings(1000, moving, EXACT):
        if samples.baro:
            t = samples.baro.sampled_us * 1e-6
            assert samples.baro.pressure_pa == pytest.approx(pressure_pa(40.0 + 20.0 * t), abs=1e-6)
        if samples.mag:
            t = samples.mag.sampled_us * 1e-6
            x, y, _ = samples.mag.field_ut
            assert math.atan2(-y, x) == pytest.approx(t - MAGNETIC_DECLINATION_RAD, abs=1e-6)
        if samples.gps:
            t = samples.gps.sampled_us * 1e-6
            # One degree of latitude is 111.26 km at 52 deg; GGA's last digit is 0.19 m.
            north_m = (samples.gps.latitude_1e7deg * 1e-7 - 52.0) * 111.26e3
            assert north_m == pytest.approx(100.0 * t, abs=0.11)
            checked += 1
    assert checked == 9


def test_time_that_does_not_advance_is_refused() -> None:
    suite = SensorSuite(CALM, 0)
    suite.sample(replace(AT_REST, time_us=5000))
    with pytest.raises(ValueError, match="truth at 5000 us follows one at 5000 us"):
        suite.sample(replace(AT_REST, time_us=5000))


def test_the_history_stays_bounded() -> None:
    suite = SensorSuite(CALM, 0)
    for time_us in range(0, 2_000_000, 1000):
        suite.sample(replace(AT_REST, time_us=time_us))
    assert len(suite._history) == 101  # GPS's 100 ms, both ends


# --- how well ------------------------------------------------------------------------------


def imu_at_rest(duration_ms: int, constants: SensorConstants, seed: int = 1) -> np.ndarray:
    """Rows of accel and gyro, the first 50 ms (the low-pass filling) left out."""
    rows = [
        samples.imu.accel_m_s2 + samples.imu.gyro_rad_s
        for samples in readings(duration_ms + 50, constants=constants, seed=seed)
        if samples.imu
    ]
    return np.array(rows[50:])


NO_BIAS = replace(
    SPECIFIED, accel_bias_sigma_m_s2=0.0, gyro_bias_sigma_rad_s=0.0, gyro_bias_walk_rad_s_sqrt_s=0.0
)
STILL = np.array([0.0, 0.0, -G, 0.0, 0.0, 0.0])
STEP = np.repeat([G / 1024.0, math.radians(1.0 / 16.4)], 3)
SIGMA = np.repeat([0.028, 0.0031], 3)


def test_imu_noise_has_the_specified_size() -> None:
    # Every 20th: the filter's correlation from sample to sample is 2/3, (2/3)^20 = 3e-4.
    noise = (imu_at_rest(40_000, NO_BIAS) - STILL)[::20]
    variance = SIGMA**2 + STEP**2 / 12.0
    low, high = chi2.ppf(RARE, noise.shape[0])
    for axis_sum in (noise**2 / variance).sum(axis=0):
        assert low < axis_sum < high
    correlation = np.corrcoef(noise.T) - np.eye(6)
    assert np.abs(correlation).max() < 5.0 / math.sqrt(noise.shape[0])


def test_imu_noise_has_the_datasheets_density_at_low_frequency() -> None:
    # sigma^2 over 100 Hz is a one-sided density S; the mean of T = 0.2 s has variance S / 2T.
    means = (imu_at_rest(60_000, NO_BIAS) - STILL).reshape(-1, 200, 6).mean(axis=1)
    variance = SIGMA**2 / 100.0 / (2.0 * 0.2)
    low, high = chi2.ppf(RARE, means.shape[0])
    # 1 % for a mean that starts and ends in the middle of the filter's 2 ms memory.
    for axis_sum in (means**2 / variance).sum(axis=0):
        assert 0.99 * low < axis_sum < 1.01 * high


def test_imu_biases_have_their_size_over_many_starts() -> None:
    constants = replace(EXACT, accel_bias_sigma_m_s2=0.02, gyro_bias_sigma_rad_s=0.01)
    starts = []
    for seed in range(200):
        imu = next(readings(1, constants=constants, seed=seed)).imu
        assert imu is not None
        starts.append(imu.accel_m_s2 + imu.gyro_rad_s)
    bias = (np.array(starts) - STILL) / np.repeat([0.02, 0.01], 3)
    low, high = chi2.ppf(RARE, bias.shape[0])
    for axis_sum in (bias**2).sum(axis=0):
        assert low < axis_sum < high
    assert np.abs(bias.mean(axis=0)).max() < 5.0 / math.sqrt(bias.shape[0])


def test_accelerometer_bias_stays_and_gyro_bias_walks() -> None:
    constants = replace(EXACT, accel_bias_sigma_m_s2=0.02, gyro_bias_walk_rad_s_sqrt_s=3e-5)
    rows = imu_at_rest(30_000, constants)
    assert np.ptp(rows[:, :3], axis=0) == pytest.approx([0, 0, 0], abs=1e-8)
    steps = np.diff(rows[::100, 3:], axis=0)  # over 0.1 s; the filter smooths 2 ms of it
    low, high = chi2.ppf(RARE, steps.size)
    assert 0.97 * low < (steps**2).sum() / (3e-5**2 * 0.1) < high


def test_imu_low_pass_delays_motion_by_2_ms() -> None:
    def speeding_up(time_us: int) -> Truth:
        return replace(AT_REST, time_us=time_us, rate_body_rad_s=(time_us * 1e-6, 0.0, 0.0))

    *_, last = readings(200, speeding_up, EXACT)
    assert last.imu is not None
    # y += k (x - y) with k = 1/3 follows a ramp (1 - k)/k = 2 samples behind.
    assert last.imu.gyro_rad_s[0] == pytest.approx(0.199 - 0.002, abs=1e-8)


def test_magnetometer_and_barometer_noise_have_the_specified_size() -> None:
    mag, baro = [], []
    for samples in readings(60_000, seed=3, call_ms=10):
        if samples.mag:
            mag.append(samples.mag.field_ut)
        if samples.baro:
            baro.append(samples.baro.pressure_pa)
    horizontal = 18.96
    earth = (
        horizontal * math.cos(MAGNETIC_DECLINATION_RAD),
        horizontal * math.sin(MAGNETIC_DECLINATION_RAD),
        46.16,
    )
    mag_chi2 = ((np.array(mag) - earth) ** 2 / (0.3**2 + 0.15**2 / 12.0)).sum(axis=0)
    low, high = chi2.ppf(RARE, len(mag))
    assert all(low < axis_sum < high for axis_sum in mag_chi2)
    noise = np.array(baro) - pressure_pa(40.0)
    low, high = chi2.ppf(RARE, noise.size)
    assert low < (noise**2).sum() / 4.0 < high
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 5.0 / math.sqrt(noise.size)


def test_gps_noise_has_the_specified_size() -> None:
    rows = []
    for samples in readings(120_000, seed=4, call_ms=50):
        if samples.gps:
            g = samples.gps
            speed_m_s, course = g.speed_knots * 0.514444, math.radians(g.course_deg)
            rows.append(
                (
                    (g.latitude_1e7deg * 1e-7 - 52.0) * 111.26e3,
                    (g.longitude_1e7deg * 1e-7 - 13.0) * 68.68e3,  # a degree's length at 52 deg
                    g.altitude_mm * 1e-3 - 40.0,
                    speed_m_s * math.cos(course),
                    speed_m_s * math.sin(course),
                )
            )
    noise = np.array(rows)
    # Resolution: 0.19 m, 0.11 m and 0.1 m, each squared over 12; under 1e-3 of the variance.
    totals = (noise**2 / np.array([3.0, 3.0, 5.0, 0.3, 0.3]) ** 2).sum(axis=0)
    low, high = chi2.ppf(RARE, noise.shape[0])
    assert all(low < total < high for total in totals)
    # White from fix to fix.
    for axis in noise.T:
        assert abs(np.corrcoef(axis[1:], axis[:-1])[0, 1]) < 5.0 / math.sqrt(axis.size)


def test_readings_repeat_with_the_seed_and_differ_without() -> None:
    assert list(readings(300, seed=5)) == list(readings(300, seed=5))
    assert list(readings(300, seed=5)) != list(readings(300, seed=6))


def test_a_faster_gps_leaves_the_other_sensors_readings_alone() -> None:
    fast = replace(SPECIFIED, gps=replace(SPECIFIED.gps, period_us=50_000))
    usual = [replace(samples, gps=None) for samples in readings(500)]
    assert [replace(samples, gps=None) for samples in readings(500, constants=fast)] == usual


# --- what ----------------------------------------------------------------------------------


def test_readings_are_whole_steps_of_the_registers() -> None:
    for samples in readings(100):
        for value, step in zip(
            samples.imu.accel_m_s2 + samples.imu.gyro_rad_s if samples.imu else (),
            STEP,
            strict=True,
        ):
            assert value / step == pytest.approx(round(value / step), abs=1e-6)
        for value in samples.mag.field_ut if samples.mag else ():
            assert value / 0.15 == pytest.approx(round(value / 0.15), abs=1e-6)
        if samples.baro:
            steps = samples.baro.pressure_pa / 0.016
            assert steps == pytest.approx(round(steps), abs=1e-3)


def test_the_imu_saturates_at_its_range() -> None:
    def violent(time_us: int) -> Truth:
        return replace(
            AT_REST,
            time_us=time_us,
            specific_force_body_m_s2=(500.0, -500.0, 0.0),
            rate_body_rad_s=(50.0, -50.0, 0.0),
        )

    imu = next(readings(1, violent)).imu
    assert imu is not None
    # Half a register step either way.
    assert imu.accel_m_s2[:2] == pytest.approx((30 * G, -30 * G), abs=0.005)
    limit = math.radians(2000.0)
    assert imu.gyro_rad_s[:2] == pytest.approx((limit, -limit), abs=6e-4)


def field_facing(
    heading_rad: float,
    mounting: Matrix = IDENTITY,
    surroundings: Surroundings = CALM,
    load: float = 0.0,
) -> tuple[float, float, float]:
    suite = SensorSuite(surroundings, 0, EXACT, mounting)
    truth = replace(AT_REST, q_body_to_ned=level_at_heading(heading_rad), thrust_to_weight=load)
    for time_us in range(0, 14_000, 1000):
        mag = suite.sample(replace(truth, time_us=time_us)).mag
    assert mag is not None
    return mag.field_ut


def test_facing_magnetic_north_the_field_has_no_part_to_the_right() -> None:
    # Declination east: magnetic north is to the right of true north.
    assert field_facing(math.radians(4.92)) == pytest.approx((18.96, 0.0, 46.16), abs=1e-8)
    assert field_facing(0.0)[1] > 1.0
    # Facing east, north is on the left: negative y.
    assert field_facing(math.radians(94.92)) == pytest.approx((0.0, -18.96, 46.16), abs=1e-8)


def test_the_mounting_turns_the_field_into_the_sensors_axes() -> None:
    x, y, z = field_facing(1.0)
    left_handed: Matrix = ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert field_facing(1.0, left_handed) == pytest.approx((y, x, z), abs=1e-8)
    cycle: Matrix = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0))
    assert field_facing(1.0, cycle) == pytest.approx((y, z, -x), abs=1e-8)


def test_motor_currents_disturb_the_field_with_the_thrust_and_only_if_asked() -> None:
    clean = np.array(field_facing(1.0))
    np.testing.assert_allclose(field_facing(1.0, load=1.5), clean, atol=1e-8)
    np.testing.assert_allclose(field_facing(1.0, surroundings=MAGNETIC), clean, atol=1e-8)
    disturbed = np.array(field_facing(1.0, surroundings=MAGNETIC, load=1.5))
    np.testing.assert_allclose(disturbed - clean, 1.5 * np.array([3.0, -2.0, 3.5]), atol=1e-8)


@pytest.mark.parametrize(
    ("north", "east", "course_deg"),
    [(3.0, 4.0, 53.13), (-3.0, 4.0, 126.87), (3.0, -4.0, 306.87), (5.0, -1e-6, 0.0)],
)
def test_gps_speed_is_in_knots_and_course_clockwise_from_north(
    north: float, east: float, course_deg: float
) -> None:
    def moving(time_us: int) -> Truth:
        return replace(AT_REST, time_us=time_us, velocity_ned_m_s=(north, east, 1.0))

    gps = [samples.gps for samples in readings(142, moving, EXACT) if samples.gps][-1]
    assert gps.speed_knots == 9.72  # 5 m/s
    assert gps.course_deg == course_deg
    assert (gps.fix, gps.satellites, gps.hdop) == (3, 9, 1.0)
