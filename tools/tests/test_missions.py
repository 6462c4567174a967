"""Missions as text: found by name, read by the flight code, refused with their line."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from strix.errors import BadInput
from strix.missions import FOLDER, find_mission, parse_mission, read_mission

TAKEOFF = "takeoff 2 1\n"


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "mission.txt"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_a_mission_says_what_its_file_says(tmp_path: Path) -> None:
    text = "takeoff 2.5 1\r\nleg 5 -3 2 90 1.5\r\nspeed 2\r\nleg 10 0 3 -45 0 1\r\n"
    text += "attitude 30 -20 10 0.5\r\nhome\r\n"
    mission = read_mission(written(tmp_path, text))
    assert (mission.name, mission.end, mission.stand_angle_rad) == ("mission", "home", 0.0)
    assert (mission.takeoff_height_m, mission.takeoff_hold_s) == (2.5, 1.0)
    stop, through, attitude = mission.items
    assert (stop.kind, stop.north_m, stop.east_m, stop.height_m) == ("leg", 5.0, -3.0, 2.0)
    assert (stop.hold_s, stop.radius_m, stop.speed_m_s) == (1.5, 0.0, 0.0)
    assert stop.turn_rad == pytest.approx(math.pi / 2)
    assert (through.hold_s, through.radius_m, through.speed_m_s) == (0.0, 1.0, 2.0)
    assert attitude.kind == "attitude"
    assert math.degrees(attitude.roll_rad) == pytest.approx(30.0)
    assert math.degrees(attitude.pitch_rad) == pytest.approx(-20.0)
    assert math.degrees(attitude.turn_rad) == pytest.approx(10.0)
    assert mission.text == text


def test_the_flight_codes_own_mission_is_found_by_name() -> None:
    mission = find_mission("first-flight")
    assert [(i.north_m, i.east_m, i.height_m) for i in mission.items] == [
        (5.0, 3.0, 2.0),
        (5.0, 3.0, 2.0),
        (0.0, 0.0, 2.0),
    ]


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.txt")), ids=lambda path: path.stem)
def test_each_example_is_found_by_name_and_by_its_path(path: Path) -> None:
    mission = find_mission(path.stem)
    assert mission == find_mission(str(path))
    assert mission.name == path.stem


def test_the_examples_are_those_that_the_scenarios_fly() -> None:
    assert {path.stem for path in FOLDER.glob("*.txt")} >= {
        "square",
        "step",
        "aggressive",
        "stand-15",
        "stand-30",
    }
    assert math.degrees(find_mission("stand-15").stand_angle_rad) == pytest.approx(15.0)
    assert math.degrees(find_mission("stand-30").stand_angle_rad) == pytest.approx(30.0)


def test_attitudes_of_the_aggressive_mission_cancel_until_the_next_leg() -> None:
    tilt_s = [0.0, 0.0]
    for item in find_mission("aggressive").items:
        if item.kind == "leg":
            assert tilt_s == pytest.approx([0.0, 0.0], abs=1e-6)
            continue
        tilt_s[0] += item.roll_rad * item.hold_s
        tilt_s[1] += item.pitch_rad * item.hold_s
        assert math.degrees(max(abs(item.roll_rad), abs(item.pitch_rad))) == pytest.approx(30.0)


def test_an_unknown_name_is_answered_with_those_there_are() -> None:
    with pytest.raises(BadInput) as caught:
        find_mission("triangle")
    assert str(caught.value).startswith("--mission: expected a file or one of first-flight, ")
    assert "square" in str(caught.value)
    assert str(caught.value).endswith("found 'triangle'")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", ": expected a line 'takeoff HEIGHT_M HOLD_S' or 'stand ANGLE_DEG', found none"),
        ("leg 1 2 3 0 1", ", line 1: expected 'takeoff HEIGHT_M HOLD_S' first, found 'leg'"),
        ("takeoff 2", ", line 1: expected 'takeoff HEIGHT_M HOLD_S', found 1 numbers"),
        (TAKEOFF + "leg 1 2 x 0 1", ", line 2, HEIGHT_M: expected a number, found 'x'"),
        (TAKEOFF + "leg 99 2 3 0 1", ", line 2, NORTH_M: expected -30 to 30 m, found '99'"),
        ("#" * 5000, ": expected at most 4096 bytes, found more"),
    ],
)
def test_a_wrong_file_is_told_with_its_line(text: str, told: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)
    with pytest.raises(BadInput) as caught:
        find_mission(str(path))
    assert str(caught.value) == f"{path}{told}"


def test_a_file_that_is_no_text_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, b"takeoff 2 1 # \xff\n")
    with pytest.raises(BadInput, match="cannot be read as text"):
        find_mission(str(path))


def test_characters_beyond_ascii_are_told_too() -> None:
    with pytest.raises(BadInput) as caught:
        parse_mission("name", "flieg höher", "here")
    assert str(caught.value).startswith("here, line 1: expected 'takeoff', 'leg', ")
    assert str(caught.value).endswith("found 'flieg'")
    with pytest.raises(BadInput, match=r"found 'h\?\?her'"):
        parse_mission("name", "höher", "here")


def test_a_null_byte_does_not_end_the_text() -> None:
    with pytest.raises(BadInput, match=r"line 2: .* found '\?'"):
        parse_mission("name", "takeoff 2 1\n\0\n", "here")
