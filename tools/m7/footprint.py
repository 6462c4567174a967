"""`make footprint`: bytes of code, constants, RAM and stack of the flight software on a Cortex-M7.

Prints them by library, writes build/footprint/results.csv, and ends with status 1 if the flight
software calls what it may not (calls.py), uses the heap or could need more stack than there is,
with 2 if the cross compiler or the emulator is missing.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from bench import aligned
from calls import double_precision, foreign_calls
from linked import CALL_GRAPH, ROOTS, Image, link_alone, readable
from sizes import Sizes, SizesDisagreeError, measure
from stack import (
    STACK,
    StackRow,
    UnboundedStackError,
    call_graph,
    stack_complaints,
    with_interrupts,
)

from m7 import HERE, ROOT, BuildError, MissingToolError, build, object_of, require_tools, run
from strix.fly import make_plan
from strix.simulation import fly

FOLDER = ROOT / "build" / "footprint"
ALONE = HERE / "footprint.cpp"
WATCH = HERE / "watch_flight.cpp"


class WatchError(Exception):
    """The watched flight did not end well; the text is what its program said."""


@dataclass(frozen=True)
class Footprint:
    images: Mapping[int, Image]  # of footprint.cpp, by the filter's states
    sizes: Mapping[int, Sizes]
    stack: Sequence[StackRow]
    heap: int  # calls of setup() and of all passes of a flight


def main() -> int:
    try:
        require_tools()
        print("footprint: building three programs, a minute", file=sys.stderr, flush=True)
        footprint = take(FOLDER)
    except MissingToolError as missing:
        print(f"footprint: {missing}", file=sys.stderr)
        return 2
    except (BuildError, SizesDisagreeError, UnboundedStackError, WatchError) as failed:
        print(f"FAILED  {failed}")
        return 1
    write_results(FOLDER / "results.csv", footprint.sizes)
    print("Bytes by library, with the 18-state and the 9-state filter\n")
    print(size_table(footprint.sizes))
    print(f"\nBytes of stack, of {STACK}\n")
    print(stack_table(footprint.stack))
    print(f"\nwith interrupts, at worst {with_interrupts(footprint.stack)}")
    print(f"double-precision instructions: {doubles(footprint.images)}")
    said = complaints(footprint)
    for sentence in said:
        print(f"FAILED  {sentence}")
    if not said:
        print("no heap, no exception, no function of libm but sqrtf; every stack has a bound")
    return 1 if said else 0


def take(folder: Path) -> Footprint:
    """Build, fly, watch and measure."""
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "flight.ulg"
    with ThreadPoolExecutor(2) as workers:
        watching = workers.submit(build_watch, folder)
        alone = {states: workers.submit(build_alone, states, folder) for states in (18, 9)}
        fly(make_plan("Quad5in", "first-flight", "calm", 0.0, 1), log, lambda *_: None)
        watch = watching.result()
        images = {states: image.result() for states, image in alone.items()}
    used = watched(watch, log)
    rows = []
    for states, image in images.items():
        graph = call_graph(image)
        program = f"alone, {states} states"
        rows += [StackRow(program, root, graph.depth(root), None) for root in ROOTS]
    graph = call_graph(watch)
    rows += [StackRow("replay", root, graph.depth(root), used[root]) for root in ("setup", "loop")]
    sizes = {states: measure(image) for states, image in images.items()}
    return Footprint(images, sizes, rows, used["heap"])


def build_alone(states: int, folder: Path) -> Image:
    return link_alone(ALONE, folder / str(states), [f"-DSTATES={states}"])


def build_watch(folder: Path) -> Image:
    # The reader of logs throws; the flight code does not.
    flags = [f"-I{ROOT / 'tools' / 'strix' / 'core'}"]
    last = ["-fexceptions", "-frtti", CALL_GRAPH]
    elf = build([WATCH], folder / "watch", flags, last)
    return Image(object_of(WATCH, folder / "watch"), elf)


def watched(image: Image, log: Path) -> dict[str, int]:
    """What watch_flight.cpp prints: a name and a number a line."""
    done = run(image.elf, [str(log)])
    if done.status != 0:
        raise WatchError(f"{image.elf.stem} ended with status {done.status}\n{done.output}")
    return {name: int(number) for name, number in map(str.split, done.output.splitlines())}


def complaints(footprint: Footprint) -> list[str]:
    """What fails the build, one sentence each."""
    said = [
        f"{states} states: {sentence}"
        for states, image in footprint.images.items()
        for sentence in foreign_calls(image)
    ]
    if footprint.heap > 0:
        said.append(f"setup() and loop() called upon the heap {footprint.heap} times in a flight")
    return said + stack_complaints(footprint.stack)


def size_table(sizes: Mapping[int, Sizes]) -> str:
    head = [f"{kind} {states}" for states in sizes for kind in ("code", "constants", "RAM")]
    rows = [("library", *head, "")]
    names = next(iter(sizes.values())).libraries()
    for name in names:
        kinds = [kind[name] for s in sizes.values() for kind in (s.code, s.constants, s.ram)]
        rows.append((name, *map(str, kinds), ""))
    totals = [kind.total() for s in sizes.values() for kind in (s.code, s.constants, s.ram)]
    return aligned([*rows, ("all", *map(str, totals), "")])


def stack_table(rows: Sequence[StackRow]) -> str:
    table = [("program", "function", "static", "painted", "deepest path")]
    for row in rows:
        names = [(readable(name).removeprefix("strix::"), frame) for name, frame in row.depth.path]
        path = " > ".join(f"{name} {frame}" for name, frame in names if frame > 0)
        painted = "-" if row.painted is None else str(row.painted)
        table.append((row.program, row.function, str(row.depth.bytes), painted, path))
    return aligned(table)


def doubles(images: Mapping[int, Image]) -> str:
    found = {
        name: count for image in images.values() for name, count in double_precision(image).items()
    }
    return ", ".join(f"{readable(name)} {count}" for name, count in found.items()) or "none"


def write_results(path: Path, sizes: Mapping[int, Sizes]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("states", "library", "code", "constants", "ram"))
        for states, taken in sizes.items():
            for name in taken.libraries():
                kinds = (taken.code[name], taken.constants[name], taken.ram[name])
                writer.writerow((states, name, *kinds))


if __name__ == "__main__":
    raise SystemExit(main())
