"""The emulated Cortex-M7: programs run there as on a host, and instructions are counted exactly."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "m7"))

from m7_rig import needs_rig

from m7 import BuildError, Run, build, run


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
