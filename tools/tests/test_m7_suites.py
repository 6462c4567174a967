"""The Unity suites on the emulated Cortex-M7: what they print, and what they fail to print."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import pytest

sys.path += [str(Path(__file__).parents[1] / folder) for folder in ("m7", "setup")]

import run_tests
import suites
from suites import Case, Suite, judge, parse_cases, run_suite, summary

from m7 import ROOT, MissingToolError, Run, require_tools

HEAD = """
#include <unity.h>
#include <cstdlib>
#include <vector>
void setUp() {}
void tearDown() {}
namespace {
void test_good() { TEST_ASSERT_EQUAL_UINT64(1ULL << 40U, (1ULL << 20U) * (1ULL << 20U)); }
"""


@pytest.fixture(scope="module")
def unity(tmp_path_factory: pytest.TempPathFactory) -> Path:
    try:
        require_tools()
        flags = [*suites.test_flags(), "-isystem", str(suites.unity_sources())]
        return suites.compile_unity(flags, tmp_path_factory.mktemp("unity"))
    except MissingToolError as missing:
        pytest.skip(str(missing))


def run_made_up(folder: Path, unity: Path, source: str, timeout_s: float = 60.0) -> Suite:
    """A suite of one file, which begins with HEAD."""
    suite = folder / "test_made_up"
    suite.mkdir()
    (suite / "test_made_up.cpp").write_text(HEAD + source)
    flags = [*suites.test_flags(), "-isystem", str(suites.unity_sources())]
    return run_suite(suite, flags, unity, folder / "build", timeout_s)


def test_a_failing_test_is_reported_with_its_message_and_place(tmp_path: Path, unity: Path) -> None:
    suite = run_made_up(
        tmp_path,
        unity,
        """
        template <int N> void test_bad() {
          #line 40
          TEST_ASSERT_EQUAL_MESSAGE(N, 4, "as on the laptop");
        }
        void test_left() { TEST_IGNORE_MESSAGE("no vectors"); }
        }
        int main() {
          UNITY_BEGIN();
          #line 50
          RUN_TEST(test_good);
          RUN_TEST(test_bad<3>);
          RUN_TEST(test_left);
          UNITY_END();
          return 0;
        }
        """,
    )
    assert suite.error == ""
    assert [(case.name, case.outcome, case.message) for case in suite.cases] == [
        ("test_good", "passed", ""),
        ("test_bad<3>", "failed", "Expected 3 Was 4. as on the laptop"),
        ("test_left", "ignored", "no vectors"),
    ]
    assert [case.place.rpartition("/")[2] for case in suite.cases][:2] == [
        "test_made_up.cpp:50",
        "test_made_up.cpp:40",
    ]
    assert not suite.good
    text = summary([suite])
    assert "test_made_up                       1       1       1\n" in text
    assert "test_made_up.cpp:40: test_bad<3>  Expected 3 Was 4. as on the laptop" in text


@pytest.mark.parametrize(
    ("does", "error"),
    [
        ('asm volatile("udf #0")', "status 99, after test_good m7: the processor faulted"),
        ("std::abort()", "ended with status 1, after test_good"),
        ("std::_Exit(0)", "ended before its last test, after test_good"),
        ('for (;;) asm volatile("")', "did not end within 5 s"),
        # Twice the memory of the machine.
        ("std::vector<char>(32U << 20U).back() = 1", "ended with status 1, after test_good"),
    ],
)
def test_a_suite_that_does_not_reach_its_end_failed(
    tmp_path: Path, unity: Path, does: str, error: str
) -> None:
    suite = run_made_up(
        tmp_path,
        unity,
        f"""
        void test_bad() {{ {does}; }}
        }}
        int main() {{
          UNITY_BEGIN();
          RUN_TEST(test_good);
          RUN_TEST(test_bad);
          UNITY_END();
          return 0;
        }}
        """,
        timeout_s=5.0,  # what ends takes 0.1 s, and how long the others take decides nothing
    )
    assert error in suite.error
    assert not suite.good
    assert "did not end" in summary([suite])


def test_asserts_hold_and_warnings_are_errors_in_a_suite(tmp_path: Path, unity: Path) -> None:
    suite = run_made_up(
        tmp_path,
        unity,
        """
        }
        #ifdef NDEBUG
        #error "no asserts"
        #endif
        int main(int n, char**) { short s = n; return s; }
        """,
    )
    assert suite.error == "does not build"
    assert "Werror=conversion" in suite.output
    assert "no asserts" not in suite.output


def test_a_suite_without_a_test_failed() -> None:
    suite = judge("test_none", Run(0, "\n-----\n0 Tests 0 Failures 0 Ignored \nOK\n"))
    assert suite.error == "has no test"


def test_a_test_whose_line_is_lost_is_missed() -> None:
    suite = judge("test_two", Run(0, "a.cpp:1:test_a:PASS\n2 Tests 0 Failures 0 Ignored \nOK\n"))
    assert suite.error == "ran 2 tests but 1 said how they ended"


def test_only_unitys_lines_are_taken_for_results() -> None:
    text = "\n".join(
        [
            "worst pass, us: 400 to compute, 40 a sector",
            "test/a/b.cpp:7:test_a:INFO: dP 1.5e-04: PASS",
            "test/a/b.cpp:8:test_b<3, int>:PASS",
            "test/a/b.cpp:9:test_c:FAIL: Expected 'x:FAIL' Was 'y'",
            "test/a/b.cpp:10:test_d:IGNORE",
            "FAIL",
        ]
    )
    assert parse_cases(text) == [
        Case("test_b<3, int>", "passed", "", "test/a/b.cpp:8"),
        Case("test_c", "failed", "Expected 'x:FAIL' Was 'y'", "test/a/b.cpp:9"),
        Case("test_d", "ignored", "", "test/a/b.cpp:10"),
    ]


def test_the_flags_for_tests_come_from_platformio_ini() -> None:
    flags = suites.test_flags()
    assert {"-DUNITY_INCLUDE_DOUBLE", "-ffp-contract=off", "-std=gnu++17"} <= set(flags)
    assert f"-I{ROOT / 'test/fakes'}" in flags
    assert f"-isystem{ROOT / 'build/mavlink'}" in flags
    assert not [flag for flag in flags if "$" in flag or not flag.startswith("-")]


def test_a_name_that_is_no_suite_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        suites.main(["test_maths"])
    assert ended.value.code == 2
    assert "no suite test_maths; there are " in capsys.readouterr().err


def test_a_missing_rig_is_said_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", "")
    assert suites.main([]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("suites: please install") and "qemu-system-arm" in line


def tally_of(
    monkeypatch: pytest.MonkeyPatch, folder: Path, status: int, said: str, found: list[Suite]
) -> run_tests.Tally:
    """What `make test` counts when the suites end so, and the host has run a and b of test_x."""

    def run(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        if found:
            Path(command[-1]).write_text(json.dumps([asdict(suite) for suite in found]))
        return subprocess.CompletedProcess(command, status, None, said)

    monkeypatch.setattr(run_tests, "REPORTS", folder)
    monkeypatch.setattr(subprocess, "run", run)
    tally = run_tests.Tally()
    run_tests.run_m7(tally, {("test_x", "test_a"), ("test_x", "test_b")})
    return tally


def test_make_test_counts_them_and_misses_what_ran_on_the_host_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    cases = [Case("test_a", "passed", "", "x:1"), Case("test_c", "failed", "Was 2", "x:2")]
    found = [Suite("test_x", cases, "", ""), Suite("test_y", [], "does not build", "")]
    tally = tally_of(monkeypatch, tmp_path, 1, "", found)
    assert tally.passed == 1
    assert tally.failed == [
        "m7 test_x: test_c Was 2",
        "m7 test_x: test_b did not run there",
        "m7 test_y: does not build",
    ]


def test_make_test_skips_them_without_a_rig_and_fails_without_results(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    tally = tally_of(monkeypatch, tmp_path, 2, "suites: please install qemu-system-arm\n", [])
    assert (tally.skipped, tally.failed) == (["m7 suites: please install qemu-system-arm"], [])
    tally = tally_of(monkeypatch, tmp_path, 1, "Traceback", [])
    assert tally.failed == ["m7: ended without a report Traceback"]
