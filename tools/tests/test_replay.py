"""Replays of simulated flights: the same bits, and the first difference named."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from strix.cli import app
from strix.errors import BadInput
from strix.flightlog import read_flight_log
from strix.fly import make_plan
from strix.replay import read_gains, replay
from strix.simulation import fly as simulate

GAINS = Path(__file__).parents[2] / "include" / "gains"


@dataclass(frozen=True)
class Message:
    """One ULog message of a file: where it begins, its type and its body."""

    at: int
    type: str
    body: bytes


def messages(content: bytes) -> list[Message]:
    found: list[Message] = []
    at = 16
    while at + 3 <= len(content):
        size, kind = struct.unpack_from("<Hc", content, at)
        found.append(Message(at, kind.decode(), content[at + 3 : at + 3 + size]))
        at += 3 + size
    return found


def records(content: bytes, topic: str) -> list[Message]:
    """Data messages of a topic, instance 0."""
    all_messages = messages(content)
    (msg_id,) = (
        m.body[1:3]
        for m in all_messages
        if m.type == "A" and m.body[3:].decode() == topic and m.body[0] == 0
    )
    return [m for m in all_messages if m.type == "D" and m.body[:2] == msg_id]


def fly(path: Path, vehicle: str, scenario: str, seed: int) -> None:
    """At most 60 s, landed or not."""
    plan = make_plan(vehicle, "first-flight", scenario, 40.0, seed)
    simulate(plan, path, lambda _time_s, _state: None, give_up_s=60.0)


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A whole flight of the default aircraft."""
    path = tmp_path_factory.mktemp("replay") / "flight.ulg"
    fly(path, "Quad5in", "calm", 5)
    return path


def test_a_replay_makes_every_tick_again(flight: Path) -> None:
    before = flight.read_bytes()
    found = replay(flight)
    assert found.same
    assert found.ticks == len(records(before, "control_tick"))
    assert not found.stopped_at_gap
    assert flight.read_bytes() == before


@pytest.mark.parametrize("vehicle", ["Quad5in", "UgglanQ450"])
@pytest.mark.parametrize("scenario", ["calm", "wind", "magnetic"])
def test_every_vehicle_and_scenario_replays(tmp_path: Path, vehicle: str, scenario: str) -> None:
    path = tmp_path / "flight.ulg"
    fly(path, vehicle, scenario, 11)
    assert replay(path).same


def test_the_law_and_the_mission_that_flew_are_replayed(tmp_path: Path) -> None:
    """Ugglan's law, another design of the gains, a mission with every kind of leg."""
    mission = tmp_path / "kinds.txt"
    mission.write_text(
        "takeoff 2 0.5\nspeed 1.5\nleg 3 0 2 30 0 0.8\nattitude 10 0 0 0.5\nhome\n",
        encoding="utf-8",
    )
    path = tmp_path / "flight.ulg"
    plan = make_plan("UgglanQ450", str(mission), "wind", 40.0, 3, "ugglan")
    simulate(plan, path, lambda _time_s, _state: None, give_up_s=60.0)
    log = read_flight_log(path)
    assert log.topic("flight_config")["attitude_law"][0] == 1
    assert log.topic("flight_config")["design"][0] == 2
    assert len(log.topic("esc_status")["voltage"]) > 150
    assert replay(path).same


def test_one_bit_of_one_input_is_found(flight: Path, tmp_path: Path) -> None:
    content = bytearray(flight.read_bytes())
    imu = records(bytes(content), "sensor_combined")[20_000]
    time_us = struct.unpack_from("<Q", imu.body, 2)[0]
    # A bit of the gyro's x: 2^-15 of its value. The very lowest may be lost in taking off the bias.
    content[imu.at + 3 + 2 + 16 + 12 + 1] ^= 1
    damaged = tmp_path / "bit.ulg"
    damaged.write_bytes(content)
    found = replay(damaged, stop_at_difference=True)
    assert not found.same
    # The very next control tick, 2 ms later at most, and the attitude shows it first.
    assert found.first_difference_s is not None
    assert 0.0 <= found.first_difference_s - time_us * 1e-6 <= 0.002
    assert found.field == "vehicle_attitude.q"


def test_a_log_with_drops_replays_up_to_the_gap_and_says_so(flight: Path, tmp_path: Path) -> None:
    content = bytearray(flight.read_bytes())
    statuses = records(bytes(content), "log_status")
    last_sound, first_bad = statuses[60], statuses[61]
    for status in statuses[61:]:  # one IMU record lost: dropped_by_id[0]
        struct.pack_into("<I", content, status.at + 3 + 2 + 8 + 5 * 4, 1)
    gap = tmp_path / "gap.ulg"
    gap.write_bytes(content)
    found = replay(gap)
    assert found.stopped_at_gap
    assert found.same
    sound_s = struct.unpack_from("<Q", last_sound.body, 2)[0] * 1e-6
    bad_s = struct.unpack_from("<Q", first_bad.body, 2)[0] * 1e-6
    assert found.end_s <= sound_s < bad_s
    assert found.end_s > sound_s - 0.01
    assert any("lost inputs" in sentence for sentence in found.sentences())


