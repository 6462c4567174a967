"""Every hazard raised by what raises it: whole flights, each with one thing going wrong.

What no sensor can bring about, an estimator that is lost for good, is in
test/test_flight_software/test_navigation_use.cpp; a power supply that fails, a transmitter that is
lost and a card that dies are in test_campaign_flights.py.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import pytest

from strix import _core
from strix.campaign.flight import fly_one
from strix.campaign.plan import ARM_AT_S, Draw, draw
from strix.parameters import parameters
from strix.plant import BatteryNumbers
from strix.plant.faults import (
    EVER,
    Aircraft,
    BatterySag,
    Dropout,
    Fault,
    RotorFault,
    Sensor,
    Spike,
    WindStep,
    pressed,
    pushed,
)
from strix.plant.samples import Samples
from strix.plant.surroundings import Push

AT_S = ARM_AT_S + 9.0  # in hover at 3 m
ON_THE_WAY_S = ARM_AT_S + 14.0  # to the square's first corner


@dataclass
class WeakRotors(Fault):
    """All of them give a share of what they should; none, as with a blown fuse."""

    strength: float = 0.0

    def begin(self, aircraft: Aircraft) -> None:
        for rotor in range(4):
            aircraft.plant.weaken_rotor(rotor, self.strength)


@dataclass
class SlowLoop(Fault):
    """Something keeps the loop from its rate: a pass every 6 ms."""

    every: int = 6
    _passes: int = field(default=0, init=False)

    def begin(self, aircraft: Any) -> None:
        whole = aircraft.flight
        commands = [0.0]

        class Slow:
            def __getattr__(self, name: str) -> Any:
                return getattr(whole, name)

            def loop(slow, now_us: int) -> list[float]:  # noqa: N805
                self._passes += 1
                if self._passes % self.every == 0:
                    commands[:] = whole.loop(now_us)
                return list(commands)

        commands[:] = whole.loop(aircraft.plant.truth.time_us)
        aircraft.flight = Slow()


@dataclass
class Commanded(Fault):
    """A command of telemetry or console."""

    kind: _core.CommandKind = _core.CommandKind.Kill

    def begin(self, aircraft: Any) -> None:
        assert aircraft.flight.command(self.kind) == ""


@dataclass
class Steep(Fault):
    """Whoever wants no tilt beyond 30 deg, and not for a moment."""

    def begin(self, aircraft: Any) -> None:
        names = [p.name for p in parameters()]
        for name, value in (("TILT_LIMIT", 30.0), ("TILT_TIME", 0.0)):
            kind = _core.CommandKind.SetParameter
            assert aircraft.flight.command(kind, [value] + [0.0] * 7, names.index(name)) == ""


@dataclass
class GroundStationGone(Fault):
    """A companion computer flies the aircraft by setpoints and falls silent as a ground station."""

    heartbeats_s: float = 3.0
    _flight: Any = field(default=None, init=False)
    _next_s: float = field(default=0.0, init=False)

    def begin(self, aircraft: Any) -> None:
        self._flight = aircraft.flight

    def spoil(self, samples: Samples, time_s: float) -> Samples:
        if self._flight is not None and time_s >= self._next_s:
            self._next_s = time_s + 0.2
            place = [1.0, 1.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]
            self._flight.command(_core.CommandKind.Setpoint, place, 0b0111)
            if time_s < self.at_s + self.heartbeats_s:
                self._flight.command(_core.CommandKind.LinkAlive)
        return samples


@dataclass(frozen=True)
class Staged(Draw):
    """A flight whose fault is not drawn."""

    what: Callable[[float], Fault] = Fault
    settings: tuple[tuple[str, float], ...] = ()

    def fault(self) -> tuple[Fault, str]:
        return self.what(self.at_s), "staged"


def staged(
    what: Callable[[float], Fault],
    mission: str = "hover",
    at_s: float = AT_S,
    pushes: tuple[Push, ...] = (),
    resistance_ohm: float = 0.008,
) -> Staged:
    like = draw(1, 0, ["wind"])
    calm = replace(
        like.surroundings,
        wind_mean_ned_m_s=(1.0, 0.0, 0.0),
        pushes=pushes,
        battery=BatteryNumbers(resistance_ohm=resistance_ohm),
    )
    values = {name: getattr(like, name) for name in like.__dataclass_fields__}
    values |= {"mission": mission, "at_s": at_s, "surroundings": calm}
    return Staged(**values, what=what)


HAZARDS: dict[str, tuple[Staged, str]] = {
    "tilt past 90 deg": (
        staged(lambda at: RotorFault(at, EVER, 1, 0.0)),
        "tilt past 90 deg: motors off",
    ),
    "tilt limit": (
        staged(Steep, at_s=5.0, pushes=(Push(AT_S, (0.6, 0.0, 0.0), 0.3),)),
        "tilted beyond its limit: motors off",
    ),
    "crash": (
        # A branch: 20 g for 10 ms, and the aircraft turns over.
        staged(
            lambda at: Spike(at, 0.01, Sensor.IMU, pushed, 200.0),
            pushes=(Push(AT_S, (0.6, 0.0, 0.0), 0.3),),
        ),
        "hit something: motors off",
    ),
    "free fall": (staged(WeakRotors), "falls with its motors on: motors off"),
    "fence": (
        staged(lambda at: WindStep(at, EVER, (22.0, 0.0, 0.0))),
        "outside the fence: returning home",
    ),
    "fence, height": (
        staged(lambda at: Spike(at, 4.0, Sensor.BARO, pressed, -165.0), "square", ON_THE_WAY_S),
        "outside the fence: returning home",
    ),
    "IMU stale": (staged(lambda at: Dropout(at, EVER, Sensor.IMU)), "IMU lost: down on the model"),
    "IMU saturated": (
        staged(Fault, pushes=(Push(AT_S, (0.0, 0.0, 0.6), 1.0),)),  # spins
        "IMU saturated: landing",
    ),
    "altimeter": (staged(lambda at: Dropout(at, EVER, Sensor.BARO)), "altimeter lost: landing"),
    "GPS": (staged(lambda at: Dropout(at, EVER, Sensor.GPS)), "GPS lost: landing"),
    "magnetometer": (
        staged(lambda at: Dropout(at, EVER, Sensor.MAG), "square", ON_THE_WAY_S),
        "magnetometer lost: returning home",
    ),
    "battery low": (
        staged(lambda at: BatterySag(at, EVER, 0.1), "square", ON_THE_WAY_S),
        "battery low: returning home",
    ),
    "battery critical": (  # on its way home, by an old one
        staged(lambda at: BatterySag(at), "square", ON_THE_WAY_S, resistance_ohm=0.015),
        "battery critical: landing",
    ),
    "ground station lost": (
        staged(GroundStationGone, "square", ON_THE_WAY_S),
        "ground station lost: returning home",
    ),
    "loop overrun": (staged(SlowLoop), "loop too slow: landing"),
    "motor saturation": (
        staged(Fault, pushes=(Push(AT_S, (0.0, 0.0, 0.1), 4.0),)),
        "motors at their limits: landing",
    ),
    "astray": (
        staged(lambda at: RotorFault(at, EVER, 0, 0.5), "square", ON_THE_WAY_S),
        "does not get there: landing",
    ),
    "commanded kill": (
        staged(lambda at: Commanded(at, EVER, _core.CommandKind.Kill)),
        "killed: motors off",
    ),
    "commanded land": (
        staged(lambda at: Commanded(at, EVER, _core.CommandKind.Land), "square", ON_THE_WAY_S),
        "landing, as asked",
    ),
}


@pytest.mark.parametrize("name", HAZARDS)
def test_a_hazard_is_seen_and_answered(name: str) -> None:
    flight, said = HAZARDS[name]
    result, _ = fly_one(flight)
    assert result.flew
    assert any(text.endswith(": " + said) for text in result.said), result.said
