"""The aircraft's console from the laptop: a pseudo-terminal for the simulated aircraft, and a
client for scripts that speaks with it or with the USB port of the real one. docs/console.md.
"""

from __future__ import annotations

import base64
import binascii
import os
import re
import select
import termios
import tty
import zlib
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from strix.errors import BadInput

ANSWER_WITHIN_S = 10.0
LONGEST_LINE = 40  # CommandLine.h
_MOST_AT_ONCE = 4096


class PtyPort:
    """The simulated aircraft's end of a cable; at the other, `path`, a terminal program or a
    ConsoleClient may come and go. Nothing waits: what nobody reads is kept up to a limit, then
    lost and counted, as on a USB port.
    """

    KEPT = 65536  # bytes

    def __init__(self) -> None:
        # The terminal's end stays open here too: without one, reading would be an error.
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.path = os.ttyname(self._theirs)
        self.lost = 0
        self._unsent = b""

    def fileno(self) -> int:
        """For select: readable when something was typed."""
        return self._ours

    def poll(self) -> bytes:
        """What was typed since the last call."""
        try:
            return os.read(self._ours, _MOST_AT_ONCE)
        except BlockingIOError:
            return b""

    def send(self, data: bytes) -> None:
        """What the aircraft says; b"" to try again with what found no room."""
        room = self.KEPT - len(self._unsent)
        self.lost += max(len(data) - room, 0)
        self._unsent += data[:room]
        try:
            while self._unsent:
                self._unsent = self._unsent[os.write(self._ours, self._unsent) :]
        except BlockingIOError:
            pass

    def close(self) -> None:
        os.close(self._ours)
        os.close(self._theirs)


class RefusedError(Exception):
    """The aircraft's answer to a command was an error; the message is its sentence."""


class ConsoleClient:
    """Types commands as a script does, and returns what they print.

    :param where: a terminal's path, such as /dev/ttyACM0 or a PtyPort's, or an open descriptor
    :param wait: called while there is no answer: a simulation goes on in it. Without one, the
        client waits for at most ANSWER_WITHIN_S of silence.
    """

    def __init__(self, where: int | str | Path, wait: Callable[[], None] | None = None) -> None:
        self.name = str(where)
        self.texts: list[str] = []  # what the aircraft said meanwhile
        self._received = b""
        self._wait = wait or self._wait_for_bytes
        if isinstance(where, int):
            self._fd = os.dup(where)
        else:
            try:
                self._fd = os.open(where, os.O_RDWR | os.O_NOCTTY)
            except OSError as error:
                raise BadInput(
                    f"{where}: expected a terminal that can be opened, found: {error.strerror}"
                ) from None
        try:
            tty.setraw(self._fd)
        except termios.error as error:
            os.close(self._fd)
            raise BadInput(f"{where}: expected a terminal, found: {error.args[-1]}") from None
        os.set_blocking(self._fd, False)
        self.send("\b" * LONGEST_LINE)  # whatever stands half typed
        self.command("echo off")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def fileno(self) -> int:
        """For select: readable when the aircraft has said something."""
        return self._fd

    def close(self) -> None:
        os.close(self._fd)

    def send(self, text: str) -> None:
        """Types without Enter: any key stops what is running."""
        self._write(text.encode("ascii"))

    def command(self, text: str) -> list[str]:
        """The lines of its answer, without the last, which is `ok`. RefusedError for an error."""
        self.send(text + "\n")
        return self.answer()

    def answer(self) -> list[str]:
        """The rest of the answer to what was typed."""
        lines: list[str] = []
        while (line := self.line()) != "ok":
            if line.startswith("error: "):
                raise RefusedError(line.removeprefix("error: "))
            lines.append(line)
        return lines

    def line(self) -> str:
        """The next line that belongs to an answer."""
        while True:
            while b"\n" not in self._received:
                if not self._read():
                    self._wait()
            raw, _, self._received = self._received.partition(b"\n")
            # A prompt before the line is overwritten on the screen.
            text = raw.rstrip(b"\r").decode("ascii", "replace").rpartition("\r")[2]
            if not text.startswith("* "):
                return text
            self.texts.append(text.removeprefix("* "))

    def logs(self) -> dict[int, int]:
        """The logs on the card: bytes by number."""
        rows = [line.split() for line in self.command("log list")[1:]]
        return {int(number): int(size) for number, size in rows}

    def log(self, number: int) -> bytes:
        """One of them. BadInput when it did not arrive as it was sent."""
        first, *rows, last = self.command(f"log get {number}")
        begin = re.fullmatch(r"log (\d+) (\d+) bytes", first)
        end = re.fullmatch(r"end (\d+) bytes crc32 ([0-9a-f]{8})", last)
        if begin is None or end is None or int(begin[1]) != number:
            raise BadInput(
                f"{self.name}: log {number}: expected 'log ...' to 'end ...', "
                f"found '{first}' to '{last}'"
            )
        try:
            data = b"".join(base64.b64decode(row, validate=True) for row in rows)
        except binascii.Error as error:
            raise BadInput(f"{self.name}: log {number}: expected base64: {error}") from None
        if len(data) != int(end[1]) or f"{zlib.crc32(data):08x}" != end[2]:
            raise BadInput(
                f"{self.name}: log {number}: expected {end[1]} bytes with CRC-32 {end[2]}, "
                f"found {len(data)} with {zlib.crc32(data):08x}"
            )
        return data

    def _write(self, data: bytes) -> None:
        while data:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:
                self._wait()

    def _read(self) -> bool:
        try:
            found = os.read(self._fd, _MOST_AT_ONCE)
        except BlockingIOError:
            return False
        except OSError as error:
            raise BadInput(f"{self.name}: expected the aircraft, found: {error.strerror}") from None
        self._received += found
        return bool(found)

    def _wait_for_bytes(self) -> None:
        if not select.select([self._fd], [], [], ANSWER_WITHIN_S)[0]:
            raise BadInput(
                f"{self.name}: expected an answer within {ANSWER_WITHIN_S:g} s, found "
                f"{self._received.decode('ascii', 'replace')!r}"
            )
