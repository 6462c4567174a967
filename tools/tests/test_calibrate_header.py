"""include/Calibration.h: what is written is what the compiler and the next command read."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from strix.calibrate.header import (
    HEADER,
    MEMBERS,
    NEUTRAL,
    neutral,
    read_header,
    source_of,
    text_of,
    write_members,
)
from strix.errors import BadInput

FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)


def test_the_repositorys_own_header_reads_and_writes_back_the_same() -> None:
    text = HEADER.read_text()
    assert text_of(read_header(HEADER)) == text


@given(values=st.lists(FLOATS, min_size=9, max_size=9))
def test_every_float_comes_back_as_it_was(values: list[float]) -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "Calibration.h"
        write_members(path, {"softIron": np.array(values)}, "a test")
        back = read_header(path).values["softIron"]
    assert np.array_equal(back.astype(np.float32), np.array(values, dtype=np.float32))


def test_one_part_is_renewed_and_the_others_stay(tmp_path: Path) -> None:
    path = tmp_path / "Calibration.h"
    write_members(path, {"hardIron": np.array([1.0, 2.0, 3.0])}, "first")
    write_members(path, {"accelBias": np.array([0.1, 0.2, 0.3])}, "second")
    write_members(path, {"hardIron": np.array([4.0, 5.0, 6.0])}, "third")
    found = read_header(path)
    assert list(found.values["hardIron"]) == [4.0, 5.0, 6.0]
    assert found.sources["hardIron"] == "third"
    assert found.sources["accelBias"] == "second"
    assert found.sources["levelRotation"] == NEUTRAL
    assert np.array_equal(found.matrix("levelRotation"), np.eye(3))


def test_the_compiler_takes_it_as_constants(tmp_path: Path) -> None:
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("no g++")
    write_members(tmp_path / "Calibration.h", {"accelBias": np.array([0.5, -1e-8, 3e9])}, "x")
    checks = "".join(
        f"static_assert(sizeof(strix::kCalibration.{m.name}) == {m.size} * sizeof(float));\n"
        for m in MEMBERS
    )
    source = tmp_path / "check.cpp"
    source.write_text(
        f'#include "Calibration.h"\n{checks}'
        "static_assert(strix::kCalibration.accelBias[0] == 0.5F);\n"
        "static_assert(strix::kCalibration.accelBias[1] == -1e-8F);\n"
        "static_assert(strix::kCalibration.accelBias[2] == 3e9F);\n"
        "static_assert(strix::kCalibration.softIron[4] == 1.0F);\n"
    )
    flags = ["-std=gnu++17", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-fsyntax-only"]
    done = subprocess.run(
        [compiler, *flags, str(source)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("hardIron[3]", "hardIron[4]", "expected 'float hardIron"),
        ("0.0F, 0.0F, 0.0F};", "0.0F, 0.0F};", "accelBias: expected 3 numbers"),
        ("0.0F, 0.0F, 0.0F};", "0.0F, x, 0.0F};", "accelBias: expected 3 numbers"),
    ],
)
def test_a_damaged_header_is_refused_and_left_alone(
    before: str, after: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "Calibration.h"
    damaged = text_of(neutral()).replace(before, after, 1)
    path.write_text(damaged)
    with pytest.raises(BadInput, match=words.replace("[", r"\[")):
        write_members(path, {"hardIron": np.zeros(3)}, "x")
    assert path.read_text() == damaged


@pytest.mark.parametrize("name", ["a\nint x;.ulg", "a.ulg\\", "\x1b[31m.ulg", 99 * "a"])
def test_a_logs_name_cannot_leave_its_comment(name: str) -> None:
    source = source_of("mag", Path(name))
    assert source.isprintable()
    assert "\\" not in source
    assert len(source) < 90
