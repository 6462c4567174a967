"""The console of the host build through a real pseudo-terminal, as a script and as a person.

Simulated time goes on only while the client waits, and only after the bytes that are on their way
through the kernel have arrived: nothing here depends on how fast the machine is.
"""

from __future__ import annotations

import math
import os
import re
import select
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from strix import _core
from strix.console import ConsoleClient, PtyPort, RefusedError
from strix.errors import BadInput
from strix.missions import find_mission
from strix.parameters import parameters
from strix.plant.earth import MAGNETIC_DECLINATION_RAD
from strix.plant.plant import Plant
from strix.plant.sensors import DEFAULT_CONSTANTS, SensorSuite
from strix.plant.surroundings import Surroundings
from strix.simulation import MAG_MOUNTING, STEP_US, _deliver
from strix.vehicles import plant_numbers

VEHICLE = "Quad5in"
READY_S = 25.0  # calibrated, and its origin averaged: the simulator's pilot arms after 20 s
PATIENCE_S = 120.0  # simulated, for an answer


class Aircraft:
    """A simulated aircraft on the ground, its console on a pseudo-terminal."""

    def __init__(self, folder: Path, storage: bytes = b"") -> None:
        surroundings = Surroundings()
        self._plant = Plant(plant_numbers(VEHICLE), surroundings, 0.3, seed=1)
        self._sensors = SensorSuite(surroundings, 1, DEFAULT_CONSTANTS, MAG_MOUNTING)
        mission = find_mission("hover")
        self.flight = _core.Flight(
            vehicle=VEHICLE,
            mission=mission.name,
            mission_text=mission.text,
            declination_rad=MAGNETIC_DECLINATION_RAD,
            log_path=str(folder / "flight.ulg"),
            boot_id=1,
            start_time_us=0,
            console=True,
            storage=storage,
        )
        self.port = PtyPort()
        self._commands = self.flight.loop(0)

    def advance(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self._plant.step(self._commands, STEP_US)
            truth = self._plant.truth
            _deliver(self.flight, self._sensors.sample(truth))
            self._commands = self.flight.loop(truth.time_us)
            if said := self.flight.take_console():
                self.port.send(said)

    def motors_on(self) -> bool:
        return self.flight.motors_on

    @property
    def time_s(self) -> float:
        return self._plant.truth.time_us * 1e-6


class Script(ConsoleClient):
    """A client in lock step with its aircraft."""

    def __init__(self, aircraft: Aircraft) -> None:
        self._aircraft = aircraft
        self._sent = 0  # bytes that the aircraft has not got yet
        self._deadline_s = aircraft.time_s + PATIENCE_S
        super().__init__(aircraft.port.path, self._go_on)

    def send(self, text: str) -> None:
        self._sent += len(text)
        self._deadline_s = self._aircraft.time_s + PATIENCE_S
        super().send(text)

    def _go_on(self) -> None:
        aircraft = self._aircraft
        assert aircraft.time_s < self._deadline_s, "the aircraft does not answer"
        while self._sent > 0:
            select.select([aircraft.port], [], [])  # the kernel hands it over
            typed = aircraft.port.poll()
            self._sent -= len(typed)
            aircraft.flight.put_console(typed)
        aircraft.advance(0.01)
        aircraft.port.send(b"")


@pytest.fixture(scope="module")
def ready(tmp_path_factory: pytest.TempPathFactory) -> Aircraft:
    """Calibrated; tests leave it with its motors off."""
    aircraft = Aircraft(tmp_path_factory.mktemp("card"))
    aircraft.advance(READY_S)
    return aircraft


@pytest.fixture
def script(ready: Aircraft) -> Iterator[Script]:
    with Script(ready) as client:
        yield client


def test_every_command_of_the_help_is_answered(script: Script) -> None:
    names = [line.split()[0] for line in script.command("help")[:-1]]
    assert len(names) == len(set(names)) == 22
    for name in names:
        told = script.command(f"help {name}")
        assert any(line.strip().startswith(f"for example: {name}") for line in told)
    for line in ("status", "sensors", "checks", "params", "param TILT_TIME", "version"):
        answer = script.command(line)
        assert answer
        assert max(len(row) for row in answer) <= 80


def test_what_is_shown_is_what_the_aircraft_has(script: Script, ready: Aircraft) -> None:
    status = script.command("status")
    assert status[0].split(maxsplit=1) == ["state", f"{ready.flight.state_name}, motors off"]
    sensors = script.command("sensors")
    gravity = next(line for line in sensors if line.startswith("IMU"))
    x, y, z = (float(v) for v in gravity.split()[2:5])
    assert math.hypot(x, y, z) == pytest.approx(9.8, abs=0.5)  # its noise, and its zero
    assert z < 0.0  # specific force points up
    checks = script.command("checks")
    assert all(line.endswith(" ok") for line in checks), checks


def test_the_list_of_parameters_is_the_table(script: Script) -> None:
    rows = script.command("params")[1:]
    assert [row.split()[0] for row in rows] == [p.name for p in parameters()]
    assert len(script.command("params rc_map")) == 1 + 8


def test_a_parameter_is_set_within_its_range(script: Script) -> None:
    script.command("defaults")  # the simulator flies with its own declination
    assert script.command("set FENCE_RADIUS 25.5")[0].startswith("FENCE_RADIUS = 25.5 m")
    assert script.command("param fence_radius")[0] == "FENCE_RADIUS = 25.5 m"
    with pytest.raises(RefusedError, match=r"^FENCE_RADIUS is from 5 to 500 m$"):
        script.command("set FENCE_RADIUS 4.9")
    with pytest.raises(RefusedError, match="number"):
        script.command("set FENCE_RADIUS far")
    assert script.command("param FENCE_RADIUS")[0] == "FENCE_RADIUS = 25.5 m"
    assert script.command("defaults") == ["1 changed; save keeps it"]
    assert script.command("param FENCE_RADIUS")[0] == "FENCE_RADIUS = 30 m"


def test_what_was_saved_is_there_after_a_restart_and_nothing_else(tmp_path: Path) -> None:
    first = Aircraft(tmp_path)
    with Script(first) as client:
        client.command("set RETURN_HEIGHT 4.5")
        client.command("save")
        client.command("set TILT_TIME 2")
    second = Aircraft(tmp_path, storage=first.flight.storage())
    with Script(second) as client:
        assert client.command("param RETURN_HEIGHT")[0] == "RETURN_HEIGHT = 4.5 m"
        assert client.command("param TILT_TIME")[0] == "TILT_TIME = 0.5 s"


def test_arming_counts_down_and_a_key_stops_it(script: Script, ready: Aircraft) -> None:
    before_s = ready.time_s
    script.send("arm\n")
    told = [script.line() for _ in range(3)]
    assert told == [f"arming in {n} s: any key stops it" for n in (5, 4, 3)]
    script.send(" ")
    with pytest.raises(RefusedError, match="stopped by a key"):
        script.answer()
    script.command("\nversion")
    ready.advance(6.0)
    assert not ready.motors_on()
    assert ready.time_s - before_s > 5.0


def test_with_the_motors_on_what_is_for_the_ground_is_refused(
    script: Script, ready: Aircraft
) -> None:
    before_s = ready.time_s
    script.command("props off")
    script.command("arm")
    assert ready.time_s - before_s >= 5.0
    ready.advance(0.1)
    assert ready.motors_on()
    for line, sentence in (
        ("set FENCE_RADIUS 20", "FENCE_RADIUS can be changed with the motors off only"),
        ("motor 1 10 1", "the motors are on: disarm first"),
        ("arm", "the motors are on already"),
        ("log list", "the motors are on: disarm first"),
        ("log get 1", "the motors are on: disarm first"),
        ("defaults", "the motors are on: disarm first"),
        ("reboot", "the motors are on: disarm first"),
        ("kill off", ""),
        ("save", ""),
        ("land", ""),
        ("calibrate", ""),
    ):
        with pytest.raises(RefusedError, match=f"^{re.escape(sentence)}"):
            script.command(line)
    assert script.command("set RETURN_HEIGHT 3")
    script.command("disarm")
    ready.advance(0.1)
    assert not ready.motors_on()
    script.command("texts on")
    assert any("armed" in text for text in script.texts)


def test_a_motor_turns_alone_and_a_key_stops_it(script: Script, ready: Aircraft) -> None:
    off = ready.flight.loop(round(ready.time_s * 1e6))
    with pytest.raises(RefusedError, match=r"^take the propellers off"):
        ready.advance(61.0)  # the promise of another test is forgotten
        script.command("motor 2 10 1")
    script.command("props off")
    for stopped in (False, True):
        script.send("motor 2 10 1\n")
        while not script.line().startswith("M2 turns"):
            pass
        ready.advance(0.2)
        commands = ready.flight.loop(round(ready.time_s * 1e6))
        assert commands[1] > off[1]
        assert [commands[i] for i in (0, 2, 3)] == [off[i] for i in (0, 2, 3)]
        assert ready.flight.state_name == "MOTOR_TEST"
        if stopped:
            script.send(" ")
            with pytest.raises(RefusedError, match="stopped by a key"):
                script.answer()
            script.command("\nversion")
        else:
            script.answer()
            ready.advance(0.1)
        assert ready.flight.loop(round(ready.time_s * 1e6)) == off


def test_a_kill_holds_until_it_is_taken_back(tmp_path: Path) -> None:
    aircraft = Aircraft(tmp_path)
    with Script(aircraft) as client:
        client.command("kill")
        aircraft.advance(0.1)
        assert any("kill command" in line and " NO " in line for line in client.command("checks"))
        with pytest.raises(RefusedError):
            client.command("arm")
        client.command("kill off")
        aircraft.advance(0.1)
        assert any(re.fullmatch("kill command +ok", line) for line in client.command("checks"))


def test_a_person_can_correct_what_he_types_and_sees_it(ready: Aircraft) -> None:
    with Script(ready) as client:
        client.command("echo on")
        client.send("versoi\b\bion\r")
        client.line()
        assert client.line().startswith("Strix ")
        client.answer()
        client.command("echo off")


def test_garbage_and_a_line_too_long_are_answered_and_do_nothing(
    script: Script, ready: Aircraft
) -> None:
    with pytest.raises(RefusedError, match="longer than 40 characters"):
        script.command("kill" + 296 * " ")
    with pytest.raises(RefusedError, match=r"^there is no such command: type help$"):
        script.command("\x00\x01\x1b[A~~~garbage~~~\x7f\x7f")
    assert ready.flight.state_name == "IDLE"
    assert script.command("version")


def test_a_log_arrives_as_it_is_on_the_card(tmp_path: Path) -> None:
    aircraft = Aircraft(tmp_path)
    data = bytes(i * i * 7 % 251 for i in range(20_000))
    (tmp_path / "log_0003.ulg").write_bytes(b"short")
    (tmp_path / "log_0012.ulg").write_bytes(data)
    with Script(aircraft) as client:
        assert client.logs() == {3: 5, 12: 20_000}
        assert client.log(12) == data
        assert client.log(3) == b"short"
        with pytest.raises(RefusedError, match="no log of that number"):
            client.log(4)


def test_calibrating_begins_anew(tmp_path: Path) -> None:
    aircraft = Aircraft(tmp_path)
    aircraft.advance(READY_S)
    assert aircraft.flight.state_name == "IDLE"
    with Script(aircraft) as client:
        client.command("calibrate")
    aircraft.advance(0.1)
    assert aircraft.flight.state_name == "BOOT"
    aircraft.advance(READY_S)
    assert aircraft.flight.state_name == "IDLE"


def test_a_reboot_is_answered(tmp_path: Path) -> None:
    with Script(Aircraft(tmp_path)) as client:
        assert client.command("reboot") == []


def answered(text: bytes) -> ConsoleClient:
    """A client whose aircraft answers the first command with ok and the next with this."""
    ours, theirs = os.openpty()

    def aircraft() -> None:
        seen = b""
        for answer in (b"ok\r\n", text):
            while b"\n" not in seen:
                seen += os.read(ours, 100)
            seen = seen.partition(b"\n")[2]
            os.write(ours, answer)

    threading.Thread(target=aircraft, daemon=True).start()
    return ConsoleClient(theirs)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"log 7 3 bytes\nAQID\nend 3 bytes crc32 55bc801d\nok\n", None),
        (b"log 7 3 bytes\nAQIE\nend 3 bytes crc32 55bc801d\nok\n", "CRC-32 55bc801d"),
        (b"log 7 3 bytes\nend 3 bytes crc32 55bc801d\nok\n", "expected 3 bytes"),
        (b"log 7 3 bytes\nAQ*D\nend 3 bytes crc32 55bc801d\nok\n", "expected base64"),
        (b"log 8 3 bytes\nAQID\nend 3 bytes crc32 55bc801d\nok\n", "expected 'log ...'"),
        (b"log 7 3 bytes\nAQID\nok\n", "expected 'log ...'"),
    ],
)
def test_a_log_that_was_spoilt_on_its_way_is_none(text: bytes, said: str | None) -> None:
    with answered(text) as client:
        if said is None:
            assert client.log(7) == b"\x01\x02\x03"
            return
        with pytest.raises(BadInput, match=re.escape(said)):
            client.log(7)


def test_what_is_no_terminal_is_told(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="expected a terminal that can be opened"):
        ConsoleClient(tmp_path / "none")
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput, match="expected a terminal, found"):
        ConsoleClient(tmp_path / "file")


def test_what_nobody_reads_is_lost_and_counted_and_does_not_wait() -> None:
    port = PtyPort()
    for _ in range(100):
        port.send(b"x" * 1000)
    assert port.lost > 0
    port.close()
