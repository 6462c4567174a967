"""What the numbers in a log are called. The flight code knows; its module may not be built here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from strix.flightlog import FlightLog


@dataclass(frozen=True)
class EscLimits:
    """Commands to a speed controller."""

    unit: str
    off: float
    flight_max: float


def state_name(number: int) -> str:
    """The flight state's name, or 'state 4' when the flight code cannot be asked."""
    names = _core().state_names() if _core() else []
    return str(names[number]) if number < len(names) else f"state {number}"


def esc_limits(log: FlightLog) -> EscLimits | None:
    """Those of the log's vehicle; None when the flight code cannot be asked or does not know it."""
    try:
        vehicle = _core().vehicle(log.info.get("vehicle", ""))
    except (AttributeError, KeyError):
        return None
    return EscLimits(vehicle["command_unit"], vehicle["command_off"], vehicle["command_flight_max"])


def _core() -> Any:
    try:
        from strix import _core
    except ImportError:
        return None
    return _core
