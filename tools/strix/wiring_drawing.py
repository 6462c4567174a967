"""Where the boxes, pins and wires of the wiring diagram go (wiring.py says what they are)."""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape

from strix.wiring import COLOURS, FUNCTIONS, LEFT_ROW, RIGHT_ROW, Device

# Layout, px.
WIDTH, HEIGHT = 1240, 1010
PITCH = 33
BOARD_LEFT, BOARD_TOP, BOARD_WIDTH = 500, 110, 240
BOARD_BOTTOM = BOARD_TOP + PITCH * 24 + 14
BOX_WIDTH = 240
TERMINAL = 17  # between two terminals
FONT = 12
GLYPH = 0.62  # mean width of a character of this font, over its size


@dataclass(frozen=True)
class Label:
    """One text and the box it fills, nearly."""

    x: float
    y: float  # of the base line
    text: str
    anchor: str = "start"
    size: int = FONT
    bold: bool = False
    colour: str = "#212121"

    def box(self) -> tuple[float, float, float, float]:
        width = GLYPH * self.size * len(self.text)
        left = self.x - {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor] * width
        return left, self.y - 0.8 * self.size, left + width, self.y + 0.2 * self.size


@dataclass
class Drawing:
    shapes: list[str] = field(default_factory=list)
    labels: list[Label] = field(default_factory=list)

    def line(self, points: list[tuple[float, float]], kind: str) -> None:
        path = " ".join(f"{x:g},{y:g}" for x, y in points)
        self.shapes.append(
            f'<polyline points="{path}" fill="none" stroke="{COLOURS[kind]}" stroke-width="2"/>'
        )

    def box(self, x: float, y: float, width: float, height: float, fill: str) -> None:
        self.shapes.append(
            f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="6" '
            f'fill="{fill}" stroke="#455a64"/>'
        )

    def svg(self, source: str) -> str:
        texts = [
            f'<text x="{t.x:g}" y="{t.y:g}" font-size="{t.size}" text-anchor="{t.anchor}" '
            f'font-weight="{"bold" if t.bold else "normal"}" fill="{t.colour}">'
            f"{escape(t.text)}</text>"
            for t in self.labels
        ]
        return "\n".join(
            [
                f"<!-- Made by `strix wiring` from {source}. -->",
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
                f'width="{WIDTH}" height="{HEIGHT}" '
                'font-family="DejaVu Sans, Verdana, sans-serif">',
                f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
                *self.shapes,
                *texts,
                "</svg>",
                "",
            ]
        )


def pin_y(row: int) -> float:
    return BOARD_TOP + 24 + row * PITCH


def draw(around: list[Device], title: str) -> Drawing:
    drawing = Drawing()
    drawing.labels.append(Label(WIDTH / 2, 36, title, "middle", 20, bold=True))
    draw_board(drawing, around)
    for left in (True, False):
        draw_side(drawing, [device for device in around if device.left is left], left)
    draw_legend(drawing)
    return drawing


