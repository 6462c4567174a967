"""The emulated Cortex-M7: programs run there as on a host, and instructions are counted exactly."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "m7"))

import bench
from bench import Count, Limit, complaints, parse_counts, table

from m7 import (
    BuildError,
    MissingToolError,
    Run,
    build,
    calls_outside,
    object_of,
    require_tools,
    run,
)

PREDICT = Count("predict", 18, 0, 64, 2000, 2000, 2000)
HEIGHT = Count("updateAltMeas", 18, 1, 64, 900, 890, 910)


def missing_tool() -> str:
    try:
        require_tools()
    except MissingToolError as missing:
        return str(missing)
    return ""


needs_rig = pytest.mark.skipif(bool(missing_tool()), reason=missing_tool())


def run_program(folder: Path, source: str) -> Run:
    program = folder / "program.cpp"
    program.write_text(source)
    return run(build([program], folder / "build"))


@needs_rig
def test_instructions_are_counted_exactly(tmp_path: Path) -> None:
    # Exact means exact: 1000 nops; a loop of two instructions 50000 times after one that loads its
    # counter, twice, so that the second finds everything as the first did.
    counted = run_program(
        tmp_path,
        r"""
        #include <cstdio>
        #include "InstructionCounter.h"
        int main() {
          const m7::InstructionCounter counter;
          const auto nops = [] { asm volatile(".rept 1000\n nop\n .endr"); };
          const auto loop = [] {
            asm volatile("movw r0, #50000\n 1: subs r0, #1\n bne 1b" ::: "r0", "cc");
          };
          std::printf("%lu %lu %lu %lu\n", counter.count([] {}), counter.count(nops),
                      counter.count(loop), counter.count(loop));
          return 0;
        }
        """,
    )
    assert counted == Run(0, "0 1000 100001 100001\n")


@needs_rig
def test_a_program_starts_and_ends_as_on_a_host(tmp_path: Path) -> None:
    # Initialised and zeroed data, a constructor that runs before main, double precision, a status.
    done = run_program(
        tmp_path,
        r"""
        #include <cstdio>
        namespace {
        volatile int initialised = 11;
        volatile int zeroed;
        struct Early {
          volatile int value;
          Early() : value(initialised + 2) {}
        } early;
        volatile double third = 1.0 / 3.0;
        }
        int main() {
          std::printf("%d %d %d %.16f\n", initialised, zeroed, early.value, third);
          return 42;
        }
        """,
    )
    assert done == Run(42, "11 0 13 0.3333333333333333\n")


@needs_rig
def test_a_fault_ends_the_program_and_says_so(tmp_path: Path) -> None:
    done = run_program(tmp_path, 'int main() { asm volatile("udf #0"); return 0; }\n')
    assert done == Run(99, "m7: the processor faulted\n")


@needs_rig
def test_a_warning_in_a_program_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(BuildError, match="Werror=conversion"):
        run_program(tmp_path, "int main(int n, char**) { short s = n; return s; }\n")


@needs_rig
def test_heap_and_libm_are_found_in_measured_code(tmp_path: Path) -> None:
    source = tmp_path / "program.cpp"
    source.write_text(
        "#include <cmath>\n#include <cstdlib>\n"
        "volatile float x;\n"
        "int main() { x = std::sin(x); return std::malloc(8) == nullptr ? 1 : 0; }\n"
    )
    build([source], tmp_path)
    outside = calls_outside(object_of(source, tmp_path))
    assert complaints([], {}, outside) == [
        "the measured code calls malloc",
        "the measured code calls sinf",
    ]


def test_a_missing_tool_is_named_with_its_package(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", "")
    assert bench.main() == 2
    said = capsys.readouterr().err
    assert "qemu-system-arm" in said
    assert "libnewlib-arm-none-eabi" in said


def test_a_function_past_its_budget_fails_by_name() -> None:
    # The worst call counts, 910, and 5 % are allowed: 910 / 1.05 = 866.7.
    assert (
        complaints(
            [PREDICT, HEIGHT], {PREDICT.key: Limit(2000, 2000), HEIGHT.key: Limit(800, 867)}, []
        )
        == []
    )
    (said,) = complaints(
        [PREDICT, HEIGHT], {PREDICT.key: Limit(2000, 2000), HEIGHT.key: Limit(800, 866)}, []
    )
    assert said.startswith("updateAltMeas, 18 states: 910 instructions, 5.1 % past")
    assert bench.report([said]) == 1


def test_a_budget_without_a_count_fails() -> None:
    (said,) = complaints(
        [PREDICT], {PREDICT.key: Limit(2200, 2200), ("predict", 9): Limit(560, 560)}, []
    )
    assert said == "predict, 9 states: has a budget but was not counted"


def test_every_budget_line_can_be_read_and_is_printed_beside_its_count() -> None:
    budget = bench.read_budget(bench.BUDGET)
    assert budget["predict", 18] == Limit(2200, 2200)  # issue 3, item 6
    assert budget["predict", 9].budget == 560 < budget["predict", 9].ceiling
    assert budget["updateGPSMeas", 18].budget == 4 * budget["updateAltMeas", 18].budget
    lines = table([replace(PREDICT, median=1100, min=1100, max=1100)], budget).splitlines()
    assert lines[1].split() == ["predict", "18", "1100", "-", "2200", "50", "%", "yes"]


def test_the_programs_lines_become_counts_and_a_varying_one_shows_its_range() -> None:
    text = "function,states,scalars,calls,median,min,max\nupdateAltMeas,18,1,64,900,890,910\n"
    assert parse_counts(text) == [HEIGHT]
    assert table([HEIGHT], {}).splitlines()[1].endswith("no, 890 to 910")
