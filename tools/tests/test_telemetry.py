"""Telemetry of the host build over UDP, with pymavlink as the ground station.

Simulated time goes on only after the bytes that are on their way through the kernel have arrived:
nothing here depends on how fast the machine is.
"""

from __future__ import annotations

import math
import os
import select
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from strix import _core
from strix.errors import BadInput
from strix.groundlink import UdpPort
from strix.missions import find_mission
from strix.parameters import parameters
from strix.plant.earth import MAGNETIC_DECLINATION_RAD
from strix.plant.plant import Plant
from strix.plant.sensors import DEFAULT_CONSTANTS, SensorSuite
from strix.plant.surroundings import Surroundings
from strix.simulation import MAG_MOUNTING, STEP_US, _deliver
from strix.vehicles import plant_numbers

os.environ["MAVLINK20"] = "1"  # pymavlink reads it when it is imported
from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

VEHICLE = "Quad5in"
READY_S = 25.0  # calibrated, and its origin averaged: the simulator's pilot arms after 20 s
PATIENCE_S = 5.0  # simulated, for an answer
KEY = bytes(range(1, 33))
OTHER_KEY = bytes(32 * [7])
TODAY = 37_000_000_000_000  # of signatures: 10 us since 2015


class Station:
    """pymavlink's own end of a UDP link, as mavproxy and scripts use it."""

    def __init__(self) -> None:
        self.link: Any = mavutil.mavlink_connection(
            "udpin:127.0.0.1:0", source_system=255, source_component=190, dialect="common"
        )
        self.heard: list[Any] = []

    def close(self) -> None:
        self.link.close()

    @property
    def url(self) -> str:
        return f"udp:127.0.0.1:{self.link.port.getsockname()[1]}"

    @property
    def mav(self) -> Any:
        return self.link.mav

    def listen(self) -> None:
        """One datagram, which is on its way."""
        select.select([self.link.port], [], [])
        while (message := self.link.recv_msg()) is not None:
            self.heard.append(message)


class Aircraft:
    """A simulated aircraft on the ground, and its ground station."""

    def __init__(self, folder: Path, storage: bytes = b"") -> None:
        surroundings = Surroundings()
        self._plant = Plant(plant_numbers(VEHICLE), surroundings, 0.3, seed=1)
        self._sensors = SensorSuite(surroundings, 1, DEFAULT_CONSTANTS, MAG_MOUNTING)
        mission = find_mission("hover")
        folder.mkdir(exist_ok=True)
        self.flight = _core.Flight(
            vehicle=VEHICLE,
            mission=mission.name,
            mission_text=mission.text,
            declination_rad=MAGNETIC_DECLINATION_RAD,
            log_path=str(folder / "flight.ulg"),
            boot_id=1,
            start_time_us=0,
            telemetry=True,
            storage=storage,
        )
        self.station = Station()
        self.port = UdpPort(self.station.url)
        self._commands = self.flight.loop(0)
        self.advance(1.5)  # the station can answer only whom it has heard

    def __enter__(self) -> Aircraft:
        return self

    def __exit__(self, *_: object) -> None:
        self.port.close()
        self.station.close()

    def advance(self, seconds: float) -> None:
        """Time goes on; the station sends its heartbeat once a second."""
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self._plant.step(self._commands, STEP_US)
            truth = self._plant.truth
            _deliver(self.flight, self._sensors.sample(truth))
            self._commands = self.flight.loop(truth.time_us)
            if said := self.flight.take_telemetry():
                self.port.send(said)
                self.station.listen()
            if truth.time_us % 1_000_000 == 0 and self.station.heard:
                self.send(
                    lambda mav: mav.heartbeat_send(
                        mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0
                    )
                )

    def send(self, say: Callable[[Any], None]) -> None:
        """What the station says has arrived before time goes on."""
        say(self.station.mav)
        select.select([self.port], [], [])
        self.flight.put_telemetry(self.port.poll())

    def put(self, message: Any) -> None:
        self.send(lambda mav: mav.send(message))

    def wait(self, wanted: Callable[[Any], bool], patience_s: float = PATIENCE_S) -> Any:
        """The first message from now on that is wanted; None when none comes."""
        self.station.heard.clear()
        for _ in range(round(patience_s / 0.01)):
            self.advance(0.01)
            for message in self.station.heard:
                if wanted(message):
                    return message
        return None

    def ask(self, say: Callable[[Any], None], answer: str, patience_s: float = PATIENCE_S) -> Any:
        self.send(say)
        return self.wait(lambda message: message.get_type() == answer, patience_s)

    def command(self, command: int, *param: float) -> int | None:
        """The MAV_RESULT of its answer; None when there is none."""
        values = (*param, *(7 - len(param)) * (0.0,))
        ack = self.ask(lambda mav: mav.command_long_send(1, 1, command, 0, *values), "COMMAND_ACK")
        if ack is None:
            return None
        assert ack.command == command
        assert (ack.target_system, ack.target_component) == (255, 190)
        return int(ack.result)

    def texts(self) -> list[str]:
        """What has been said since the last question, put together again."""
        found: list[str] = []
        for message in self.station.heard:
            if message.get_type() != "STATUSTEXT":
                continue
            if message.chunk_seq == 0:
                found.append(message.text)
            else:
                found[-1] += message.text
        return found

    def reach(self, state: str, patience_s: float) -> bool:
        for _ in range(round(patience_s / 0.1)):
            if self.flight.state_name == state:
                return True
            self.advance(0.1)
        return False

    def motors_on(self) -> bool:
        return self.flight.motors_on

    @property
    def height_m(self) -> float:
        return -float(self.flight.position_ned_m[2])

    def arm(self) -> None:
        result = self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
        assert result == mavlink.MAV_RESULT_ACCEPTED, self.texts()
        assert self.reach("ARMED", 1.0)


