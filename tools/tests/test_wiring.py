"""The wiring diagram says what the firmware does, and can be read."""

from __future__ import annotations

import itertools
import re
import shutil
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from strix.errors import BadInput
from strix.wiring import VARIANTS, Pins, check, devices, motors_of, read_pins, write_wiring
from strix.wiring_drawing import HEIGHT, WIDTH, Drawing, draw

ROOT = Path(__file__).parents[2]
BOARD = ROOT / "src" / "board"


@pytest.fixture
def board(tmp_path: Path) -> Path:
    """A copy of the folder's headers, to be spoilt."""
    folder = tmp_path / "board"
    folder.mkdir()
    for name in ("Pins.h", "SpiBus.h"):
        shutil.copy(BOARD / name, folder / name)
    return folder


def spoil(path: Path, what: str, by: str) -> None:
    text = path.read_text()
    assert text.count(what) == 1
    path.write_text(text.replace(what, by))


def drawing(variant: str, vehicle: str = "Quad5in") -> Drawing:
    return draw(devices(read_pins(BOARD), motors_of(vehicle), variant), "title")


def test_the_drawings_in_the_manual_are_those_of_the_firmwares_pins(tmp_path: Path) -> None:
    for path in write_wiring(BOARD, "Quad5in", tmp_path):
        manual = ROOT / "docs" / "figures" / path.name
        assert manual.read_text() == path.read_text(), "strix wiring --out docs/figures"


def test_another_pin_in_the_firmware_is_another_drawing(board: Path, tmp_path: Path) -> None:
    spoil(board / "Pins.h", "kArmSwitch = 30;", "kArmSwitch = 24;")
    changed = write_wiring(board, "Quad5in", tmp_path)
    for path in changed:
        assert path.read_text() != (ROOT / "docs" / "figures" / path.name).read_text()


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_pin_of_the_firmware_has_a_wire_of_its_own(variant: str) -> None:
    pins = read_pins(BOARD)
    around = devices(pins, motors_of("Quad5in"), variant)
    drawn = {wire.pin for device in around for wire in device.wires}
    drawn |= {
        int(wire.to[4:]) for device in around for wire in device.wires if wire.to.startswith("pin ")
    }
    imu = {"i2c": {pins.imu_sda, pins.imu_scl}, "spi": {10, 11, 12, 13}}[variant]
    switches = {pins.arm, pins.kill, pins.start}
    rest = {pins.imu_data_ready, pins.slow_sda, pins.slow_scl, pins.gps_rx, pins.gps_tx}
    rest |= {pins.radio_rx, pins.telemetry_rx, pins.telemetry_tx}  # a receiver is not talked to
    assert drawn - {None, "VIN", "GND"} == {*pins.esc} | imu | switches | rest


def test_esc_and_motor_stand_together() -> None:
    pins = read_pins(BOARD)
    found = {
        device.name: (device.wires[0].pin, device.notes[0])
        for device in devices(pins, motors_of("Quad5in"), "i2c")
        if device.name.startswith("ESC")
    }
    places = ("front left", "front right", "rear right", "rear left")  # DESIGN.md, 5
    assert found == {f"ESC M{i + 1}": (pins.esc[i], places[i]) for i in range(4)}
    assert [motor.turn for motor in motors_of("Quad5in")][:2] == ["clockwise", "counter-clockwise"]
    assert motors_of("UgglanQ450")[0].place == "front right"


@pytest.mark.parametrize("variant", VARIANTS)
def test_no_two_labels_lie_on_each_other_nor_outside(variant: str) -> None:
    labels = drawing(variant).labels
    for one, other in itertools.combinations(labels, 2):
        a, b = one.box(), other.box()
        apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
        assert apart, f"'{one.text}' and '{other.text}'"
    for label in labels:
        left, top, right, bottom = label.box()
        assert left >= 0 and top >= 0 and right <= WIDTH and bottom <= HEIGHT, label.text


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_drawing_is_svg(variant: str) -> None:
    root = ElementTree.fromstring(drawing(variant).svg("a source"))
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    texts = {element.text for element in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {"IMU, ICM20649", "ESC M3", "Kill loop", "log card"} <= texts


@pytest.mark.parametrize(
    ("name", "what", "by", "told"),
    [
        ("Pins.h", "kKillSwitch = 31;", "kKill = 31;", r"expected kKillSwitch with 1 pin"),
        ("Pins.h", "{28, 37, 29, 36}", "{28, 37, 29}", r"expected kEsc with 4 pin numbers"),
        ("SpiBus.h", "kChipSelect = 10", "kChipSelect = 9", r"expected kChipSelect = 10"),
        ("SpiBus.h", "| MISO ", "| MOSO ", r"expected a row '\| pin \| MISO \|'"),
    ],
)
def test_a_header_that_does_not_say_it_is_refused(
    board: Path, name: str, what: str, by: str, told: str
) -> None:
    spoil(board / name, what, by)
    with pytest.raises(BadInput, match=told) as error:
        read_pins(board)
    assert str(board / name) in str(error.value)


def test_a_folder_without_the_headers_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"expected the folder with Pins\.h"):
        read_pins(tmp_path)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"imu_sda": 19, "imu_scl": 18}, "kImuBus"),
        ({"slow_scl": 22}, "kSlowBus"),
        ({"gps_rx": 8, "gps_tx": 7}, "GPS"),
        ({"radio_tx": 2}, "receiver"),
        ({"telemetry_rx": 35, "telemetry_tx": 34}, "telemetry"),
        ({"radio_rx": 34, "radio_tx": 35}, r"two of \[34, 35\]"),
        ({"esc": (28, 37, 29, 32)}, "PWM"),
        ({"spi_miso": 9}, "SPI on 11, 12, 13"),
        ({"arm": 31}, r"two of \[31\]"),
        ({"start": 45}, "at the board's edges"),
    ],
)
def test_a_pin_that_cannot_be_what_it_is_for_is_refused(
    wrong: dict[str, int | tuple[int, ...]], told: str
) -> None:
    right: Pins = read_pins(BOARD)
    check(right, BOARD / "Pins.h")
    with pytest.raises(BadInput, match=told):
        check(replace(right, **wrong), BOARD / "Pins.h")  # type: ignore[arg-type]


def test_the_manuals_table_of_pins_is_the_firmwares() -> None:
    pins = read_pins(BOARD)
    table = (ROOT / "docs" / "wiring.md").read_text()
    rows = {
        row[1].strip(): row[0].strip()
        for row in re.findall(r"^\| ([^|]+) \| ([^|]+) \|", table, re.MULTILINE)
    }
    expected = {f"ESC M{i + 1}": str(pin) for i, pin in enumerate(pins.esc)} | {
        "IMU SDA, SCL": f"{pins.imu_sda}, {pins.imu_scl}",
        "IMU INT": str(pins.imu_data_ready),
        "magnetometer and altimeter SDA, SCL": f"{pins.slow_sda}, {pins.slow_scl}",
        "GPS TX, GPS RX": f"{pins.gps_rx}, {pins.gps_tx}",
        "radio receiver": str(pins.radio_rx),
        "telemetry TX, telemetry RX": f"{pins.telemetry_rx}, {pins.telemetry_tx}",
        "arm switch": str(pins.arm),
        "kill loop": str(pins.kill),
        "start switch": str(pins.start),
        "IMU CS, MOSI, MISO, clock": (
            f"{pins.spi_select}, {pins.spi_mosi}, {pins.spi_miso}, {pins.spi_clock}"
        ),
    }
    assert {what: rows.get(what) for what in expected} == expected
