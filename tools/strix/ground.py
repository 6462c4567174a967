"""Who speaks with a simulated aircraft: a ground station over UDP, a terminal, in real time."""

from __future__ import annotations

import signal
import time
from dataclasses import dataclass, field

from strix import _core
from strix.console import PtyPort
from strix.errors import BadInput
from strix.groundlink import UdpPort

UNTIL_INTERRUPTED_S = 3600.0


@dataclass
class Ground:
    """The ends of both cables, and how fast the simulated time may go."""

    link: UdpPort | None = None
    terminal: PtyPort | None = None
    speed: float = 1.0  # simulated seconds a second; 0: as fast as it can be computed
    end_s: float = UNTIL_INTERRUPTED_S  # of simulated time
    _began: float | None = field(default=None, init=False)

    def exchange(self, flight: _core.Flight, time_s: float) -> None:
        """Carries what both sides have said, and waits until the simulated time has come."""
        if self.link is not None:
            flight.put_telemetry(self.link.poll())
            self.link.send(flight.take_telemetry())
        if self.terminal is not None:
            flight.put_console(self.terminal.poll())
            self.terminal.send(flight.take_console())
        if self.speed <= 0.0:
            return
        if self._began is None:
            self._began = time.monotonic() - time_s / self.speed
        ahead = self._began + time_s / self.speed - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)

    def close(self) -> None:
        for port in (self.link, self.terminal):
            if port is not None:
                port.close()


def make_ground(
    telemetry: str | None, console: bool, speed: float, end_s: float | None
) -> Ground | None:
    """What the options of `strix fly` ask for; None: nobody, and a pilot flies the mission."""
    if telemetry is None and not console:
        if end_s is not None:
            raise BadInput("--for: expected with --telemetry or --console, found alone")
        return None
    link = None if telemetry is None else UdpPort(telemetry)
    terminal = PtyPort() if console else None
    return Ground(link, terminal, speed, UNTIL_INTERRUPTED_S if end_s is None else end_s)


def read_parameters(texts: list[str]) -> tuple[tuple[str, float], ...]:
    """NAME=VALUE of `--param`; whether there is such a parameter the flight software says."""
    found = []
    for text in texts:
        name, equals, value = text.partition("=")
        try:
            if not equals:
                raise ValueError
            found.append((name.strip().upper(), float(value)))
        except ValueError:
            raise BadInput(
                f"--param: expected NAME=VALUE such as FENCE_RADIUS=25, found '{text}'"
            ) from None
    return tuple(found)


def end_by_signals() -> None:
    """An interrupt or a termination ends the flight and keeps its log, also in the background of a
    shell that lets its children ignore interrupts.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
