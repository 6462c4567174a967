"""The sensors: truth in, what their registers and sentences would say out.

Each device has its own rate, phase, delay, noise and resolution. A reading delivered at time t
is of the truth at t - delay, and carries that time as sampled_us.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from strix.plant.earth import (
    HOME_ALTITUDE_M,
    MAGNETIC_FIELD_NED_UT,
    geodetic_from_ned,
    pressure_pa,
    temperature_degc,
)
from strix.plant.frames import IDENTITY, Matrix, Vector, rotate_to_body
from strix.plant.noise import normal_stream
from strix.plant.plant import Truth
from strix.plant.samples import (
    BaroSample,
    BatterySample,
    EscSample,
    GpsSample,
    ImuSample,
    MagSample,
    Samples,
)
from strix.plant.surroundings import Surroundings
from strix.plant.vehicle import STANDARD_GRAVITY_M_S2

_ACCEL_STREAM, _GYRO_STREAM, _MAG_STREAM, _BARO_STREAM, _GPS_STREAM = 1, 2, 3, 4, 5
_BATTERY_STREAM = 6
_KNOTS_PER_M_S = 3600.0 / 1852.0


@dataclass(frozen=True)
class Device:
    """When a sensor delivers, and how old its reading is then."""

    period_us: int
    phase_us: int  # first delivery; devices do not start together
    delay_us: int


@dataclass(frozen=True)
class SensorConstants:
    """One sigma values are DESIGN.md section 5's unless a comment says otherwise."""

    # ICM20649. Noise bandwidth 100 Hz of its digital low-pass, here a first-order one: it filters
    # the motion too, and delays it by 2 ms. That is the delay; the burst read adds none.
    imu: Device = Device(period_us=1000, phase_us=0, delay_us=0)
    imu_noise_bandwidth_hz: float = 100.0
    accel_sigma_m_s2: float = 0.028  # 285 ug/sqrt(Hz) (datasheet) over 100 Hz
    gyro_sigma_rad_s: float = 0.0031  # 0.0175 (deg/s)/sqrt(Hz) (datasheet) over 100 Hz
    # What is left after the six-sided calibration: 2 mg. (Datasheet, as delivered: 65 mg.)
    accel_bias_sigma_m_s2: float = 0.02
    # At power-up; the start-up calibration removes it. (Datasheet, as delivered: 5 deg/s.)
    gyro_bias_sigma_rad_s: float = 0.01
    gyro_bias_walk_rad_s_sqrt_s: float = 3e-5  # our choice: 0.013 deg/s after 60 s
    accel_lsb_m_s2: float = STANDARD_GRAVITY_M_S2 / 1024.0  # range +-30 g
    accel_range_m_s2: float = 30.0 * STANDARD_GRAVITY_M_S2
    gyro_lsb_rad_s: float = math.radians(1.0 / 16.4)  # range +-2000 deg/s
    gyro_range_rad_s: float = math.radians(2000.0)

    # LIS2MDL. It averages over its 10 ms period, so a reading is 5 ms old.
    mag: Device = Device(period_us=10_000, phase_us=3_000, delay_us=5_000)
    mag_sigma_ut: float = 0.3
    mag_lsb_ut: float = 0.15
    mag_range_ut: float = 4915.2  # +-49.152 gauss

    # BMP390, pressure 8x and temperature 1x oversampled: a conversion takes 19 ms (datasheet
    # 3.9.2), so its middle is 10 ms old when it is ready; read up to 10 ms later, 5 on average.
    baro: Device = Device(period_us=20_000, phase_us=7_000, delay_us=15_000)
    baro_sigma_pa: float = 2.0
    baro_lsb_pa: float = 0.016
    baro_range_pa: float = 125_000.0

    # MTK3333. ArduPilot assumes 0.1 s for a receiver it knows nothing of (its PR 19656).
    gps: Device = Device(period_us=100_000, phase_us=41_000, delay_us=100_000)
    gps_position_sigma_m: float = 3.0  # north and east, white from fix to fix
    gps_altitude_sigma_m: float = 5.0  # our choice: vertical dilution is 1.5 to 2 times as large
    gps_velocity_sigma_m_s: float = 0.3  # north and east
    gps_satellites: int = 9
    gps_hdop: float = 1.0

    # Battery monitor: a divider to 3.3 V full scale at 12 bits, and a shunt; noise and steps ours.
    battery: Device = Device(period_us=100_000, phase_us=59_000, delay_us=0)
    battery_sigma_v: float = 0.02  # the motors' ripple, behind a capacitor
    battery_lsb_v: float = 0.01  # 36 V / 4096, rounded up
    battery_sigma_a: float = 0.2
    battery_lsb_a: float = 0.03  # 120 A / 4096

    # ESCs that answer, as SimonK's do over I2C: commutations since they were asked before, six for
    # each of 7 pole pairs in a turn; voltage in steps of 5 V x 6.45 / 1024 (10 bits).
    esc: Device = Device(period_us=200_000, phase_us=83_000, delay_us=0)
    esc_counts_per_turn: int = 42
    esc_lsb_v: float = 5.0 * 6.45 / 1024.0


