"""What the simulated sensors deliver."""

from __future__ import annotations

from dataclasses import dataclass

from strix.plant.frames import Vector


@dataclass(frozen=True, slots=True)
class ImuSample:
    sampled_us: int
    accel_m_s2: Vector  # specific force, body FRD
    gyro_rad_s: Vector  # body FRD


@dataclass(frozen=True, slots=True)
class MagSample:
    sampled_us: int
    field_ut: Vector  # in the sensor's own axes


@dataclass(frozen=True, slots=True)
class BaroSample:
    sampled_us: int
    pressure_pa: float
    temperature_degc: float


@dataclass(frozen=True, slots=True)
class GpsSample:
    """What GGA and RMC carry, in their resolution."""

    sampled_us: int
    latitude_1e7deg: int
    longitude_1e7deg: int
    altitude_mm: int  # above mean sea level
    speed_knots: float
    course_deg: float  # over ground from true north, clockwise, 0 to below 360
    fix: int  # 0 none, 2 or 3 dimensions
    satellites: int
    hdop: float


@dataclass(frozen=True, slots=True)
class BatterySample:
    sampled_us: int
    voltage_v: float
    current_a: float


@dataclass(frozen=True, slots=True)
class EscSample:
    """M1..M4."""

    sampled_us: int
    rev_s: tuple[float, float, float, float]  # mean since the sample before
    voltage_v: tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Samples:
    """What became ready since the last call."""

    imu: ImuSample | None = None
    mag: MagSample | None = None
    baro: BaroSample | None = None
    gps: GpsSample | None = None
    battery: BatterySample | None = None
    esc: EscSample | None = None