def test_another_tuning_gives_another_log(flight: Path, tmp_path: Path) -> None:
    out = tmp_path / "what-if.ulg"
    found = replay(flight, ["nav.gps_position_sigma=0.5", "nav.tilt.density=0.8"], out=out)
    assert found.first_difference_s is not None
    assert found.changed
    flown, other = read_flight_log(flight), read_flight_log(out)
    a, b = flown.topic("vehicle_local_position"), other.topic("vehicle_local_position")
    assert len(a.time_s) == len(b.time_s)
    assert np.abs(a["x"] - b["x"]).max() > 0.05
    # The inputs are those of the flight.
    for name in ("sensor_combined", "sensor_mag", "sensor_baro", "vehicle_gps_position"):
        one, two = flown.topic(name), other.topic(name)
        for field in one.fields:
            np.testing.assert_array_equal(one[field], two[field])
    assert (
        replay(out, ["nav.gps_position_sigma=0.5", "nav.tilt.density=0.8"]).first_difference_s
        is None
    )


def test_the_other_filter_and_other_gains_can_be_tried(flight: Path) -> None:
    assert replay(flight, states=9).first_difference_s is not None
    own = replay(flight, gains=GAINS / "Quad5in.h")
    assert own.first_difference_s is None
    other = replay(flight, gains=GAINS / "UgglanQ450.h")
    assert other.field.startswith("wrench_setpoint")
    assert len(read_gains(GAINS / "Quad5in.h")) == 4


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("nav.foo=1", "expected one of accelBiasSigma0"),
        ("gpsPositionSigma=1", "expected nav.NAME=VALUE"),
        ("nav.gpsPositionSigma=many", "expected a number"),
        ("nav.magFusion=Both", "expected one of HeadingOnly, ThreeAxis"),
        ("nav.trackField=2", "expected true or false"),
        ("nav.tilt=1", "expected one of"),
    ],
)
def test_a_change_that_cannot_be_made_is_refused(flight: Path, change: str, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        replay(flight, [change])


def test_what_is_no_flight_log_is_refused(flight: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.ulg"
    other.write_bytes(b"not a log at all, but long enough")
    with pytest.raises(BadInput, match="expected a ULog file"):
        replay(other)
    other.write_bytes(flight.read_bytes()[:16])
    with pytest.raises(BadInput, match="expected a flight log from its beginning"):
        replay(other)
    with pytest.raises(BadInput, match="another file than the log"):
        replay(flight, out=flight)
    content = flight.read_bytes()
    at = content.index(b"sensor_combined:uint64_t timestamp")
    other.write_bytes(content[:at] + b"sensor_combined:uint32_t" + content[at + 24 :])
    with pytest.raises(BadInput, match="one of another version"):
        replay(other)


def test_a_subscription_with_an_impossible_id_is_no_subscription(
    flight: Path, tmp_path: Path
) -> None:
    content = bytearray(flight.read_bytes())
    for message in messages(bytes(content)):
        if message.type == "A" and message.body[3:] == b"flight_config":
            struct.pack_into("<H", content, message.at + 4, 65535)
    other = tmp_path / "id.ulg"
    other.write_bytes(content)
    with pytest.raises(BadInput, match="expected a flight log from its beginning"):
        replay(other)


def test_a_log_cut_anywhere_replays_as_far_as_it_goes_or_is_refused(
    flight: Path, tmp_path: Path
) -> None:
    content = flight.read_bytes()
    cut = tmp_path / "cut.ulg"
    for size in np.linspace(17, len(content) - 1, 12).astype(int):
        cut.write_bytes(content[:size])
        try:
            found = replay(cut, stop_at_difference=True)
        except BadInput:
            assert size < 20_000  # not even the first control tick
        else:
            assert found.end_s <= found.log_end_s + 1.0


def test_the_command_prints_and_ends_as_it_says(flight: Path) -> None:
    runner = CliRunner()
    good = runner.invoke(app, ["replay", str(flight), "--check"])
    assert good.exit_code == 0
    assert "bit for bit" in good.output
    what_if = runner.invoke(app, ["replay", str(flight), "--states", "9", "--json"])
    assert what_if.exit_code == 0
    assert json.loads(what_if.output)["same"] is False
    assert runner.invoke(app, ["replay", str(flight), "--states", "12"]).exit_code == 2
