"""`make determinism`: the same flights replayed by every compiler here, bit for bit.

Flies each vehicle in simulation for 60 s (or takes a log), builds replay_flight.cpp for this
machine and for the emulated Cortex-M7 with each compiler and optimisation, and replays each flight
with both filters. Ends with status 1 if any control tick, any byte of the replay's own log or any
instruction is not what it must be, and 2 if nothing could be run. See docs/determinism.md.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import json
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

from bench import aligned
from machine_code import misplaced

import m7
from m7 import HERE, ROOT, BuildError, MissingToolError, execute, must, object_of
from strix import _core
from strix.errors import BadInput
from strix.fly import make_plan
from strix.replay import replay
from strix.simulation import fly as simulate

PROGRAM = HERE / "replay_flight.cpp"
FOLDER = ROOT / "build" / "determinism"
FLIGHT_S = 60.0
TIMEOUT_S = 900.0  # of one replay; the slowest, -O0 on the emulated processor, takes 100 s
STATES = (18, 9)


@dataclass(frozen=True)
class Build:
    """One compiler with its own flags, beside those of platformio.ini."""

    name: str
    compiler: str
    flags: tuple[str, ...]

    @property
    def emulated(self) -> bool:
        return self.compiler == m7.CXX


def _builds() -> list[Build]:
    """As differently as may be: -march=native lets a compiler use all that this machine has, and
    with `pattern` a local variable that was not set holds 0xFE or 0xAA bytes.
    """
    pattern = ("-O2", "-ftrivial-auto-var-init=pattern")
    host = {"O0": ("-O0",), "O2": ("-O2",), "O3-native": ("-O3", "-march=native")}
    builds = [
        Build(f"{compiler}-{name}", compiler, flags)
        for compiler in ("g++", "clang++")
        for name, flags in {**host, "O2-pattern": pattern}.items()
    ]
    return builds + [Build(f"m7-{level}", m7.CXX, (f"-{level}",)) for level in ("O0", "O2", "O3")]


BUILDS = {build.name: build for build in _builds()}


@dataclass(frozen=True)
class Flight:
    """A log, and the same flight over again with the filter that did not fly."""

    name: str
    logs: Mapping[int, Path]  # by number of states


@dataclass(frozen=True)
class Row:
    """One replay."""

    build: str
    flight: str
    states: int
    ticks: int  # control ticks compared
    differences: int  # of them not as logged
    digest: str  # of all ticks' hashes
    log: str  # CRC-32 of the replay's own log
    gap: bool  # stopped where the log has lost inputs
    first_s: float | None = None
    field: str = ""

    @property
    def verdict(self) -> str:
        if self.first_s is not None:
            return f"DIFFERS at {self.first_s:.6f} s in {self.field}"
        return "same, up to a gap in the log" if self.gap else "same"


@dataclass(frozen=True)
class Outcome:
    """What one build gave."""

    rows: Sequence[Row] = ()
    complaints: Sequence[str] = ()
    skipped: str = ""


def main(arguments: Sequence[str] | None = None) -> int:
    chosen = parse(arguments)
    FOLDER.mkdir(parents=True, exist_ok=True)
    try:
        flights = [recorded(chosen.log, FOLDER)] if chosen.log else simulated(FOLDER)
    except BadInput as refused:
        print(f"determinism: {refused}", file=sys.stderr)
        return 2
    builds = [BUILDS[name] for name in chosen.builds or BUILDS]
    outcomes = check(builds, flights, FOLDER)
    complaints = judge(outcomes)
    if chosen.json:
        report = {name: asdict(outcome) for name, outcome in outcomes.items()}
        print(json.dumps({"builds": report, "complaints": complaints}, indent=1))
    else:
        print(table(outcomes))
        for sentence in complaints:
            print(f"FAILED  {sentence}")
    if complaints:
        return 1
    if not any(outcome.rows for outcome in outcomes.values()):
        print("determinism: no compiler to compare with", file=sys.stderr)
        return 2
    return 0


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="determinism.py",
        description="Replays flights with several compilers and compares every control tick.",
        epilog='Example: make determinism ARGS="--builds g++-O2 m7-O2 --log out/flight.ulg"',
    )
    parser.add_argument("--builds", nargs="+", choices=list(BUILDS), metavar="BUILD", default=[])
    parser.add_argument("--log", type=Path, help="replay this log; fly nothing")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.description = f"{parser.description} Builds: {', '.join(BUILDS)}."
    return parser.parse_args(arguments)


def simulated(folder: Path) -> list[Flight]:
    """A windy minute of each vehicle, or less where it lands before."""
    flights = []
    for vehicle in _core.vehicle_names():
        progress(f"flying {vehicle} for {FLIGHT_S:.0f} s")
        log = folder / f"{vehicle}.ulg"
        plan = make_plan(vehicle, "first-flight", "wind", heading_deg=40.0, seed=1)
        simulate(plan, log, lambda _time_s, _state: None, give_up_s=FLIGHT_S)
        flights.append(Flight(vehicle, both_filters(log, folder)))
    return flights


def recorded(log: Path, folder: Path) -> Flight:
    """A log from elsewhere, which stays as it is."""
    copy = folder / "recorded.ulg"  # the emulator takes no argument with a space in it
    try:
        shutil.copyfile(log, copy)
    except OSError as error:
        raise BadInput(f"--log {log}: cannot be read: {error.strerror}") from None
    return Flight(log.name, both_filters(copy, folder))


def both_filters(log: Path, folder: Path) -> dict[int, Path]:
    """The log that flew, and one of the same inputs with the filter of 9 states."""
    nine = folder / f"{log.stem}-9-states.ulg"
    replay(log, states=9, out=nine)
    return {18: log, 9: nine}


def check(builds: Sequence[Build], flights: Sequence[Flight], folder: Path) -> dict[str, Outcome]:
    """Builds and replays, two at a time, the last first: the emulated ones take longest."""

    def one(build: Build) -> Outcome:
        outcome = check_one(build, flights, folder / build.name)
        progress(f"{build.name}: {outcome.skipped or f'{len(outcome.rows)} replays'}")
        return outcome

    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(one, builds[::-1]))[::-1]
    return {build.name: outcome for build, outcome in zip(builds, outcomes, strict=True)}


def check_one(build: Build, flights: Sequence[Flight], folder: Path) -> Outcome:
    try:
        if build.emulated:
            m7.require_tools()
        elif not shutil.which(build.compiler):
            return Outcome(skipped=f"install {build.compiler.replace('clang++', 'clang')}")
        program = compiled(build, folder)
        found = misplaced(build.compiler, object_of(PROGRAM, folder), program)
    except MissingToolError as missing:
        return Outcome(skipped=str(missing).removeprefix("please "))
    except BuildError as refused:
        return Outcome(complaints=[f"{build.name}: does not build\n{refused}"])
    rows = []
    complaints = [f"{build.name}: {sentence}" for sentence in found]
    for flight in flights:
        for states in STATES:
            status, output = run(build, program, [str(flight.logs[states]), str(states)])
            if status in (0, 1):
                rows.append(read_row(output, build.name, flight.name, states))
            else:
                complaints.append(f"{build.name}, {flight.name}: status {status}: {output.strip()}")
    return Outcome(rows, complaints)


def compiled(build: Build, folder: Path) -> Path:
    """The program, anew only if a source, a flag or the compiler is another one."""
    flags = flags_of(build)
    version = must([build.compiler, "--version"])
    key = hashlib.sha256("\n".join([sources_hash(), version, *flags]).encode()).hexdigest()
    program = folder / ("replay_flight.elf" if build.emulated else "replay_flight")
    stamp = folder / "key"
    if program.exists() and stamp.exists() and stamp.read_text() == key:
        return program
    progress(f"building {build.name}")
    folder.mkdir(parents=True, exist_ok=True)
    stamp.unlink(missing_ok=True)
    if build.emulated:
        m7.build([PROGRAM], folder, [f"-I{ROOT}/tools/strix/core"], last=last_flags(build))
    else:
        target = str(object_of(PROGRAM, folder))
        must([build.compiler, *flags, "-c", str(PROGRAM), "-o", target])
        must([build.compiler, target, "-o", str(program)])
    stamp.write_text(key)
    return program


def flags_of(build: Build) -> list[str]:
    """The aircraft's flags, but for what belongs to its processor, then the build's own."""
    common = [flag for flag in m7.compile_flags() if build.emulated or flag not in m7.PROCESSOR]
    core = f"-I{ROOT}/tools/strix/core"
    return [core, *common, *m7.include_flags(), *last_flags(build)]


def last_flags(build: Build) -> list[str]:
    """The program around the flight code, on the ground, throws."""
    return [*build.flags, "-fexceptions", "-frtti"]


@functools.cache
def sources_hash() -> str:
    """Of everything that the program is compiled from, but the compiler's own."""
    places = [ROOT / "lib", ROOT / "include", HERE, ROOT / "tools" / "strix" / "core"]
    sources = [file for place in places for file in place.rglob("*") if is_source(file)]
    total = hashlib.sha256()
    for file in sorted(sources):
        total.update(str(file.relative_to(ROOT)).encode() + b"\0" + file.read_bytes())
    return total.hexdigest()