def _local(seq: int, command: int, north: float, east: float, up: float, hold: float = 0.0) -> Any:
    return mavlink.MAVLink_mission_item_int_message(
        *(1, 1, seq, mavlink.MAV_FRAME_LOCAL_NED, command, 0, 1),
        *(hold, 0.0, 0.0, math.nan, round(north * 1e4), round(east * 1e4), -up),
    )


def short_mission() -> list[Any]:
    rtl = mavlink.MAVLink_mission_item_int_message(
        *(1, 1, 3, mavlink.MAV_FRAME_MISSION, mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, 0, 1),
        *(0.0, 0.0, 0.0, 0.0, 0, 0, 0.0),
    )
    return [
        _local(0, mavlink.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0, 3.0),
        _local(1, mavlink.MAV_CMD_NAV_WAYPOINT, 4.0, -2.0, 3.5, hold=1.0),
        _local(2, mavlink.MAV_CMD_NAV_WAYPOINT, 0.0, 3.0, 2.5),
        rtl,
    ]


def upload(aircraft: Aircraft, items: list[Any]) -> int:
    """As MAVLink's mission protocol has it; the MAV_MISSION_RESULT."""
    aircraft.send(lambda mav: mav.mission_count_send(1, 1, len(items)))
    answers = ("MISSION_REQUEST_INT", "MISSION_ACK")
    for _ in range(2 * len(items)):
        message = aircraft.wait(lambda m: m.get_type() in answers)
        assert message is not None
        if message.get_type() == "MISSION_ACK":
            return int(message.type)
        aircraft.put(items[message.seq])
    raise AssertionError("the upload does not end")


@pytest.fixture(scope="module")
def ready(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Aircraft]:
    """Calibrated; tests leave it with its motors off."""
    with Aircraft(tmp_path_factory.mktemp("card")) as aircraft:
        aircraft.advance(READY_S)
        yield aircraft


@pytest.fixture
def fresh(tmp_path: Path) -> Iterator[Aircraft]:
    """Just switched on."""
    with Aircraft(tmp_path) as aircraft:
        yield aircraft


