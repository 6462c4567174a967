"""`make test`: the Unity suites here and on the emulated Cortex-M7, the Python tests, a summary.

Runs under .venv's Python. Counts come from the reports that the runners write for machines, and
land in build/test/summary.json for .ci/run.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import asdict, dataclass, field
from xml.etree import ElementTree

from machine import ROOT, alone
from pio import run_pio

REPORTS = ROOT / "build" / "test"
SETUP = str(ROOT / "tools" / "setup" / "setup.py")
M7_SUITES = str(ROOT / "tools" / "m7" / "suites.py")

Tests = set[tuple[str, str]]  # suite and test


@dataclass
class Tally:
    passed: int = 0
    failed: list[str] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)


def main() -> int:
    shutil.rmtree(REPORTS, ignore_errors=True)  # no report of an earlier run may be counted
    REPORTS.mkdir(parents=True)
    tally = Tally()
    run_m7(tally, run_unity(tally))
    if subprocess.run([sys.executable, SETUP], check=False).returncode == 0:
        run_pytest(tally)
    else:
        tally.failed.append("strix._core: did not build, so no Python test ran")
    (REPORTS / "summary.json").write_text(json.dumps(asdict(tally), indent=1))

    print()
    for test in tally.skipped:
        print(f"skipped  {test}")
    for test in tally.failed:
        print(f"FAILED   {test}")
    print(f"{tally.passed} passed, {len(tally.failed)} failed")
    return 0 if tally.passed and not tally.failed else 1


def run_unity(tally: Tally) -> Tests:
    """@return the tests that came to an end here."""
    ended: Tests = set()
    report = REPORTS / "unity.json"
    run_pio("test", "-e", "native", "--json-output-path", str(report))
    if not report.exists():
        tally.failed.append("pio test: ended without a report")
        return ended
    for suite in json.loads(report.read_text())["test_suites"]:
        if suite["env_name"] != "native":
            continue
        if not suite["test_cases"]:
            tally.failed.append(f"{suite['test_name']}: ran no test")
        for case in suite["test_cases"]:
            # A suite that did not build or crashed has a case of its own, with an exception.
            told = case["message"] or case["exception"] or ""
            label = f"{suite['test_name']}: {case['name']} {told}".strip()
            if not case["exception"]:
                ended.add((suite["test_name"], case["name"]))
            if case["status"] == "PASSED":
                tally.passed += 1
            elif case["status"] == "SKIPPED":
                tally.skipped.append(label)
            else:
                tally.failed.append(label)
    return ended


def run_m7(tally: Tally, here: Tests) -> None:
    """@param here  every test that must have run there, too."""
    report = REPORTS / "m7.json"
    command = [sys.executable, M7_SUITES, "--json", str(report)]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode == 2:
        tally.skipped.append(f"m7 {done.stderr.strip()}")
        return
    if not report.exists():
        tally.failed.append(f"m7: ended without a report {done.stderr}")
        return
    for suite in json.loads(report.read_text()):
        for case in suite["cases"]:
            label = f"m7 {suite['name']}: {case['name']} {case['message']}".strip()
            if case["outcome"] == "passed":
                tally.passed += 1
            elif case["outcome"] == "ignored":
                tally.skipped.append(label)
            else:
                tally.failed.append(label)
        if suite["error"]:
            tally.failed.append(f"m7 {suite['name']}: {suite['error']}")
            continue
        ended = {case["name"] for case in suite["cases"]}
        tally.failed += [
            f"m7 {name}: {test} did not run there"
            for name, test in sorted(here)
            if name == suite["name"] and test not in ended
        ]


def run_pytest(tally: Tally) -> None:
    report = REPORTS / "pytest.xml"
    command = [sys.executable, "-m", "pytest", "-q", f"--junitxml={report}"]
    status = subprocess.run(command, cwd=ROOT / "tools", check=False).returncode
    failed_before = len(tally.failed)
    if report.exists():
        for case in ElementTree.parse(report).iter("testcase"):
            label = f"{case.get('classname')}: {case.get('name')}"
            outcomes = {child.tag: child.get("message", "") for child in case}
            if outcomes.keys() & {"failure", "error"}:
                tally.failed.append(label)
            elif "skipped" in outcomes:
                tally.skipped.append(f"{label} ({outcomes['skipped']})")
            else:
                tally.passed += 1
    if status != 0 and len(tally.failed) == failed_before:
        tally.failed.append(f"pytest: ended with status {status}")


if __name__ == "__main__":
    with alone("test"):
        raise SystemExit(main())
