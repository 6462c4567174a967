"""The same flight gives the same bits whoever compiled it, and a build that does not is found."""

from __future__ import annotations

import json
import platform
import shutil
import struct
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import written_log

sys.path.append(str(Path(__file__).parents[1] / "m7"))

import determinism
from determinism import BUILDS, Build, Flight, Outcome, Row, check, check_one, flags_of, judge
from machine_code import fused_instructions, misplaced

from m7 import BuildError, must, object_of

# Those that are quick to make and run, each compiler's most and least optimised among them; `make
# determinism` has them all.
CHECKED = [
    "g++-O0",
    "g++-O2-pattern",
    "g++-O3-native",
    "clang++-O2",
    "clang++-O3-native",
    "m7-O2",
]

# Four products and sums side by side, with signs that alternate: what a quaternion product is.
PRODUCT = """
struct Quaternion { float w, x, y, z; };
Quaternion product(const Quaternion& p, const Quaternion& q) {
  return {p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z,
          p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
          p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x,
          p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}
"""

needs_x86 = pytest.mark.skipif(platform.machine() != "x86_64", reason="fuses with x86's own names")


def has_fma() -> bool:
    cpu = Path("/proc/cpuinfo")
    return cpu.exists() and " fma " in cpu.read_text()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("determinism")


@pytest.fixture(scope="module")
def flights(folder: Path) -> list[Flight]:
    return determinism.simulated(folder)


@pytest.fixture(scope="module")
def outcomes(folder: Path, flights: list[Flight]) -> dict[str, Outcome]:
    return check([BUILDS[name] for name in CHECKED], flights, folder)


@pytest.mark.parametrize("name", CHECKED)
def test_every_tick_of_every_flight_is_the_logged_one(
    outcomes: dict[str, Outcome], name: str
) -> None:
    outcome = outcomes[name]
    if outcome.skipped:
        pytest.skip(outcome.skipped)
    assert outcome.complaints == []
    assert [(row.flight, row.states) for row in outcome.rows] == [
        ("Quad5in", 18),
        ("Quad5in", 9),
        ("UgglanQ450", 18),
        ("UgglanQ450", 9),
    ]
    for row in outcome.rows:
        assert row.verdict == "same", row
        assert row.ticks > 27_500  # 55 s at 500 Hz: Quad5in is down before the minute is over


def test_all_builds_write_the_same_log(outcomes: dict[str, Outcome]) -> None:
    assert judge(outcomes) == []


@pytest.mark.skipif(not has_fma(), reason="this processor has no fused multiply-add")
def test_fused_multiply_adds_are_told_with_time_and_field(
    folder: Path, flights: list[Flight]
) -> None:
    fused = Build("fused", "g++", ("-O2", "-march=native", "-ffp-contract=fast"))
    outcome = check_one(fused, flights[:1], folder / "fused")
    assert any("has the fused instruction vfm" in said for said in outcome.complaints)
    flown, other = outcome.rows
    for row in (flown, other):
        # Up to the end of the start-up calibration, 2 s, hardly anything is computed.
        assert row.first_s is not None
        assert 1.9 < row.first_s < 3.0
        assert row.field == "vehicle_attitude.q"
        assert row.differences > row.ticks // 2
    said = judge({"fused": outcome})
    assert any(
        sentence.startswith(f"fused, Quad5in, 18 states: {flown.differences} of {flown.ticks}")
        and sentence.endswith(f"DIFFERS at {flown.first_s:.6f} s in vehicle_attitude.q")
        for sentence in said
    )


@pytest.mark.parametrize("name", ["g++-O0", "m7-O2"])
def test_one_bit_of_one_gyro_reading_is_told_apart(
    folder: Path, flights: list[Flight], outcomes: dict[str, Outcome], name: str
) -> None:
    if outcomes[name].skipped:
        pytest.skip(outcomes[name].skipped)
    content = bytearray(flights[0].logs[18].read_bytes())
    at = imu_record(bytes(content), 20_000)
    sampled_s = struct.unpack_from("<Q", content, at)[0] * 1e-6
    content[at + 28 + 1] ^= 1  # of the gyro's x, behind two times and the accelerometer: bit 8
    damaged = folder / "bit.ulg"
    damaged.write_bytes(content)
    outcome = check_one(BUILDS[name], [Flight("bit", {18: damaged, 9: damaged})], folder / name)
    row = outcome.rows[0]
    assert row.differences > 0
    assert row.first_s is not None
    # In the next control tick, 2 ms later at most.
    assert 0.0 <= row.first_s - sampled_s <= 0.002
    assert row.field == "vehicle_attitude.q"


def imu_record(content: bytes, number: int) -> int:
    """Where the fields of one sensor_combined begin."""
    wanted = written_log.topic_ids(content)["sensor_combined"]
    position, seen = 16, 0
    for message in written_log.messages(content):
        if message[2:3] == b"D" and message[3] + 256 * message[4] == wanted:
            if seen == number:
                return position + 5
            seen += 1
        position += len(message)
    raise AssertionError("no such record")


