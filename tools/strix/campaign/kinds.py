"""The faults of the campaign by name, and how each is drawn.

Where a size is a device's own, its comment cites it. Else it is ours: from what is just seen to
what such a device is known to do at its worst. Times run from one that the flight software has to
bridge to for ever.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from numpy.random import Generator

from strix.plant.faults import (
    EVER,
    BatterySag,
    BrownOut,
    CardDeath,
    CardStall,
    Change,
    Delay,
    Drift,
    Dropout,
    Fault,
    Freeze,
    Jump,
    KillSwitch,
    PullAway,
    RadioLoss,
    RotorFault,
    Sensor,
    SlowBusDown,
    Spike,
    WindStep,
    displaced,
    garbled,
    magnetised,
    pressed,
    pushed,
    turned,
)

Draw = Callable[[Generator, float], tuple[Fault, str]]  # when it begins, s; in words


@dataclass(frozen=True)
class Kind:
    """One fault by name. Where it cuts the motors by what it is, the fall is not judged."""

    name: str
    draw: Draw
    cuts_motors: bool = False
    by_radio: bool = False  # needs a pilot with a transmitter


# Sensors by the names that the documentation has. For each: how long a dropout may be bridged and
# then not; what a wild reading adds; how its bias drifts, and how far; how late it may be, s.
@dataclass(frozen=True)
class _Device:
    sensor: Sensor
    dropouts_s: tuple[float, ...]
    wild: Change
    wild_sizes: tuple[float, float]
    wild_unit: str
    wild_every: tuple[int, int]
    wild_s: float  # of a train
    late_s: tuple[float, float]


_DEVICES = {
    "imu": _Device(
        Sensor.IMU,
        # 15 ms: within the flight software's patience of 20 ms. 50 ms: between two tries to free a
        # bus (docs/board.md).
        (0.015, 0.05, 0.3, EVER),
        garbled,
        (0.1, 1.0),  # of its range, all six axes
        "of the range",
        (10, 50),
        2.0,
        (0.002, 0.01),  # an ICM20649's FIFO holds 32 samples
    ),
    "mag": _Device(
        Sensor.MAG,
        (0.4, 1.5, EVER),
        magnetised,
        (-200.0, 200.0),  # four times the earth's field
        "uT",
        (2, 10),
        10.0,
        (0.1, 0.5),
    ),
    "alt": _Device(
        Sensor.BARO,
        (0.4, 0.8, EVER),
        pressed,
        (-500.0, 500.0),  # 40 m either way
        "Pa",
        (2, 10),
        10.0,
        (0.1, 0.5),
    ),
    "gps": _Device(
        Sensor.GPS,
        (0.9, 2.5, EVER),
        displaced,
        (-100.0, 100.0),
        "m to the east",
        (2, 10),
        10.0,
        (0.2, 1.0),
    ),
}


def _time(rng: Generator, choices: tuple[float, ...]) -> float:
    return choices[int(rng.integers(len(choices)))]


def _lasting(duration_s: float) -> str:
    return "for ever" if math.isinf(duration_s) else f"for {duration_s:g} s"


def _freeze(name: str) -> Draw:
    device = _DEVICES[name]

    def draw(rng: Generator, at_s: float) -> tuple[Fault, str]:
        duration_s = _time(rng, device.dropouts_s[-2:])
        return Freeze(at_s, duration_s, device.sensor), f"{name} repeats {_lasting(duration_s)}"

    return draw


def _dropout(name: str) -> Draw:
    device = _DEVICES[name]

    def draw(rng: Generator, at_s: float) -> tuple[Fault, str]:
        duration_s = _time(rng, device.dropouts_s)
        return Dropout(at_s, duration_s, device.sensor), f"{name} silent {_lasting(duration_s)}"

    return draw


def _spike(name: str) -> Draw:
    device = _DEVICES[name]

    def draw(rng: Generator, at_s: float) -> tuple[Fault, str]:
        size = float(rng.uniform(*device.wild_sizes))
        every = int(rng.integers(*device.wild_every, endpoint=True))
        off = f"{size:+.2g} {device.wild_unit}"
        if rng.random() < 0.5:
            period_s = {"imu": 0.001, "mag": 0.01, "alt": 0.02, "gps": 0.1}[name]
            alone = Spike(at_s, period_s, device.sensor, device.wild, size)
            return alone, f"{name} once off by {off}"
        train = Spike(at_s, device.wild_s, device.sensor, device.wild, size, every)
        return train, f"{name} off by {off}, one in {every} {_lasting(device.wild_s)}"

    return draw


def _delay(name: str) -> Draw:
    device = _DEVICES[name]

    def draw(rng: Generator, at_s: float) -> tuple[Fault, str]:
        by_s = round(float(rng.uniform(*device.late_s)), 3)
        duration_s = _time(rng, (3.0, EVER))
        words = f"{name} {by_s:g} s late {_lasting(duration_s)}"
        return Delay(at_s, duration_s, device.sensor, by_s), words

    return draw


def _imu_drift(rng: Generator, at_s: float) -> tuple[Fault, str]:
    sign = 1.0 if rng.random() < 0.5 else -1.0
    if rng.random() < 0.5:
        # To the data sheet's zero-rate tolerance of +-5 deg/s, in 10 to 50 s.
        rate = sign * float(rng.uniform(0.1, 0.5))
        words = f"gyro drifts by {rate:+.2f} deg/s each second, to 5 deg/s"
        drift = Drift(at_s, EVER, Sensor.IMU, turned, math.radians(rate), math.radians(5.0))
        return drift, words
    # To the data sheet's zero-g tolerance of 65 mg.
    rate = sign * float(rng.uniform(0.02, 0.1))
    words = f"accelerometer drifts by {rate:+.3f} m/s^2 each second, to 0.64"
    return Drift(at_s, EVER, Sensor.IMU, pushed, rate, 0.64), words


def _mag_drift(rng: Generator, at_s: float) -> tuple[Fault, str]:
    rate = float(rng.uniform(0.5, 5.0)) * (1.0 if rng.random() < 0.5 else -1.0)
    words = f"magnetometer drifts by {rate:+.1f} uT each second, to 50"
    return Drift(at_s, EVER, Sensor.MAG, magnetised, rate, 50.0), words


def _alt_drift(rng: Generator, at_s: float) -> tuple[Fault, str]:
    # To 60 Pa, 5 m: wind of 10 m/s into the housing (its stagnation pressure), or the sun on it.
    rate = float(rng.uniform(1.0, 10.0)) * (1.0 if rng.random() < 0.5 else -1.0)
    words = f"altimeter drifts by {rate:+.1f} Pa each second, to 60"
    return Drift(at_s, EVER, Sensor.BARO, pressed, rate, 60.0), words


def _direction(rng: Generator) -> tuple[float, float]:
    angle = float(rng.uniform(0.0, 2.0 * math.pi))
    return math.cos(angle), math.sin(angle)


def _gps_drift(rng: Generator, at_s: float) -> tuple[Fault, str]:
    north, east = _direction(rng)
    speed = float(rng.uniform(0.1, 0.5))
    fault = PullAway(at_s, EVER, velocity_m_s=(speed * north, speed * east), most_m=10.0)
    return fault, f"gps drifts with {speed:.1f} m/s, to 10 m"


def _gps_jump(rng: Generator, at_s: float) -> tuple[Fault, str]:
    north, east = _direction(rng)
    duration_s = _time(rng, (10.0, EVER))
    if rng.random() < 0.5:
        step = Jump(at_s, duration_s, by_ned_m=(20.0 * north, 20.0 * east, 0.0))
        return step, f"gps jumps by 20 m {_lasting(duration_s)}"
    fault = PullAway(at_s, duration_s, velocity_m_s=(2.0 * north, 2.0 * east), most_m=20.0)
    return fault, f"gps is pulled away with 2 m/s, to 20 m, {_lasting(duration_s)}"


def _bus(rng: Generator, at_s: float) -> tuple[Fault, str]:
    if rng.random() < 0.5:
        # The bus is clocked free 50 ms after the try before (docs/board.md).
        return Dropout(at_s, 0.05, Sensor.IMU), "the IMU's bus is held low for 0.05 s"
    duration_s = _time(rng, (0.3, EVER))
    return SlowBusDown(at_s, duration_s), f"the slow bus is held low {_lasting(duration_s)}"


def _card_stall(rng: Generator, at_s: float) -> tuple[Fault, str]:
    duration_s = _time(rng, (0.2, 4.0))  # DESIGN.md section 7
    return CardStall(at_s, duration_s), f"the card stalls {_lasting(duration_s)}"


def _card_death(rng: Generator, at_s: float) -> tuple[Fault, str]:
    if rng.random() < 0.5:
        return CardStall(at_s), "the card is busy for ever"
    return CardDeath(at_s), "the card fails all it is asked"


def _radio_loss(rng: Generator, at_s: float) -> tuple[Fault, str]:
    failsafe = rng.random() < 0.5
    duration_s = _time(rng, (0.3, 3.0, EVER))
    how = "says that it hears nothing" if failsafe else "is silent"
    return RadioLoss(at_s, duration_s, failsafe), f"the receiver {how} {_lasting(duration_s)}"


def _rotor(strength: float) -> Draw:
    def draw(rng: Generator, at_s: float) -> tuple[Fault, str]:
        rotor = int(rng.integers(4))
        return RotorFault(at_s, EVER, rotor, strength), f"M{rotor + 1} gives {strength:.0%}"

    return draw


def _wind(rng: Generator, at_s: float) -> tuple[Fault, str]:
    north, east = _direction(rng)
    return WindStep(at_s, EVER, (8.0 * north, 8.0 * east, 0.0)), "wind of 8 m/s with gusts"


def _battery(rng: Generator, at_s: float) -> tuple[Fault, str]:
    charge = float(rng.uniform(0.0, 0.1))
    return BatterySag(at_s, EVER, charge), f"{charge:.0%} of the battery's charge is left"


def _brown_out(rng: Generator, at_s: float) -> tuple[Fault, str]:
    del rng
    return BrownOut(at_s), "the processor restarts"


def _kill(rng: Generator, at_s: float) -> tuple[Fault, str]:
    del rng
    return KillSwitch(at_s), "the kill switch"


def _kinds() -> dict[str, Kind]:
    found: list[Kind] = []
    drifts = {"imu": _imu_drift, "mag": _mag_drift, "alt": _alt_drift, "gps": _gps_drift}
    for name in _DEVICES:
        found += [
            Kind(f"{name}-freeze", _freeze(name)),
            Kind(f"{name}-spike", _spike(name)),
            Kind(f"{name}-drift", drifts[name]),
            Kind(f"{name}-delay", _delay(name)),
            Kind(f"{name}-dropout", _dropout(name)),
        ]
    found += [
        Kind("gps-jump", _gps_jump),
        Kind("bus-lock-up", _bus),
        Kind("card-stall", _card_stall),
        Kind("card-death", _card_death),
        Kind("radio-loss", _radio_loss, by_radio=True),
        Kind("motor-loss", _rotor(0.0), cuts_motors=True),
        Kind("motor-weak", _rotor(0.5)),
        Kind("wind", _wind),
        Kind("battery", _battery),
        Kind("brown-out", _brown_out, cuts_motors=True),
        Kind("kill", _kill, cuts_motors=True),
    ]
    return {kind.name: kind for kind in found}


KINDS = _kinds()
