"""`strix fly` with a real ground station over UDP, or a person at its terminal, in a process."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import common

from strix.console import ConsoleClient
from strix.errors import BadInput
from strix.flightlog import read_flight_log
from strix.ground import make_ground, read_parameters

PATIENCE_S = 60.0  # a bound only: whatever is waited for comes within a second or two


def start(*arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "strix.cli", "fly", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.fixture
def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def station(free_port: int) -> Iterator[mavutil.mavfile]:
    link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{free_port}", source_system=255)
    yield link
    link.close()


def ask(station: mavutil.mavfile, command: int, *params: float) -> int:
    """Sends a command until it is answered; the result."""
    values = [*params, *[0.0] * (7 - len(params))]
    for _ in range(int(PATIENCE_S)):
        station.mav.command_long_send(1, 1, command, 0, *values)
        ack = station.recv_match(type="COMMAND_ACK", blocking=True, timeout=1.0)
        if ack is not None and ack.command == command:
            return int(ack.result)
    raise AssertionError("no answer")


def test_a_ground_station_arms_and_kills_and_the_log_holds_its_commands(
    tmp_path: Path, free_port: int, station: mavutil.mavfile
) -> None:
    flight = start(
        "--telemetry", f"udp:127.0.0.1:{free_port}", "--speed", "0", "--out", str(tmp_path)
    )
    try:
        assert station.wait_heartbeat(timeout=PATIENCE_S) is not None
        arm = common.MAV_CMD_COMPONENT_ARM_DISARM
        for _ in range(200):  # refused until it has calibrated, and averaged its origin
            if ask(station, arm, 1.0) == common.MAV_RESULT_ACCEPTED:
                break
        assert ask(station, common.MAV_CMD_DO_FLIGHTTERMINATION, 1.0) == common.MAV_RESULT_ACCEPTED
    finally:
        flight.send_signal(signal.SIGINT)
        _, said = flight.communicate(timeout=PATIENCE_S)
    assert flight.returncode == 0, said
    log = read_flight_log(tmp_path / "flight.ulg")
    commands = log.topic("vehicle_command")
    assert commands["accepted"].any()
    assert log.topic("flight_state")["motors_on"].any()
    assert not log.topic("flight_state")["motors_on"][-1]


def test_a_person_at_the_terminal_reads_the_status_of_a_flight(tmp_path: Path) -> None:
    flight = start("--console", "--speed", "0", "--out", str(tmp_path))
    try:
        assert flight.stderr is not None
        path = flight.stderr.readline().strip().removeprefix("console: ")
        with ConsoleClient(path) as client:
            assert any("state" in line for line in client.command("status"))
    finally:
        flight.terminate()
        _, said = flight.communicate(timeout=PATIENCE_S)
    assert flight.returncode == 0, said


def test_what_makes_no_sense_is_refused_in_words() -> None:
    assert read_parameters(["fence_radius=12.5"]) == (("FENCE_RADIUS", 12.5),)
    for text in ("FENCE_RADIUS", "FENCE_RADIUS=far", ""):
        with pytest.raises(BadInput, match="--param: expected NAME=VALUE"):
            read_parameters([text])
    with pytest.raises(BadInput, match="--for: expected with --telemetry"):
        make_ground(None, False, 1.0, 10.0)
    assert make_ground(None, False, 1.0, None) is None
    with pytest.raises(BadInput, match="--telemetry: expected udp:HOST:PORT"):
        make_ground("tcp:here", False, 1.0, None)