def test_a_ground_station_sees_the_aircraft(ready: Aircraft) -> None:
    ready.station.heard.clear()
    ready.advance(10.0)
    by_type: dict[str, list[Any]] = {}
    for message in ready.station.heard:
        by_type.setdefault(message.get_type(), []).append(message)
    rates_hz = {
        "HEARTBEAT": 1.0,
        "SYS_STATUS": 1.0,
        "ATTITUDE_QUATERNION": 10.0,
        "LOCAL_POSITION_NED": 5.0,
        "GLOBAL_POSITION_INT": 2.0,
        "GPS_RAW_INT": 2.0,
        "VFR_HUD": 2.0,
        "SERVO_OUTPUT_RAW": 2.0,
        "EXTENDED_SYS_STATE": 1.0,
        "HOME_POSITION": 0.5,
    }
    for name, rate_hz in rates_hz.items():
        assert len(by_type[name]) == pytest.approx(10.0 * rate_hz, abs=1.0), name
    # This aircraft measures no battery, and does not say that it is empty.
    assert "BATTERY_STATUS" not in by_type
    assert by_type["SYS_STATUS"][-1].voltage_battery == 65535
    heartbeat = by_type["HEARTBEAT"][-1]
    assert heartbeat.type == mavlink.MAV_TYPE_QUADROTOR
    assert heartbeat.autopilot == mavlink.MAV_AUTOPILOT_GENERIC
    assert heartbeat.system_status == mavlink.MAV_STATE_STANDBY
    assert heartbeat.base_mode == 0
    attitude = by_type["ATTITUDE_QUATERNION"][-1]
    found = (attitude.q1, attitude.q2, attitude.q3, attitude.q4)
    # Its noise at rest within the tenth of a second between two of them.
    assert found == pytest.approx(tuple(ready.flight.attitude), abs=2e-3)
    place = by_type["GLOBAL_POSITION_INT"][-1]
    gps = by_type["GPS_RAW_INT"][-1]
    metre = 90  # 1e-7 deg
    assert gps.lat == pytest.approx(place.lat, abs=15 * metre)  # of GPS 3 m, one sigma
    assert gps.fix_type == mavlink.GPS_FIX_TYPE_3D_FIX
    assert ready.station.link.mav.total_receive_errors == 0


def test_the_parameters_come_down_as_they_are_in_the_table(ready: Aircraft) -> None:
    ready.station.heard.clear()
    ready.send(lambda mav: mav.param_request_list_send(1, 1))
    ready.advance(5.0)
    found = {
        m.param_id: m.param_value for m in ready.station.heard if m.get_type() == "PARAM_VALUE"
    }
    table = {row.name: row.default for row in parameters()}
    assert found.keys() == table.keys()
    del found["DECLINATION"], table["DECLINATION"]  # the surroundings'
    assert found == pytest.approx(table, rel=1e-6)  # float32


def _set(ready: Aircraft, name: str, value: float) -> float:
    kind = mavlink.MAV_PARAM_TYPE_REAL32
    answer = ready.ask(
        lambda mav: mav.param_set_send(1, 1, name.encode(), value, kind), "PARAM_VALUE"
    )
    assert answer.param_id == name
    return float(answer.param_value)


def test_a_parameter_is_set_or_refused_with_its_reason(ready: Aircraft) -> None:
    assert _set(ready, "RETURN_HEIGHT", 4.0) == 4.0
    assert _set(ready, "RETURN_HEIGHT", 400.0) == 4.0
    ready.advance(0.5)
    assert any("RETURN_HEIGHT is from 1 to 100 m" in text for text in ready.texts())
    before = ready.flight.storage()
    ready.advance(5.0)  # kept without being asked to, a little later
    assert ready.flight.storage() != before
    assert _set(ready, "RETURN_HEIGHT", 3.0) == 3.0