def is_source(file: Path) -> bool:
    return file.suffix in {".h", ".def", ".cpp", ".ld"}


def run(build: Build, program: Path, arguments: Sequence[str]) -> tuple[int, str]:
    """Status and output of the program, wherever it runs."""
    if build.emulated:
        done = m7.run(program, arguments, TIMEOUT_S)
        return done.status, done.output
    # glibc fills what it allocates with 0x5A: the flight software lies there, and the emulator's
    # memory holds zeros, so a member that is never set shows up.
    try:
        ended = execute(["env", "MALLOC_PERTURB_=165", str(program), *arguments], TIMEOUT_S)
    except subprocess.TimeoutExpired:
        return 124, f"did not end within {TIMEOUT_S:g} s"
    return ended.returncode, ended.stdout


def read_row(output: str, build: str, flight: str, states: int) -> Row:
    """What replay_flight printed, a name and a value a line."""
    said = dict(line.split(" ", 1) for line in output.splitlines())
    return Row(
        build=build,
        flight=flight,
        states=states,
        ticks=int(said["ticks"]),
        differences=int(said["differences"]),
        digest=said["digest"],
        log=said["log"],
        gap=said["gap"] == "1",
        first_s=int(said["first"]) * 1e-6 if "first" in said else None,
        field=said.get("field", ""),
    )


