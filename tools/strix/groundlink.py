"""The aircraft's telemetry over UDP, as `strix fly --telemetry udp:127.0.0.1:14550` has it.

As with PX4, the aircraft sends to a ground station that listens at an address, and the station
answers to where it was sent from: QGroundControl listens at port 14550 by itself.
"""

from __future__ import annotations

import socket
from types import TracebackType

from strix.errors import BadInput

LARGEST_DATAGRAM = 65535
WHAT = "expected udp:HOST:PORT such as udp:127.0.0.1:14550"


class UdpPort:
    """One ground station. Nothing waits: what cannot be sent now is lost, as it is by radio."""

    def __init__(self, url: str) -> None:
        self._to = _resolve(url)
        family = socket.AF_INET6 if ":" in self._to[0] else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def poll(self) -> bytes:
        """All that has come from the station since the last time; b"" where nothing has."""
        heard = bytearray()
        while True:
            try:
                datagram, sender = self._socket.recvfrom(LARGEST_DATAGRAM)
            except BlockingIOError:
                return bytes(heard)
            except ConnectionError:  # nobody listens there yet: the kernel tells it here
                continue
            if sender[:2] == self._to:
                heard += datagram

    def send(self, data: bytes) -> None:
        if not data:
            return
        try:
            self._socket.sendto(data, self._to)
        except (BlockingIOError, ConnectionError):
            return

    def fileno(self) -> int:
        """For select: readable when something has come."""
        return self._socket.fileno()

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> UdpPort:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _resolve(url: str) -> tuple[str, int]:
    """The numeric address of the station."""
    scheme, _, place = url.partition(":")
    host, _, port_text = place.rpartition(":")
    host = host.removeprefix("//").removeprefix("[").removesuffix("]")
    if scheme != "udp" or not host or not port_text.isascii() or not port_text.isdigit():
        raise BadInput(f"--telemetry: {WHAT}, found '{url}'")
    port = int(port_text)
    if not 0 < port < 65536:
        raise BadInput(
            f"--telemetry: expected a port from 1 to 65535, found {port_text} in '{url}'"
        )
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
    except OSError as error:
        raise BadInput(f"--telemetry: {WHAT}, found no address for '{host}': {error}") from error
    address = found[0][4]
    return str(address[0]), port