DEFAULT_CONSTANTS = SensorConstants()


class _Channel:
    """One axis: bias and its walk, white noise, first-order low-pass, range, resolution."""

    def __init__(
        self,
        draw: Callable[[], float],
        sigma: float,
        lsb: float,
        limit: float,
        *,
        bandwidth_of_nyquist: float = 1.0,  # noise bandwidth over half the sampling rate
        bias: float = 0.0,
        walk: float = 0.0,  # one sigma a sample
    ) -> None:
        self._draw = draw
        self._lsb = lsb
        self._limit = limit
        self._bias = bias
        self._walk = walk
        # y += k (x - y) passes white noise with the variance k / (2 - k), which is also its noise
        # bandwidth as a part of Nyquist's. So k = 2 b / (1 + b), and the noise going in is
        # larger than the one wanted going out by 1 / sqrt(b).
        self._gain = 2.0 * bandwidth_of_nyquist / (1.0 + bandwidth_of_nyquist)
        self._sigma_in = sigma / math.sqrt(bandwidth_of_nyquist)
        self._output: float | None = None

    def read(self, true: float) -> float:
        draw = self._draw
        if self._walk:
            self._bias += self._walk * draw()
        value = true + self._bias
        output = value if self._output is None else self._output
        output += self._gain * (value + self._sigma_in * draw() - output)
        self._output = output
        return round(min(max(output, -self._limit), self._limit) / self._lsb) * self._lsb