def judge(outcomes: Mapping[str, Outcome]) -> list[str]:
    """What is wrong, one sentence each."""
    said = [sentence for outcome in outcomes.values() for sentence in outcome.complaints]
    reference: dict[tuple[str, int], Row] = {}
    for row in (row for outcome in outcomes.values() for row in outcome.rows):
        which = f"{row.build}, {row.flight}, {row.states} states"
        if row.ticks == 0:
            said.append(f"{which}: no control tick was compared")
        if row.differences:
            said.append(f"{which}: {row.differences} of {row.ticks} ticks, {row.verdict}")
            continue
        first = reference.setdefault((row.flight, row.states), row)
        # The ticks are those of the log; what else is logged has no other witness.
        if (row.ticks, row.digest, row.log) != (first.ticks, first.digest, first.log):
            said.append(f"{which}: writes another log than {first.build}")
    return said


def table(outcomes: Mapping[str, Outcome]) -> str:
    """One line a replay, or a build that could not be made."""
    lines = [("build", "flight", "states", "ticks", "differences", "digest", "log", "verdict")]
    for name, outcome in outcomes.items():
        if outcome.skipped:
            lines.append((name, "-", "-", "-", "-", "-", "-", f"skipped: {outcome.skipped}"))
        lines += [
            (
                row.build,
                row.flight,
                str(row.states),
                str(row.ticks),
                str(row.differences),
                row.digest,
                row.log,
                row.verdict,
            )
            for row in outcome.rows
        ]
    return aligned(lines)


def progress(text: str) -> None:
    print(f"determinism: {text}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
