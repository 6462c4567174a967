"""What goes wrong in flight: each fault begins at a time and lasts for a while, or for ever.

Faults of sensors change what the flight software is handed; the others act on the aircraft, the air
or the board. Sizes and times are those of such devices where a comment says so, else ours: large
enough to be dangerous, small enough to be met.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Protocol

from strix.plant.earth import (
    HOME_ALTITUDE_M,
    HOME_LATITUDE_DEG,
    HOME_LONGITUDE_DEG,
    geodetic_from_ned,
)
from strix.plant.frames import Vector
from strix.plant.plant import Plant
from strix.plant.samples import BaroSample, GpsSample, ImuSample, MagSample, Samples

EVER = math.inf
_KNOT_M_S = 1852.0 / 3600.0


class Sensor(StrEnum):
    """Named as the fields of Samples."""

    IMU = "imu"
    MAG = "mag"
    BARO = "baro"
    GPS = "gps"


Reading = ImuSample | MagSample | BaroSample | GpsSample


class Aircraft(Protocol):
    """What a fault can reach besides the sensors."""

    plant: Plant

    def stall_card(self, stalled: bool) -> None: ...
    def kill_card(self) -> None: ...
    def silence_radio(self, silent: bool, failsafe: bool) -> None: ...
    def restart(self) -> None: ...
    def switch_kill(self) -> None: ...


@dataclass
class Fault:
    """Nothing goes wrong. The others change one of the three."""

    at_s: float
    duration_s: float = EVER

    def active(self, time_s: float) -> bool:
        return self.at_s <= time_s < self.at_s + self.duration_s

    def begin(self, aircraft: Aircraft) -> None:
        """Called once."""

    def end(self, aircraft: Aircraft) -> None:
        """Called once, if it ends."""

    def spoil(self, samples: Samples, time_s: float) -> Samples:
        """What the flight software gets of what the sensors gave; called every step."""
        del time_s
        return samples


@dataclass
class SensorFault(Fault):
    """Of one sensor."""

    sensor: Sensor = Sensor.IMU

    def spoil(self, samples: Samples, time_s: float) -> Samples:
        reading = getattr(samples, self.sensor)
        if not self.active(time_s):
            return self._quiet(samples, reading)
        found = self._spoilt(reading, time_s)
        return samples if found is reading else _with(samples, self.sensor, found)

    def _quiet(self, samples: Samples, reading: Reading | None) -> Samples:
        del reading
        return samples

    def _spoilt(self, reading: Reading | None, time_s: float) -> Reading | None:
        raise NotImplementedError


@dataclass
class Dropout(SensorFault):
    """Silent."""

    def _spoilt(self, reading: Reading | None, time_s: float) -> Reading | None:
        del reading, time_s
        return None


# The drivers of IMU, magnetometer and altimeter give ten equal readings in a row and no more
# (kStuckAfter in ICM20649Samples.h, MagLis2mdl.h, BaroBmp390.h); a GPS receiver may well repeat.
_REPEATS_GIVEN = {Sensor.IMU: 10, Sensor.MAG: 10, Sensor.BARO: 10}


@dataclass
class Freeze(SensorFault):
    """The registers keep their last reading, which is read with fresh time stamps."""

    def __post_init__(self) -> None:
        self._last: Reading | None = None
        self._given = 0

    def _quiet(self, samples: Samples, reading: Reading | None) -> Samples:
        self._last = reading or self._last
        self._given = 0
        return samples

    def _spoilt(self, reading: Reading | None, time_s: float) -> Reading | None:
        del time_s
        if reading is None or self._last is None:
            return reading
        self._given += 1
        if self._given >= _REPEATS_GIVEN.get(self.sensor, math.inf):
            return None
        return replace(self._last, sampled_us=reading.sampled_us)


@dataclass
class Delay(SensorFault):
    """Readings come later, stamped as their drivers do."""

    by_s: float = 0.0

    def __post_init__(self) -> None:
        self._waiting: deque[tuple[float, Reading]] = deque()

    def _quiet(self, samples: Samples, reading: Reading | None) -> Samples:
        self._waiting.clear()  # what was on its way is overtaken
        del reading
        return samples

    def _spoilt(self, reading: Reading | None, time_s: float) -> Reading | None:
        if reading is not None:
            self._waiting.append((time_s + self.by_s, reading))
        if not self._waiting or time_s < self._waiting[0][0] - 1e-9:
            return None
        late = self._waiting.popleft()[1]
        if self.sensor is Sensor.IMU:  # its data-ready edge has the time of the measurement
            return late
        return replace(late, sampled_us=late.sampled_us + round(self.by_s * 1e6))


Change = Callable[[Any, float], Any]  # a reading, and by how much


def turned(reading: ImuSample, rad_s: float) -> ImuSample:
    """The same on each axis of the gyro."""
    p, q, r = reading.gyro_rad_s
    return replace(reading, gyro_rad_s=(p + rad_s, q + rad_s, r + rad_s))


def pushed(reading: ImuSample, m_s2: float) -> ImuSample:
    x, y, z = reading.accel_m_s2
    return replace(reading, accel_m_s2=(x + m_s2, y + m_s2, z + m_s2))


def garbled(reading: ImuSample, share: float) -> ImuSample:
    """A bit that flipped on the bus: every axis at this share of its range."""
    accel, gyro = 30.0 * 9.80665 * share, math.radians(2000.0) * share
    return ImuSample(reading.sampled_us, (accel,) * 3, (gyro,) * 3)


def magnetised(reading: MagSample, ut: float) -> MagSample:
    x, y, z = reading.field_ut
    return replace(reading, field_ut=(x + ut, y + ut, z + ut))


def pressed(reading: BaroSample, pa: float) -> BaroSample:
    return replace(reading, pressure_pa=reading.pressure_pa + pa)


def moved(reading: GpsSample, ned_m: Vector, velocity_m_s: tuple[float, float]) -> GpsSample:
    """Another place, and another velocity on top."""
    latitude_deg, longitude_deg, altitude_m = geodetic_from_ned(ned_m)
    course = math.radians(reading.course_deg)
    vn = reading.speed_knots * _KNOT_M_S * math.cos(course) + velocity_m_s[0]
    ve = reading.speed_knots * _KNOT_M_S * math.sin(course) + velocity_m_s[1]
    return replace(
        reading,
        latitude_1e7deg=reading.latitude_1e7deg + round(1e7 * (latitude_deg - HOME_LATITUDE_DEG)),
        longitude_1e7deg=reading.longitude_1e7deg
        + round(1e7 * (longitude_deg - HOME_LONGITUDE_DEG)),
        altitude_mm=reading.altitude_mm + round(1e3 * (altitude_m - HOME_ALTITUDE_M)),
        speed_knots=round(math.hypot(vn, ve) / _KNOT_M_S, 2),
        course_deg=round(math.degrees(math.atan2(ve, vn)) % 360.0, 2) % 360.0,
    )


def displaced(reading: GpsSample, east_m: float) -> GpsSample:
    """Multipath moves the place and leaves the Doppler velocity."""
    return moved(reading, (0.0, east_m, 0.0), (0.0, 0.0))


@dataclass
class Spike(SensorFault):
    """One reading in `every` is off, from the first on."""

    change: Change = garbled
    size: float = 1.0
    every: int = 1

    def __post_init__(self) -> None:
        self._count = 0

    def _spoilt(self, reading: Reading | None, time_s: float) -> Reading | None:
        del time_s
        if reading is None:
            return None
        self._count += 1
        if (self._count - 1) % self.every:
            return reading
        return self.change(reading, self.size)  # type: ignore[no-any-return]


@dataclass
class Drift(SensorFault):
    """The bias grows at a rate, up to its most."""

    change: Change = turned
    rate: float = 0.0  # per s
    most: float = 0.0

    def _spoilt(self, reading: Reading | None, time_s: float) -> Reading | None:
        if reading is None:
            return None
        off = min(abs(self.rate) * (time_s - self.at_s), self.most)
        return self.change(reading, math.copysign(off, self.rate))  # type: ignore[no-any-return]


@dataclass
class PullAway(SensorFault):
    """GPS walks away with a velocity that its own velocity shows, up to a distance."""

    sensor: Sensor = Sensor.GPS
    velocity_m_s: tuple[float, float] = (0.0, 0.0)
    most_m: float = 0.0

    def _spoilt(self, reading: Reading | None, time_s: float) -> Reading | None:
        if not isinstance(reading, GpsSample):
            return None
        north, east = self.velocity_m_s
        speed = math.hypot(north, east)
        walks_s = self.most_m / speed
        gone_s = min(time_s - self.at_s, walks_s)
        going = self.velocity_m_s if gone_s < walks_s else (0.0, 0.0)
        return moved(reading, (north * gone_s, east * gone_s, 0.0), going)


@dataclass
class Jump(SensorFault):
    """GPS says another place from one fix to the next, with the velocity as it is."""

    sensor: Sensor = Sensor.GPS
    by_ned_m: Vector = (0.0, 0.0, 0.0)

    def _spoilt(self, reading: Reading | None, time_s: float) -> Reading | None:
        del time_s
        return moved(reading, self.by_ned_m, (0.0, 0.0)) if isinstance(reading, GpsSample) else None


@dataclass
class SlowBusDown(Fault):
    """Magnetometer and altimeter are on one bus."""

    def spoil(self, samples: Samples, time_s: float) -> Samples:
        return replace(samples, mag=None, baro=None) if self.active(time_s) else samples


@dataclass
class CardStall(Fault):
    """The log card takes no sector."""

    def begin(self, aircraft: Aircraft) -> None:
        aircraft.stall_card(True)

    def end(self, aircraft: Aircraft) -> None:
        aircraft.stall_card(False)


@dataclass
class CardDeath(Fault):
    """The log card fails whatever it is asked."""

    def begin(self, aircraft: Aircraft) -> None:
        aircraft.kill_card()


@dataclass
class RadioLoss(Fault):
    """The receiver hears no transmitter: it is silent, or says so."""

    failsafe: bool = False

    def begin(self, aircraft: Aircraft) -> None:
        aircraft.silence_radio(True, self.failsafe)

    def end(self, aircraft: Aircraft) -> None:
        aircraft.silence_radio(False, self.failsafe)


@dataclass
class RotorFault(Fault):
    """One rotor gives a share of what it should."""

    rotor: int = 0  # M1
    strength: float = 0.0

    def begin(self, aircraft: Aircraft) -> None:
        aircraft.plant.weaken_rotor(self.rotor, self.strength)

    def end(self, aircraft: Aircraft) -> None:
        aircraft.plant.weaken_rotor(self.rotor, 1.0)


@dataclass
class WindStep(Fault):
    """Wind sets in, with gusts."""

    mean_ned_m_s: Vector = (0.0, 0.0, 0.0)

    def begin(self, aircraft: Aircraft) -> None:
        aircraft.plant.blow(self.mean_ned_m_s)


@dataclass
class BatterySag(Fault):
    """The battery is emptier than anybody thought."""

    charge: float = 0.0

    def begin(self, aircraft: Aircraft) -> None:
        aircraft.plant.drain_battery(self.charge)


@dataclass
class BrownOut(Fault):
    """The processor loses its voltage and starts anew; the motors get no pulse meanwhile."""

    def begin(self, aircraft: Aircraft) -> None:
        aircraft.restart()


@dataclass
class KillSwitch(Fault):
    """The pilot stops the motors."""

    def begin(self, aircraft: Aircraft) -> None:
        aircraft.switch_kill()


def _with(samples: Samples, sensor: Sensor, reading: Reading | None) -> Samples:
    changed: dict[str, Any] = {sensor.value: reading}
    return replace(samples, **changed)
