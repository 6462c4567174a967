"""`make bench`: what is counted, estimated and allowed, and that it fails by name."""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "m7"))

import bench
import mca
from bench import Measured, legend, measure, table, write_results
from counts import Count, Limit, complaints, in_order, parse_counts, read_budget
from m7_rig import needs_rig
from mca import Estimate, EstimateError, estimate, estimates

from m7 import build, run

PREDICT = Count("predict", 18, 0, 64, 2000, 2000, 2000, 2000, 5)
HEIGHT = Count("updateAltMeas", 18, 1, 64, 900, 899, 890, 910, 9)
PUSH = Count("logIMU", 0, 0, 10, 59, 60, 59, 61, 3)


def missing_llvm() -> str:
    try:
        mca.require_tools()
    except EstimateError as missing:
        return str(missing)
    return ""


needs_llvm = pytest.mark.skipif(bool(missing_llvm()), reason=missing_llvm())


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Measured:
    return measure(tmp_path_factory.mktemp("bench"))


@needs_rig
def test_no_function_is_past_its_budget(measured: Measured) -> None:
    assert complaints(measured.counts, read_budget(bench.BUDGET)) == []


@needs_rig
@needs_llvm
def test_every_traced_function_has_an_estimate_that_the_processor_could_keep(
    measured: Measured,
) -> None:
    assert measured.no_estimates == ""
    for count in measured.counts:
        found = measured.estimates[count.key]
        # Two instructions a cycle at most; twenty cycles for each, more than for a root or a
        # division, would be a trace of something else.
        assert count.median / 2 <= found.cycles <= 20 * count.median, count.function
        assert found.left_out == (), count.function


def test_the_last_measured_state_has_the_functions_of_the_budget() -> None:
    with bench.RESULTS.open(newline="", encoding="utf-8") as file:
        last = [(row["function"], int(row["states"])) for row in csv.DictReader(file)]
    assert last == list(read_budget(bench.BUDGET))


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
    counts = [PREDICT, HEIGHT]
    allowed = {PREDICT.key: Limit(2000, 2000), HEIGHT.key: Limit(800, 867)}
    assert complaints(counts, allowed) == []
    (said,) = complaints(counts, allowed | {HEIGHT.key: Limit(800, 866)})
    assert said.startswith("updateAltMeas, 18 states: 910 instructions, 5.1 % past")
    assert bench.report([said]) == 1


def test_budget_and_counts_have_the_same_functions() -> None:
    allowed = {PREDICT.key: Limit(2200, 2200), ("predict", 9): Limit(560, 560)}
    assert complaints([PREDICT, PUSH], allowed) == [
        "predict, 9 states: has a budget but was not counted",
        "logIMU: has no budget",
    ]


def test_the_budgets_are_those_of_the_specification() -> None:
    budget = read_budget(bench.BUDGET)
    assert budget["predict", 18] == Limit(2200, 2200)  # issue 3, item 6
    assert budget["predict", 9].budget == 560 < budget["predict", 9].ceiling
    assert budget["updateGPSMeas", 18].budget == 4 * budget["updateAltMeas", 18].budget
    assert budget["loop, everything due", 18].budget == 25_000  # issue 5, item 2
    assert budget["loop, IMU only", 18].budget == 8_000


def test_the_programs_lines_become_counts() -> None:
    head = "function,states,scalars,calls,median,mean,min,max,median_call"
    lines = f'{head}\n"logIMU",0,0,10,59,60,59,61,3\nupdateAltMeas,18,1,64,900,899,890,910,9\n'
    assert parse_counts(lines) == [PUSH, HEIGHT]


def test_the_table_shows_the_worst_call_against_the_budget() -> None:
    budget = {HEIGHT.key: Limit(950, 1000)}
    measured = Measured([HEIGHT, PUSH], {HEIGHT.key: Estimate(1234, ())})
    _, height, push = table(measured, budget).splitlines()
    numbers = "18 64 900 899 890 910 950 96 % 900 1234"
    assert " ".join(height.split()) == f"updateAltMeas {numbers}"
    assert " ".join(push.split()) == "logIMU - 10 59 60 59 61 - - - -"


