"""The Unity suites of test/ on the emulated Cortex-M7, with the results that Unity prints.

    .venv/bin/python tools/m7/suites.py                        all of them
    .venv/bin/python tools/m7/suites.py test_math test_motors  these two

The code of lib/ and of the suites is compiled as for the aircraft, warnings as errors, with what
[env:native] in platformio.ini adds for tests and with its asserts. Semihosting gives the suites the
host's files, so sim_vectors/ and docs/ are there and none is left out. One line is printed as a
suite ends, then a table and each failure. Ends with status 1 if a test failed or a suite did not
run to its end, 2 if the cross compiler, the emulator or Unity is missing.
"""

from __future__ import annotations

import argparse
import configparser
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import chdir
from dataclasses import asdict, dataclass
from pathlib import Path

from m7 import (
    CXX,
    PROCESSOR,
    ROOT,
    BuildError,
    MissingToolError,
    Run,
    build,
    must,
    require_tools,
    run,
)

RESULTS = ROOT / "build" / "m7" / "suites"
# Where PlatformIO puts Unity: from its registry, or from tools/setup/pio_offline.py.
UNITY_PLACES = (ROOT / ".pio/libdeps/native/Unity/src", ROOT / "build/pio/unity")
# On a 64-bit host Unity compares 64-bit numbers without being told to.
UNITY_64 = "-DUNITY_SUPPORT_64"
# test_navigation flies four simulated hours: 4 minutes of a core, and more where that is shared.
TIMEOUT_S = 3600.0

OUTCOMES = {"PASS": "passed", "FAIL": "failed", "IGNORE": "ignored"}
CASE = re.compile(
    r"^(?P<place>.+?:\d+):(?P<name>.+?):(?P<outcome>PASS|FAIL|IGNORE)(: (?P<text>.*))?$"
)
END = re.compile(r"^(\d+) Tests \d+ Failures \d+ Ignored", re.MULTILINE)


@dataclass(frozen=True)
class Case:
    """One test: what became of it, what it said, and file:line."""

    name: str
    outcome: str  # passed, failed, ignored
    message: str
    place: str


@dataclass(frozen=True)
class Suite:
    """One program: the tests that it ended, and why it did not end them all, if so."""

    name: str
    cases: list[Case]
    error: str
    output: str  # of the program, or of the compiler that refused it

    def count(self, outcome: str) -> int:
        return sum(case.outcome == outcome for case in self.cases)

    @property
    def good(self) -> bool:
        return not self.error and self.count("failed") == 0


def main(arguments: Sequence[str] | None = None) -> int:
    chosen = parse(arguments)
    try:
        suites = sorted(run_all(chosen.suites), key=lambda suite: suite.name)
    except MissingToolError as missing:
        print(f"suites: {missing}", file=sys.stderr)
        return 2
    if chosen.json:
        chosen.json.write_text(json.dumps([asdict(suite) for suite in suites], indent=1))
    print(f"\n{summary(suites)}")
    return 0 if all(suite.good for suite in suites) else 1


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    known = [folder.name for folder in (ROOT / "test").glob("test_*")]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("suites", nargs="*", help="names of folders in test/; without any, all")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results there, too")
    chosen = parser.parse_args(arguments)
    for name in chosen.suites:
        if name not in known:
            parser.error(f"no suite {name}; there are {', '.join(sorted(known))}")
    chosen.suites = chosen.suites or known
    return chosen


def run_all(names: Sequence[str]) -> Iterator[Suite]:
    """Build and run suites of test/, one on each core, and say how each ended."""
    require_tools()
    flags = [*test_flags(), "-isystem", str(unity_sources())]
    unity = compile_unity(flags, RESULTS)
    folders = sorted((ROOT / "test" / name for name in names), key=size, reverse=True)
    started = time.monotonic()
    # In the project's folder, as with PlatformIO: they look for sim_vectors/ there.
    with chdir(ROOT), ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = [
            pool.submit(run_suite, folder, flags, unity, RESULTS / folder.name)
            for folder in folders
        ]
        try:
            for job in as_completed(jobs):
                suite = job.result()
                told = suite.error or ", ".join(f"{suite.count(o)} {o}" for o in OUTCOMES.values())
                print(f"{time.monotonic() - started:4.0f} s  {suite.name}: {told}", flush=True)
                yield suite
        finally:
            pool.shutdown(cancel_futures=True)  # after Ctrl-C none begins any more


def size(folder: Path) -> int:
    """Bytes of source: what begins first should be what takes longest."""
    return sum(source.stat().st_size for source in folder.glob("*.cpp"))