def compiled_product(folder: Path, flags: list[str]) -> dict[str, str]:
    source = folder / "product.cpp"
    source.write_text(PRODUCT + "int main() { return 0; }\n")
    target = object_of(source, folder)
    must(["g++", *flags, "-c", str(source), "-o", str(target)])
    must(["g++", str(target), "-o", str(folder / "product")])
    return fused_instructions("g++", target, folder / "product")


@needs_x86
def test_a_vectorised_product_is_not_fused(tmp_path: Path) -> None:
    # GCC 12 makes vfmaddsub132ps of it with -ffp-contract=off alone. Nothing runs: no FMA needed.
    allowed = compiled_product(tmp_path, ["-O3", "-mfma", "-ffp-contract=fast"])
    assert any(name.startswith("vfm") for name in allowed)
    assert "product(Quaternion const&, Quaternion const&)" in allowed.values()
    ours = flags_of(Build("fma", "g++", ("-O3", "-mfma")))
    assert compiled_product(tmp_path, ours) == {}


def test_a_function_of_the_mathematical_library_is_found(tmp_path: Path) -> None:
    source = tmp_path / "program.cpp"
    source.write_text(
        "#include <cmath>\n"
        "volatile float x;\n"
        "int main() { x = std::sqrt(x); x = std::atan2(x, x); return 0; }\n"
    )
    must(["g++", "-O2", "-c", str(source), "-o", str(object_of(source, tmp_path))])
    must(["g++", str(object_of(source, tmp_path)), "-o", str(tmp_path / "program")])
    assert misplaced("g++", object_of(source, tmp_path), tmp_path / "program") == [
        "calls atan2f of the C library"
    ]


ROW = Row("g++-O2", "Quad5in", 18, 30_000, 0, "377ae7e6", "27f87f87", gap=False)


def test_the_judge_names_the_build_that_stands_alone() -> None:
    other = replace(ROW, build="m7-O2")
    assert judge({"g++-O2": Outcome([ROW]), "m7-O2": Outcome([other])}) == []
    for change in ({"log": "00000000"}, {"digest": "00000000"}, {"ticks": 29_999}):
        wrong = replace(other, **change)
        assert judge({"g++-O2": Outcome([ROW]), "m7-O2": Outcome([wrong])}) == [
            "m7-O2, Quad5in, 18 states: writes another log than g++-O2"
        ]
    assert judge({"m7-O2": Outcome([replace(other, ticks=0)])}) == [
        "m7-O2, Quad5in, 18 states: no control tick was compared"
    ]
    assert judge({"m7-O2": Outcome(complaints=["m7-O2: does not build"])}) == [
        "m7-O2: does not build"
    ]


def test_what_is_missing_is_skipped_by_name(
    folder: Path,
    flights: list[Flight],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    log = flights[0].logs[18]
    monkeypatch.setattr(determinism, "FOLDER", folder)
    monkeypatch.setenv("PATH", "")
    assert determinism.main(["--log", str(log)]) == 2
    said = capsys.readouterr()
    assert "skipped: install clang\n" in said.out
    assert "skipped: install g++\n" in said.out
    assert "gcc-arm-none-eabi" in said.out
    assert "no compiler to compare with" in said.err


def test_a_recorded_log_can_be_checked_instead(
    folder: Path,
    flights: list[Flight],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(determinism, "FOLDER", folder)
    log = tmp_path / "a flight.ulg"
    shutil.copyfile(flights[1].logs[18], log)
    before = log.read_bytes()
    assert determinism.main(["--log", str(log), "--builds", "g++-O0", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["complaints"] == []
    assert [row["flight"] for row in found["builds"]["g++-O0"]["rows"]] == ["a flight.ulg"] * 2
    assert log.read_bytes() == before
    assert determinism.main(["--log", str(tmp_path / "none.ulg")]) == 2
    assert "No such file" in capsys.readouterr().err


def test_a_program_is_made_again_only_for_other_flags_or_sources(
    folder: Path, outcomes: dict[str, Outcome], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert outcomes["g++-O0"].rows
    build = BUILDS["g++-O0"]
    commands: list[str] = []

    def noted(command: list[str]) -> str:
        commands.append(command[1])
        if command[1] != "--version":
            raise BuildError("compiles")
        return must(command)

    monkeypatch.setattr(determinism, "must", noted)
    determinism.compiled(build, folder / build.name)
    assert commands == ["--version"]
    with pytest.raises(BuildError, match="compiles"):
        determinism.compiled(replace(build, flags=("-O1",)), folder / build.name)
    monkeypatch.setattr(determinism, "sources_hash", lambda: "another")
    with pytest.raises(BuildError, match="compiles"):
        determinism.compiled(build, folder / build.name)