def test_the_results_file_is_in_the_budgets_order_and_the_same_on_every_machine(
    tmp_path: Path,
) -> None:
    budget = {PUSH.key: Limit(60, 60), HEIGHT.key: Limit(950, 1000)}
    counts = in_order([replace(PREDICT, states=7), HEIGHT, PUSH], budget)
    write_results(tmp_path / "r.csv", Measured(counts, {HEIGHT.key: Estimate(1234, ())}), budget)
    assert (tmp_path / "r.csv").read_bytes().decode() == (
        "function,states,scalars,calls,median,mean,min,max,budget,ceiling,cycles\n"
        "logIMU,0,0,10,59,60,59,61,60,60,\n"
        "updateAltMeas,18,1,64,900,899,890,910,950,1000,1234\n"
        "predict,7,0,64,2000,2000,2000,2000,,,\n"
    )


def test_without_llvm_the_estimates_say_which_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(EstimateError, match="please install") as raised:
        estimates(Path("any.elf"), [], {1: 1}, Path())
    said = legend(Measured([PUSH], {}, str(raised.value)))
    assert "none, please install" in said
    assert "llvm" in said


@needs_llvm
def test_what_llvm_mca_does_not_know_is_left_out_and_named() -> None:
    known = ["mov r0, r1", "add r0, r0, r1", "vadd.f32 s0, s0, s1"]
    assert estimate(known).left_out == ()
    # One that it cannot read, which it passes over in silence, and one that it has no model of.
    assert estimate([*known, "frobnicate r1"]).left_out == ("frobnicate r1",)
    mixed = [known[0], "frobnicate r1", known[1], "cpsid i", known[2]]
    assert estimate(mixed) == Estimate(estimate(known).cycles, (mixed[1], mixed[3]))
    said = legend(Measured([PUSH], {PUSH.key: estimate(mixed)}))
    assert said.endswith("; 2 instructions left out, unknown to llvm-mca: cpsid i, frobnicate r1")


@needs_rig
@needs_llvm
def test_an_estimate_sees_what_a_count_does_not(tmp_path: Path) -> None:
    program = tmp_path / "program.cpp"
    program.write_text(
        r"""
        #include "Counts.h"
        int twice(int x);
        [[gnu::noinline]] int twice(int x) { asm volatile(""); return 2 * x; }
        int main() {
          m7::Counts chained("chained");
          m7::Counts apart("apart");
          m7::Counts jumps("jumps");
          chained.add(m7::counter.count([] {
            asm volatile(".rept 300\n vadd.f32 s0, s0, s1\n .endr" ::: "s0");
          }));
          apart.add(m7::counter.count([] {
            asm volatile(
                ".rept 100\n vadd.f32 s0, s1, s1\n vadd.f32 s2, s1, s1\n vadd.f32 s3, s1, s1\n"
                ".endr" ::: "s0", "s2", "s3");
          }));
          jumps.add(m7::counter.count([] {
            asm volatile(
                "mov r0, #3\n 1: vcmpe.f32 s0, #0\n vmrs APSR_nzcv, fpscr\n ite hi\n"
                "addhi r1, #1\n subls r1, #1\n subs r0, #1\n cbz r0, 2f\n b 1b\n 2:"
                ::: "r0", "r1", "cc");
            return twice(1);
          }));
          m7::Counts::printHead();
          return chained.print(0) && apart.print(0) && jumps.print(0) ? 0 : 1;
        }
        """
    )
    elf = build([program], tmp_path)
    chained, apart, jumps = parse_counts(run(elf).output)
    calls = {c.median_call: c.median for c in (chained, apart, jumps)}
    assert calls.keys() == {2, 3, 4}  # the first was the counter's own
    found = estimates(elf, [], calls, tmp_path)

    assert chained.median == apart.median == 300
    # An addition's result is there after three cycles (Cortex-M7), and each takes one at least.
    assert found[2].cycles == pytest.approx(900, rel=0.05)
    assert found[3].cycles == pytest.approx(300, rel=0.05)
    # Everything of the third, a call and what `ite` skips included, is in the trace.
    assert [found[number].left_out for number in calls] == [(), (), ()]
    with pytest.raises(EstimateError, match=f"call 4: {jumps.median + 1} instructions counted"):
        estimates(elf, [], {4: jumps.median + 1}, tmp_path)