def draw_board(drawing: Drawing, around: list[Device]) -> None:
    drawing.box(BOARD_LEFT, BOARD_TOP, BOARD_WIDTH, BOARD_BOTTOM - BOARD_TOP, "#e8f5e9")
    middle = BOARD_LEFT + BOARD_WIDTH / 2
    drawing.box(middle - 40, BOARD_TOP - 20, 80, 34, "#cfd8dc")
    drawing.box(middle - 50, BOARD_BOTTOM - 26, 100, 34, "#cfd8dc")
    drawing.labels += [
        Label(middle, BOARD_TOP + 2, "USB", "middle"),
        Label(middle, BOARD_BOTTOM - 5, "log card", "middle"),
        Label(middle, BOARD_TOP + 172, "Teensy 4.1", "middle", 16, bold=True),
        Label(middle, BOARD_TOP + 192, "seen from above", "middle"),
    ]
    colours: dict[int | str, str] = {"3.3 V": COLOURS["power"], "GND": COLOURS["ground"]}
    stubs: dict[int | str, tuple[str, str]] = {}  # what a pin's stub says, and its kind
    for device in around:
        for wire in device.wires:
            pin = int(wire.to[4:]) if wire.to.startswith("pin ") else wire.pin
            if pin is None:
                continue
            colours[pin] = COLOURS[wire.kind]
            if wire.pin is None:
                stubs[pin] = (f"{device.name.split(',')[0]} {wire.terminal}", wire.kind)
    for row, pair in enumerate(zip(LEFT_ROW, RIGHT_ROW, strict=True)):
        for pin, x, inside in zip(
            pair, (BOARD_LEFT, BOARD_LEFT + BOARD_WIDTH), (1, -1), strict=True
        ):
            y = pin_y(row)
            unused = "#9e9e9e"
            drawing.shapes.append(
                f'<circle cx="{x:g}" cy="{y:g}" r="5" fill="{colours.get(pin, unused)}" '
                'stroke="#455a64"/>'
            )
            words = (
                [str(pin), FUNCTIONS[pin]] if pin in FUNCTIONS and pin in colours else [str(pin)]
            )
            drawing.labels.append(
                Label(
                    x + 12 * inside,
                    y + 4,
                    "  ".join(words[::inside]),
                    "start" if inside == 1 else "end",
                    bold=pin in colours,
                    colour="#212121" if pin in colours else unused,
                )
            )
            if pin in stubs:
                text, kind = stubs[pin]
                tip = x - 30 * inside
                drawing.line([(x, y), (tip, y)], kind)
                drawing.labels.append(
                    Label(tip - 5 * inside, y + 4, text, "end" if inside == 1 else "start")
                )


def box_height(device: Device) -> float:
    return 16 + TERMINAL * max(len(device.wires), 1 + len(device.notes))


def draw_side(drawing: Drawing, column: list[Device], left: bool) -> None:
    """Boxes from the top, evenly spaced; wires do not cross as both ends are in one order, but
    where two devices share a bus.
    """
    free = BOARD_BOTTOM - 60 - sum(box_height(device) for device in column)
    gap = free / max(len(column) - 1, 1)
    edge = 60 + BOX_WIDTH if left else WIDTH - 60 - BOX_WIDTH  # towards the Teensy
    out = 1 if left else -1
    row = {pin: i for i, pin in reversed(list(enumerate(LEFT_ROW if left else RIGHT_ROW)))}
    pin_x = BOARD_LEFT if left else BOARD_LEFT + BOARD_WIDTH
    y = 60.0
    for device in column:
        height = box_height(device)
        x = edge - BOX_WIDTH if left else edge
        drawing.box(x, y, BOX_WIDTH, height, "#eceff1")
        text_x = x + 10 if left else x + BOX_WIDTH - 10
        anchor = "start" if left else "end"
        drawing.labels.append(Label(text_x, y + 20, device.name, anchor, bold=True))
        for i, note in enumerate(device.notes, 1):
            drawing.labels.append(Label(text_x, y + 20 + TERMINAL * i, note, anchor, 10))
        for i, wire in enumerate(device.wires):
            wire_y = y + 16 + TERMINAL * i
            end = "end" if left else "start"
            drawing.labels.append(Label(edge - 6 * out, wire_y + 4, wire.terminal, end, 10))
            if wire.pin is None:
                tip = edge + 22 * out
                drawing.line([(edge, wire_y), (tip, wire_y)], wire.kind)
                drawing.labels.append(
                    Label(
                        tip + 4 * out,
                        wire_y + 4,
                        wire.to,
                        "start" if left else "end",
                        10,
                        colour=COLOURS[wire.kind],
                    )
                )
            else:
                to_y = pin_y(row[wire.pin])
                bends = [(edge + 64 * out, wire_y), (pin_x - 34 * out, to_y)]
                drawing.line([(edge, wire_y), *bends, (pin_x, to_y)], wire.kind)
        y += height + gap


def draw_legend(drawing: Drawing) -> None:
    x, y = 60.0, HEIGHT - 44.0
    for kind in COLOURS:
        drawing.line([(x, y), (x + 24, y)], kind)
        label = Label(x + 30, y + 4, kind, size=11)
        drawing.labels.append(label)
        x = label.box()[2] + 16
    note = (
        "3.3 V: the Teensy's 3.3 V pins, 250 mA in all. GND: one star point near the Teensy. "
        "No pin takes 5 V but VIN."
    )
    drawing.labels.append(Label(60, HEIGHT - 16, note, size=11))