def test_a_mission_comes_down_as_it_went_up(ready: Aircraft) -> None:
    items = short_mission()
    assert upload(ready, items) == mavlink.MAV_MISSION_ACCEPTED
    count = ready.ask(lambda mav: mav.mission_request_list_send(1, 1), "MISSION_COUNT")
    assert count.count == len(items)
    home = ready.wait(lambda m: m.get_type() == "HOME_POSITION")
    # The sphere is good to a part in 300; on these few metres to 2 cm.
    metre = 1e7 / 111_200.0
    for item in items:
        ready.put(mavlink.MAVLink_mission_request_int_message(1, 1, item.seq))
        found = ready.wait(lambda m: m.get_type() == "MISSION_ITEM_INT")
        assert (found.seq, found.command) == (item.seq, item.command)
        assert found.param1 == pytest.approx(item.param1)
        if item.command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            continue
        assert found.frame == mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
        assert found.z == pytest.approx(-item.z)
        north_m = (found.x - home.latitude) / metre
        east_m = (found.y - home.longitude) / metre * math.cos(math.radians(found.x * 1e-7))
        assert north_m == pytest.approx(item.x * 1e-4, abs=0.05)
        assert east_m == pytest.approx(item.y * 1e-4, abs=0.05)


def test_a_mission_outside_the_fence_is_refused(ready: Aircraft) -> None:
    items = short_mission()
    items[1] = _local(1, mavlink.MAV_CMD_NAV_WAYPOINT, 400.0, 0.0, 3.0)
    assert upload(ready, items) == mavlink.MAV_MISSION_INVALID
    ready.advance(0.5)
    assert any("outside the fence" in text for text in ready.texts())


def test_a_flight_by_telemetry_alone(fresh: Aircraft) -> None:
    aircraft = fresh
    arm = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
    # Not calibrated yet: refused, and told why.
    assert aircraft.command(arm, 1.0) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    aircraft.advance(1.0)
    assert any("calibration is not done" in text for text in aircraft.texts())
    assert not aircraft.motors_on()
    aircraft.advance(READY_S)
    assert upload(aircraft, short_mission()) == mavlink.MAV_MISSION_ACCEPTED
    aircraft.arm()
    assert upload(aircraft, short_mission()) == mavlink.MAV_MISSION_DENIED  # not with the motors on
    assert aircraft.command(mavlink.MAV_CMD_NAV_TAKEOFF) == mavlink.MAV_RESULT_ACCEPTED
    assert aircraft.reach("WAYPOINT", 30.0)
    assert aircraft.height_m == pytest.approx(3.0, abs=1.0)  # arrival, and the barometer's noise
    landed_state = aircraft.wait(lambda m: m.get_type() == "EXTENDED_SYS_STATE").landed_state
    assert landed_state == mavlink.MAV_LANDED_STATE_IN_AIR
    # Disarming in the air is no way to land.
    assert aircraft.command(arm, 0.0) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert aircraft.motors_on()
    assert aircraft.command(mavlink.MAV_CMD_NAV_LAND) == mavlink.MAV_RESULT_ACCEPTED
    assert aircraft.reach("LAND", 1.0)
    for _ in range(400):
        if not aircraft.motors_on():
            break
        aircraft.advance(0.1)
    assert not aircraft.motors_on()
    assert aircraft.flight.state_name == "IDLE"
    heartbeat = aircraft.wait(lambda m: m.get_type() == "HEARTBEAT")
    assert heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED == 0


def test_a_kill_in_the_air_stops_the_motors_at_once(fresh: Aircraft) -> None:
    aircraft = fresh
    aircraft.advance(READY_S)
    aircraft.arm()
    assert aircraft.command(mavlink.MAV_CMD_MISSION_START) == mavlink.MAV_RESULT_ACCEPTED
    assert aircraft.reach("TAKEOFF", 1.0)
    aircraft.advance(2.0)
    assert aircraft.height_m > 0.5
    aircraft.send(
        lambda mav: mav.command_long_send(
            1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0.0, 21196.0, 0.0, 0.0, 0.0, 0.0, 0.0
        )
    )
    # Two steps of the link, one of which handles it, and the control tick after them.
    aircraft.advance(0.01)
    assert not aircraft.motors_on()
    assert aircraft.flight.state_name == "SAFE"
    # And it stays so until the kill is taken back.
    assert aircraft.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) != 0
    aircraft.advance(1.0)
    assert not aircraft.motors_on()