class _Clock:
    """Says when a device delivers, keeping its phase."""

    def __init__(self, device: Device) -> None:
        self._period_us = device.period_us
        self._next_us = device.phase_us

    def due(self, now_us: int) -> bool:
        if now_us < self._next_us:
            return False
        self._next_us += ((now_us - self._next_us) // self._period_us + 1) * self._period_us
        return True


class SensorSuite:
    """Call sample() with every new truth, at least once a millisecond.

    mag_mounting turns body axes into the magnetometer's own: row i is the sensor's axis i. The
    LIS2MDL's axes are left-handed, so the real matrix has determinant -1. The battery is measured
    when the surroundings have one; escs_answer is the vehicle's.
    """

    def __init__(
        self,
        surroundings: Surroundings,
        seed: int,
        constants: SensorConstants = DEFAULT_CONSTANTS,
        mag_mounting: Matrix = IDENTITY,
        escs_answer: bool = False,
    ) -> None:
        self._constants = c = constants
        self._motor_field_ut = surroundings.motor_field_at_hover_ut
        self._vibration = surroundings.vibration_at_hover_m_s2
        self._rectified = surroundings.rectified_at_hover_m_s2
        self._shaken = any(self._vibration) or any(self._rectified)
        self._mag_mounting = mag_mounting

        accel, gyro = normal_stream(seed, _ACCEL_STREAM), normal_stream(seed, _GYRO_STREAM)
        mag, baro = normal_stream(seed, _MAG_STREAM), normal_stream(seed, _BARO_STREAM)
        self._gps_draw = normal_stream(seed, _GPS_STREAM)
        imu_period_s = c.imu.period_us * 1e-6
        imu_bandwidth = c.imu_noise_bandwidth_hz * 2.0 * imu_period_s
        self._accel = [
            _Channel(
                accel,
                c.accel_sigma_m_s2,
                c.accel_lsb_m_s2,
                c.accel_range_m_s2,
                bandwidth_of_nyquist=imu_bandwidth,
                bias=c.accel_bias_sigma_m_s2 * accel(),
            )
            for _ in range(3)
        ]
        self._gyro = [
            _Channel(
                gyro,
                c.gyro_sigma_rad_s,
                c.gyro_lsb_rad_s,
                c.gyro_range_rad_s,
                bandwidth_of_nyquist=imu_bandwidth,
                bias=c.gyro_bias_sigma_rad_s * gyro(),
                walk=c.gyro_bias_walk_rad_s_sqrt_s * math.sqrt(imu_period_s),
            )
            for _ in range(3)
        ]
        self._mag = [_Channel(mag, c.mag_sigma_ut, c.mag_lsb_ut, c.mag_range_ut) for _ in range(3)]
        self._baro = _Channel(baro, c.baro_sigma_pa, c.baro_lsb_pa, c.baro_range_pa)

        self._imu_clock, self._mag_clock = _Clock(c.imu), _Clock(c.mag)
        self._baro_clock = _Clock(c.baro)
        self._gps_clock = None if surroundings.roof else _Clock(c.gps)
        self._battery_clock = None if surroundings.battery is None else _Clock(c.battery)
        self._battery_draw = normal_stream(seed, _BATTERY_STREAM)
        self._esc_clock = _Clock(c.esc) if escs_answer else None
        self._esc_before: Truth | None = None
        self._history: deque[Truth] = deque()
        self._longest_delay_us = max(d.delay_us for d in (c.imu, c.mag, c.baro, c.gps))

    def sample(self, truth: Truth) -> Samples:
        now_us = truth.time_us
        history = self._history
        if history and now_us <= history[-1].time_us:
            raise ValueError(f"truth at {now_us} us follows one at {history[-1].time_us} us")
        history.append(truth)
        while len(history) > 1 and history[1].time_us <= now_us - self._longest_delay_us:
            history.popleft()

        c = self._constants
        imu = self._ready(c.imu, self._imu_clock, now_us)
        mag = self._ready(c.mag, self._mag_clock, now_us)
        baro = self._ready(c.baro, self._baro_clock, now_us)
        gps = self._ready(c.gps, self._gps_clock, now_us)
        return Samples(
            imu=None if imu is None else self._read_imu(imu),
            mag=None if mag is None else self._read_mag(mag),
            baro=None if baro is None else self._read_baro(baro),
            gps=None if gps is None else self._read_gps(gps),
            battery=None if self._battery_clock is None else self._read_battery(truth),
            esc=None if self._esc_clock is None else self._read_escs(truth),
        )

    def _ready(self, device: Device, clock: _Clock | None, now_us: int) -> Truth | None:
        """The truth a device delivers now: the last at or before now - delay.

        None between deliveries, and while nothing was there to be measured yet.
        """
        if clock is None or not clock.due(now_us):
            return None
        wanted_us = now_us - device.delay_us
        for truth in reversed(self._history):
            if truth.time_us <= wanted_us:
                return truth
        return None

    def _read_imu(self, truth: Truth) -> ImuSample:
        fx, fy, fz = truth.specific_force_body_m_s2
        if self._shaken:
            dx, dy, dz = self._motors_shake(truth)
            fx, fy, fz = fx + dx, fy + dy, fz + dz
        p, q, r = truth.rate_body_rad_s
        ax, ay, az = self._accel
        gx, gy, gz = self._gyro
        return ImuSample(
            truth.time_us,
            (ax.read(fx), ay.read(fy), az.read(fz)),
            (gx.read(p), gy.read(q), gz.read(r)),
        )

    def _motors_shake(self, truth: Truth) -> Vector:
        """What the motors add to the specific force, body FRD.

        The vibration is that of the instant, so what is faster than half the sampling rate is
        aliased, as it is in a sensor without a filter before its converter.
        """
        load = truth.thrust_to_weight
        shake = 0.25 * load * sum(math.sin(2.0 * math.pi * t) for t in truth.rotor_turns)
        vx, vy, vz = self._vibration
        bx, by, bz = self._rectified
        return (vx * shake + bx * load, vy * shake + by * load, vz * shake + bz * load)

    def _read_mag(self, truth: Truth) -> MagSample:
        earth = rotate_to_body(truth.q_body_to_ned, MAGNETIC_FIELD_NED_UT)
        motors = truth.thrust_to_weight
        x, y, z = (e + motors * m for e, m in zip(earth, self._motor_field_ut, strict=True))
        a, b, c = (
            channel.read(row[0] * x + row[1] * y + row[2] * z)
            for channel, row in zip(self._mag, self._mag_mounting, strict=True)
        )
        return MagSample(truth.time_us, (a, b, c))

    def _read_baro(self, truth: Truth) -> BaroSample:
        altitude_m = HOME_ALTITUDE_M - truth.position_ned_m[2]
        return BaroSample(
            truth.time_us,
            self._baro.read(pressure_pa(altitude_m)),
            temperature_degc(altitude_m),
        )

    def _read_gps(self, truth: Truth) -> GpsSample:
        c, draw = self._constants, self._gps_draw
        n, e, d = truth.position_ned_m
        vn, ve, _ = truth.velocity_ned_m_s
        latitude_deg, longitude_deg, altitude_m = geodetic_from_ned(
            (
                n + c.gps_position_sigma_m * draw(),
                e + c.gps_position_sigma_m * draw(),
                d + c.gps_altitude_sigma_m * draw(),
            )
        )
        vn += c.gps_velocity_sigma_m_s * draw()
        ve += c.gps_velocity_sigma_m_s * draw()
        return GpsSample(
            sampled_us=truth.time_us,
            latitude_1e7deg=_nmea_angle(latitude_deg),
            longitude_1e7deg=_nmea_angle(longitude_deg),
            altitude_mm=100 * round(altitude_m * 10.0),  # 0.1 m
            speed_knots=round(math.hypot(vn, ve) * _KNOTS_PER_M_S, 2),
            course_deg=round(math.degrees(math.atan2(ve, vn)) % 360.0, 2) % 360.0,
            fix=3,
            satellites=c.gps_satellites,
            hdop=c.gps_hdop,
        )

    def _read_battery(self, truth: Truth) -> BatterySample | None:
        if self._battery_clock is None or not self._battery_clock.due(truth.time_us):
            return None
        c, draw = self._constants, self._battery_draw
        voltage_v = truth.battery_v + c.battery_sigma_v * draw()
        current_a = truth.battery_a + c.battery_sigma_a * draw()
        return BatterySample(
            truth.time_us,
            round(voltage_v / c.battery_lsb_v) * c.battery_lsb_v,
            round(current_a / c.battery_lsb_a) * c.battery_lsb_a,
        )

    def _read_escs(self, truth: Truth) -> EscSample | None:
        if self._esc_clock is None or not self._esc_clock.due(truth.time_us):
            return None
        before, self._esc_before = self._esc_before, truth
        if before is None:
            return None
        counts = self._constants.esc_counts_per_turn
        period_s = (truth.time_us - before.time_us) * 1e-6
        r1, r2, r3, r4 = (
            (int(now * counts) - int(then * counts)) / (counts * period_s)
            for now, then in zip(truth.rotor_turns, before.rotor_turns, strict=True)
        )
        volts = round(truth.battery_v / self._constants.esc_lsb_v) * self._constants.esc_lsb_v
        return EscSample(truth.time_us, (r1, r2, r3, r4), (volts, volts, volts, volts))


def _nmea_angle(angle_deg: float) -> int:
    """1e-7 deg, in steps of the 1e-4 arc minutes (0.19 m) that GGA and RMC carry."""
    return round(round(angle_deg * 60e4) * 1e7 / 60e4)
