"""The wiring diagram, drawn from the pins that the firmware is compiled with.

src/board/Pins.h and SpiBus.h are read, checked against what the Teensy's pins can do, and drawn as
SVG: each pin at its place on the board. A test compares the drawings in docs/figures with it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from strix.errors import BadInput

VARIANTS = {"i2c": "IMU on I2C", "spi": "IMU on SPI"}

# What a Teensy 4.1's pins can be (pjrc.com/store/teensy41.html).
I2C_PAIRS = {(18, 19), (17, 16), (25, 24)}  # SDA, SCL
SERIAL_PAIRS = {(0, 1), (7, 8), (15, 14), (16, 17), (21, 20), (25, 24), (28, 29), (34, 35)}
PWM_PINS = {*range(16), 18, 19, 22, 23, 24, 25, 28, 29, 33, 36, 37}
SPI_PINS = {"MOSI": 11, "MISO": 12, "clock": 13}

# What the pins are called on the board's card.
FUNCTIONS = dict(
    zip(
        (0, 1, 7, 8, 10, 11, 12, 13, 16, 17, 18, 19, 24, 25, 34, 35),
        (
            *("RX1", "TX1", "RX2", "TX2", "CS", "MOSI", "MISO", "SCK"),
            *("SCL1", "SDA1", "SDA", "SCL", "SCL2", "SDA2", "RX8", "TX8"),
        ),
        strict=True,
    )
)

# The board seen from above, USB up: both rows from the top.
LEFT_ROW = ("GND", *range(13), "3.3 V", *range(24, 33))
RIGHT_ROW = ("VIN", "GND", "3.3 V", *range(23, 12, -1), "GND", *range(41, 32, -1))

COLOURS = {
    "power": "#c62828",
    "ground": "#212121",
    "I2C data, SPI": "#1565c0",
    "clock": "#ef6c00",
    "interrupt": "#00838f",
    "serial": "#2e7d32",
    "motor pulse": "#8e24aa",
    "switch": "#6d4c41",
}


@dataclass(frozen=True)
class Pins:
    """Numbers of src/board/Pins.h and of SpiBus.h."""

    esc: tuple[int, ...]
    imu_sda: int
    imu_scl: int
    imu_data_ready: int
    slow_sda: int
    slow_scl: int
    gps_rx: int
    gps_tx: int
    radio_rx: int
    radio_tx: int
    telemetry_rx: int
    telemetry_tx: int
    arm: int
    kill: int
    start: int
    spi_select: int
    spi_mosi: int
    spi_miso: int
    spi_clock: int


def read_pins(board: Path) -> Pins:
    """The pins of a folder src/board. BadInput when one is missing or cannot be what it is for."""
    pins_h, spi_h = board / "Pins.h", board / "SpiBus.h"
    if not pins_h.is_file() or not spi_h.is_file():
        raise BadInput(f"{board}: expected the folder with Pins.h and SpiBus.h")
    text, spi = pins_h.read_text(), spi_h.read_text()

    def numbers(name: str, count: int) -> tuple[int, ...]:
        found = re.search(rf"\b{name}(?: = (\d+)|\{{([\d, ]+)\}});", text)
        values = re.findall(r"\d+", found[0][len(name) :]) if found else []
        if len(values) != count:
            raise BadInput(f"{pins_h}: expected {name} with {count} pin numbers, found {values}")
        return tuple(int(v) for v in values)

    def spi_pin(signal: str) -> int:
        found = re.search(rf"\| *(\d+) *\| *{signal} *\|", spi)
        if not found:
            raise BadInput(f"{spi_h}: expected a row '| pin | {signal} |' in its table, found none")
        return int(found[1])

    pins = Pins(
        numbers("kEsc", 4),
        *numbers("kImuBus", 2),
        *numbers("kImuDataReady", 1),
        *numbers("kSlowBus", 2),
        *numbers("kGpsRx", 1),
        *numbers("kGpsTx", 1),
        *numbers("kRadioRx", 1),
        *numbers("kRadioTx", 1),
        *numbers("kTelemetryRx", 1),
        *numbers("kTelemetryTx", 1),
        *numbers("kArmSwitch", 1),
        *numbers("kKillSwitch", 1),
        *numbers("kStartSwitch", 1),
        *(spi_pin(signal) for signal in ("chip select", "MOSI", "MISO", "clock")),
    )
    constant = re.search(r"kChipSelect = (\d+);", spi)
    if not constant or int(constant[1]) != pins.spi_select:
        raise BadInput(f"{spi_h}: expected kChipSelect = {pins.spi_select} as its table has it")
    check(pins, pins_h)
    return pins


def check(pins: Pins, source: Path) -> None:
    """BadInput for a pin with two uses, or with one that the Teensy does not have there."""

    def require(good: bool, what: str) -> None:
        if not good:
            raise BadInput(f"{source}: {what}")

    imu, slow = (pins.imu_sda, pins.imu_scl), (pins.slow_sda, pins.slow_scl)
    require(imu in I2C_PAIRS, f"expected SDA and SCL of an I2C port in kImuBus, found {imu}")
    require(slow in I2C_PAIRS, f"expected SDA and SCL of an I2C port in kSlowBus, found {slow}")
    gps, radio = (pins.gps_rx, pins.gps_tx), (pins.radio_rx, pins.radio_tx)
    telemetry = (pins.telemetry_rx, pins.telemetry_tx)
    for what, port in (("GPS", gps), ("receiver", radio), ("telemetry", telemetry)):
        require(port in SERIAL_PAIRS, f"expected a serial port's RX and TX: {what}, found {port}")
    for pin in pins.esc:
        require(pin in PWM_PINS, f"expected pins with PWM in kEsc, found {pin}")
    spi = (pins.spi_mosi, pins.spi_miso, pins.spi_clock)
    require(spi == tuple(SPI_PINS.values()), f"expected SPI on 11, 12, 13, found {spi}")
    used = [*pins.esc, *imu, pins.imu_data_ready, *slow, *gps, *radio, *telemetry]
    used += [pins.arm, pins.kill, pins.start, pins.spi_select, *spi]
    twice = sorted({pin for pin in used if used.count(pin) > 1})
    require(not twice, f"expected one use a pin, found two of {twice}")
    rows = {*LEFT_ROW, *RIGHT_ROW}
    require(rows.issuperset(used), f"expected pins at the board's edges, found {used}")


@dataclass(frozen=True)
class Motor:
    place: str  # "front left"
    turn: str  # "clockwise"


def motors_of(vehicle: str) -> list[Motor]:
    """M1 to M4 of an airframe of the flight code (include/vehicles/)."""
    from strix.vehicles import plant_numbers, vehicle_name

    return [
        Motor(
            f"{'front' if rotor.x_m > 0 else 'rear'} {'right' if rotor.y_m > 0 else 'left'}",
            "clockwise" if rotor.spin > 0 else "counter-clockwise",
        )
        for rotor in plant_numbers(vehicle_name(vehicle)).rotors
    ]


@dataclass(frozen=True)
class Wire:
    terminal: str  # as printed on the device
    kind: str  # of COLOURS
    pin: int | str | None = None  # of the Teensy; None: a stub that says where it goes
    to: str = ""  # what a stub says


@dataclass(frozen=True)
class Device:
    name: str
    notes: tuple[str, ...]
    wires: tuple[Wire, ...]
    left: bool


def power() -> tuple[Wire, Wire]:
    return Wire("VIN", "power", to="3.3 V"), Wire("GND", "ground", to="GND")


def devices(pins: Pins, motors: list[Motor], variant: str) -> list[Device]:
    """Everything around the Teensy, each side from the top in the order of its pins."""
    esc = [
        Device(
            f"ESC M{i + 1}",
            (motor.place, f"turns {motor.turn}", "10 kOhm, signal to ground"),
            (
                Wire("signal", "motor pulse", pins.esc[i]),
                Wire("ground", "ground", to="GND"),
            ),
            pins.esc[i] in LEFT_ROW,
        )
        for i, motor in enumerate(motors)
    ]
    switch = ("to ground; 1 kOhm in series,", "100 nF to ground at the pin")
    switches = [
        Device(
            name,
            (how, *switch),
            (Wire("contact", "switch", pin), Wire("contact", "ground", to="GND")),
            pin in LEFT_ROW,
        )
        for name, how, pin in (
            ("Arm switch", "closed = on", pins.arm),
            ("Kill loop", "open = KILL; locking plug", pins.kill),
            ("Start switch", "closed = on", pins.start),
        )
    ]
    gps = Device(
        "GPS, MTK3333",
        ("57600 baud", "aerial up, away from ESCs"),
        (
            *power(),
            Wire("TX", "serial", pins.gps_rx),
            Wire("RX", "serial", pins.gps_tx),
        ),
        pins.gps_rx in LEFT_ROW,
    )
    receiver = Device(
        "Radio receiver",
        ("iBUS, SBUS or CRSF", "signal not above 3.3 V"),
        (
            Wire("+", "power", to="5 V of the BEC"),
            Wire("GND", "ground", to="GND"),
            Wire("signal", "serial", pins.radio_rx),
        ),
        pins.radio_rx in LEFT_ROW,
    )
    telemetry = Device(
        "Telemetry radio",
        ("57600 baud, 3.3 V signals", "aerial away from the GPS"),
        (
            Wire("+", "power", to="5 V of the BEC"),
            Wire("GND", "ground", to="GND"),
            Wire("TX", "serial", pins.telemetry_rx),
            Wire("RX", "serial", pins.telemetry_tx),
        ),
        pins.telemetry_rx in LEFT_ROW,
    )
    supply = Device(
        "5 V regulator (BEC)",
        ("from the battery, 6S", "cut VUSB from VIN first"),
        (Wire("5 V", "power", "VIN"), Wire("GND", "ground", "GND")),
        False,
    )
    battery = Device(
        "Battery, 6S",
        ("plug it in last", "propellers off on the bench"),
        (
            Wire("+", "power", to="4 ESCs, BEC"),
            Wire("-", "ground", to="4 ESCs, BEC"),
        ),
        False,
    )
    slow = [
        Device(
            name,
            notes,
            (
                *power(),
                Wire(sda, "I2C data, SPI", pins.slow_sda),
                Wire(scl, "clock", pins.slow_scl),
            ),
            pins.slow_sda in LEFT_ROW,
        )
        for name, notes, sda, scl in (
            ("Magnetometer, LIS2MDL", ("address 0x1E", "far from battery leads"), "SDA", "SCL"),
            ("Altimeter, BMP390", ("address 0x77", "foam on its hole"), "SDI", "SCK"),
        )
    ]
    around = [receiver, telemetry, gps, imu(pins, variant)]
    around += [*esc, *switches, battery, supply, *slow]
    order: dict[int | str | None, int] = {
        pin: i for i, pin in enumerate(LEFT_ROW[1:], 1)
    }  # "GND" comes twice on the right
    order |= {pin: 100 + i for i, pin in enumerate(RIGHT_ROW) if pin != "GND"}

    def first_pin(device: Device) -> int:
        return min((order[w.pin] for w in device.wires if w.pin in order), default=0)

    return sorted(around, key=first_pin)


def imu(pins: Pins, variant: str) -> Device:
    if variant == "i2c":
        ready = Wire("INT", "interrupt", pins.imu_data_ready)
        bus = (
            Wire("SCL", "clock", pins.imu_scl),
            Wire("SDA", "I2C data, SPI", pins.imu_sda),
        )
        notes = ("address 0x68, alone on its bus", "4.7 kOhm from SDA and SCL", "to 3.3 V")
        return Device("IMU, ICM20649", notes, (*power(), ready, *bus), pins.imu_sda in LEFT_ROW)
    wires = (
        *power(),
        Wire("CS", "I2C data, SPI", pins.spi_select),
        Wire("SDA (MOSI)", "I2C data, SPI", pins.spi_mosi),
        Wire("SDO (MISO)", "I2C data, SPI", pins.spi_miso),
        Wire("SCL", "clock", to=f"pin {pins.spi_clock}"),
        Wire("INT", "interrupt", to=f"pin {pins.imu_data_ready}"),
    )
    return Device(
        "IMU, ICM20649", ("SPI, 7 MHz", "wires under 10 cm"), wires, pins.spi_select in LEFT_ROW
    )


def write_wiring(board: Path, vehicle: str, folder: Path) -> list[Path]:
    """Draw both variants in `folder`, wiring-i2c.svg and wiring-spi.svg."""
    from strix.vehicles import vehicle_name
    from strix.wiring_drawing import draw

    pins, name = read_pins(board), vehicle_name(vehicle)
    motors = motors_of(name)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for variant, title in VARIANTS.items():
        path = folder / f"wiring-{variant}.svg"
        drawing = draw(devices(pins, motors, variant), f"Strix wiring, {name}, {title}")
        path.write_text(drawing.svg("src/board"))
        written.append(path)
    return written