def stored(size: int, key: bytes, values: dict[str, float]) -> bytes:
    """What a board keeps: two slots, of which the first is filled. ParameterStore.h."""

    def name_hash(name: str) -> int:
        value = 2166136261
        for letter in name.encode():
            value = (value ^ letter) * 16777619 % 2**32
        return value

    entries = b"".join(struct.pack("<If", name_hash(n), v) for n, v in values.items())
    checked = struct.pack("<HHI", 1, len(values), 1)
    crc = zlib.crc32(checked + key + entries)
    slot = b"STRX" + checked + struct.pack("<I", crc) + key + entries
    return slot.ljust(size // 2, b"\0") + bytes(size - size // 2)


@pytest.fixture
def signed(ready: Aircraft, tmp_path: Path) -> Iterator[Aircraft]:
    """With a key, and the parameter that asks for it."""
    storage = stored(len(ready.flight.storage()), KEY, {"MAV_SIGNED": 1.0})
    with Aircraft(tmp_path, storage) as aircraft:
        # It has no clock, so what it sends before it has heard a signature seems old: let it pass.
        aircraft.station.mav.signing.allow_unsigned_callback = lambda *_: True
        aircraft.advance(READY_S)
        yield aircraft


def test_signed_commands_alone_count_where_the_aircraft_asks_for_them(signed: Aircraft) -> None:
    arm = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
    assert signed.command(arm, 1.0) == mavlink.MAV_RESULT_DENIED
    signed.advance(0.5)
    assert any("have to be signed" in text for text in signed.texts())

    signed.station.link.setup_signing(OTHER_KEY, initial_timestamp=TODAY)
    signed.send(lambda mav: mav.command_long_send(1, 1, arm, 0, 1, 0, 0, 0, 0, 0, 0))
    signed.advance(1.0)
    assert not signed.motors_on()

    signed.station.link.setup_signing(KEY, initial_timestamp=TODAY)
    packet = _packed(signed, arm, 1.0)
    signed.flight.put_telemetry(packet)
    ack = signed.wait(lambda m: m.get_type() == "COMMAND_ACK")
    assert ack.get_signed()  # by the aircraft; pymavlink lets nothing pass that is not
    assert ack.result == mavlink.MAV_RESULT_ACCEPTED
    assert signed.motors_on()
    assert signed.command(arm, 0.0) == mavlink.MAV_RESULT_ACCEPTED
    signed.advance(0.5)
    assert not signed.motors_on()

    signed.flight.put_telemetry(packet)  # the one that armed it, heard and sent again
    signed.advance(1.0)
    assert not signed.motors_on()


def _packed(aircraft: Aircraft, command: int, param1: float) -> bytes:
    """The bytes of a command, as the station would send it now."""
    message = mavlink.MAVLink_command_long_message(1, 1, command, 0, param1, 0, 0, 0, 0, 0, 0)
    return bytes(message.pack(aircraft.station.mav))


@pytest.mark.parametrize(
    "url",
    ["", "tcp:127.0.0.1:14550", "udp:127.0.0.1", "udp::14550", "udp:127.0.0.1:x", "udp:h:99999"],
)
def test_an_address_that_is_none_is_refused_with_its_name(url: str) -> None:
    with pytest.raises(BadInput, match=r"--telemetry: expected .* found") as raised:
        UdpPort(url)
    assert "--telemetry" in str(raised.value)


def test_a_station_that_is_not_there_does_no_harm() -> None:
    station = Station()
    url = station.url
    station.close()
    with UdpPort(url) as port:
        for _ in range(10):
            port.send(b"hello")
            assert port.poll() == b""