def run_suite(
    folder: Path, flags: Sequence[str], unity: Path, target: Path, timeout_s: float = TIMEOUT_S
) -> Suite:
    """Build a folder's sources with Unity into `target`, and run what comes out."""
    try:
        sources = sorted(folder.glob("*.cpp"))
        elf = build(sources, target, flags, last=["-UNDEBUG"], link=[str(unity)])
    except BuildError as refused:
        return Suite(folder.name, [], "does not build", str(refused))
    return judge(folder.name, run(elf, timeout_s=timeout_s))


def judge(name: str, done: Run) -> Suite:
    """What a program that has ended says of its tests, believed only if it came to its end."""
    cases = parse_cases(done.output)
    last = f"after {cases[-1].name}" if cases else "before any test had"
    end = END.search(done.output)
    if done.status != 0:
        why = done.output.strip().rpartition("\n")[2] if done.status in (99, 124) else ""
        error = f"ended with status {done.status}, {last} {why}".strip()
    elif end is None:
        error = f"ended before its last test, {last}"
    elif not cases:
        error = "has no test"
    elif int(end[1]) != len(cases):
        error = f"ran {end[1]} tests but {len(cases)} said how they ended"
    else:
        error = ""
    return Suite(name, cases, error, done.output)


def parse_cases(output: str) -> list[Case]:
    """Unity's lines, file:line:test:PASS and the like, among whatever else a suite prints."""
    found = (CASE.match(line) for line in output.splitlines())
    return [
        Case(case["name"], OUTCOMES[case["outcome"]], case["text"] or "", case["place"])
        for case in found
        if case
    ]


def test_flags() -> list[str]:
    """What [env:native] compiles the suites with; paths in it begin at the project's folder."""
    ini = configparser.ConfigParser(inline_comment_prefixes=(";",), interpolation=None)
    ini.read(ROOT / "platformio.ini", encoding="utf-8")
    text = ini["env:native"]["build_flags"]
    words = text.replace("${strix.determinism}", ini["strix"]["determinism"]).split()
    flags = [f"-fmacro-prefix-map={ROOT}/=", UNITY_64]
    for before, word in zip(["", *words], words, strict=False):
        if before in ("-I", "-isystem"):
            flags.append(f"{before}{ROOT / word}")
        elif word not in ("-I", "-isystem"):
            flags.append(word)
    return flags


def unity_sources() -> Path:
    """The folder with unity.c; PlatformIO fetches it if it has not yet."""
    here = [place for place in UNITY_PLACES if (place / "unity.c").exists()]
    if not here:
        print("suites: PlatformIO is to fetch Unity", flush=True)
        fetch = [sys.executable, "tools/setup/pio.py", "pkg", "install", "-e", "native"]
        subprocess.run(fetch, cwd=ROOT, check=False)
        here = [place for place in UNITY_PLACES if (place / "unity.c").exists()]
    if not here:
        raise MissingToolError("Unity is not here; what PlatformIO said above tells why")
    return here[0]


def compile_unity(flags: Sequence[str], target: Path) -> Path:
    """Unity as an object file. It is C, and not ours to warn about."""
    target.mkdir(parents=True, exist_ok=True)
    unity = target / "unity.o"
    options = [flag for flag in flags if not flag.startswith("-std=")]
    source = str(unity_sources() / "unity.c")
    must([CXX, *PROCESSOR, *options, "-x", "c", "-c", source, "-o", str(unity)])
    return unity


def summary(suites: Sequence[Suite]) -> str:
    """A table, then what failed or was ignored and where."""
    lines = [f"{'suite':<28}{'passed':>8}{'failed':>8}{'ignored':>8}"]
    for suite in suites:
        counts = "".join(f"{suite.count(outcome):>8}" for outcome in OUTCOMES.values())
        lines.append(f"{suite.name:<28}{counts}{'  did not end' if suite.error else ''}")
    totals = (sum(suite.count(outcome) for suite in suites) for outcome in OUTCOMES.values())
    lines.append(f"{'all':<28}{''.join(f'{total:>8}' for total in totals)}")
    for suite in suites:
        lines += [
            f"{case.outcome}  {case.place}: {case.name}  {case.message}".rstrip()
            for case in suite.cases
            if case.outcome != "passed"
        ]
        if suite.error:
            lines.append(f"failed  {suite.name}: {suite.error}; its last words:")
            lines += [f"    {line}" for line in suite.output.splitlines()[-20:]]
    return "\n".join(lines)


if __name__ == "__main__":
    raise SystemExit(main())
