"""What the flight software takes of the processor, and that each check of it can fail."""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "m7"))

import footprint
from calls import double_precision, foreign_calls
from footprint import Footprint, complaints, size_table, stack_table, take, write_results
from linked import CALL_GRAPH, Image, instructions, link_alone
from m7_rig import needs_rig
from sizes import measure
from stack import (
    INTERRUPTS,
    STACK,
    CallGraph,
    Depth,
    StackRow,
    UnboundedStackError,
    call_graph,
    read_compiler,
    read_library,
    stack_complaints,
)

from m7 import build, must, object_of, run


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> Footprint:
    """Of the flight software as it is: built twice, and a flight of 60 s replayed."""
    return take(tmp_path_factory.mktemp("footprint"))


def linked(folder: Path, source: str, roots: tuple[str, ...] = ("loop",)) -> Image:
    program = folder / "program.cpp"
    program.write_text(source)
    return link_alone(program, folder, roots=roots)


@needs_rig
def test_the_flight_software_calls_nothing_it_may_not_and_its_stack_has_a_bound(
    taken: Footprint,
) -> None:
    assert complaints(taken) == []
    assert all(double_precision(image) == {} for image in taken.images.values())


@needs_rig
def test_the_heap_is_untouched_in_setup_and_in_every_pass_of_a_flight(taken: Footprint) -> None:
    assert taken.heap == 0
    assert complaints(replace(taken, heap=3)) == [
        "setup() and loop() called upon the heap 3 times in a flight"
    ]


@needs_rig
def test_the_stack_seen_in_flight_is_that_of_the_call_graph(taken: Footprint) -> None:
    # Less than the graph's would be sound: not every path is taken, and not all that is reserved
    # is written. But alignment, the deepest of loop(), is on every flight's way: nearly all must be
    # seen. That of setup() is what is said after a restart in flight, which this was none of.
    seen = {row.function: row for row in taken.stack if row.painted is not None}
    assert seen.keys() == {"setup", "loop"}
    for row in seen.values():
        assert row.painted is not None
        share = 0.9 if row.function == "loop" else 0.75
        assert share * row.depth.bytes <= row.painted <= row.depth.bytes


@needs_rig
def test_frames_are_those_of_the_machine_code(taken: Footprint) -> None:
    # All pushes of a function, whichever path they are on: never less than GCC's own number, and
    # the same where the function has one entry and no second push.
    image = taken.images[18]
    told, seen = CallGraph(), CallGraph()
    read_compiler(told, image.call_graph)
    read_library(seen, instructions(image.elf))
    both = told.frames.keys() & seen.frames.keys()
    assert len(both) > 40
    assert all(told.frames[name] <= seen.frames[name] for name in both)
    assert sum(told.frames[name] == seen.frames[name] for name in both) > 0.9 * len(both)


@needs_rig
@pytest.mark.parametrize("states", [18, 9])
def test_every_byte_of_the_image_belongs_to_a_library(taken: Footprint, states: int) -> None:
    # binutils' own count of the same file: text with the constants, data with its image in ROM.
    (line,) = must(["arm-none-eabi-size", str(taken.images[states].elf)]).splitlines()[1:]
    text, data, bss = (int(word) for word in line.split()[:3])
    sizes = taken.sizes[states]
    assert sizes.code.total() + sizes.constants.total() == text
    assert sizes.ram.total() == data + bss


@needs_rig
def test_a_library_has_the_bytes_that_are_its_own(taken: Footprint, tmp_path: Path) -> None:
    full, small = taken.sizes[18], taken.sizes[9]
    assert small.code["Navigation"] < full.code["Navigation"]
    assert small.ram["Navigation"] < full.ram["Navigation"]
    assert small.ram["Logger"] == full.ram["Logger"] > 0.9 * full.ram.total()  # its rings
    # One function of lib/Math in a program of its own, and nobody else's.
    alone = measure(
        linked(
            tmp_path,
            '#include "Quaternion.h"\n'
            'extern "C" void loop(const strix::Vector3f& v, strix::Quaternion& q) {\n'
            "  q = strix::quaternionExp(v);\n"
            "}\n",
        )
    )
    assert alone.code["Math"] > 0
    assert not alone.code.keys() & {"Navigation", "Sensors", "Control", "Motors", "Logger"}


@needs_rig
@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("sink = std::malloc(8);", "loop refers to malloc, libc.a(lib_a-malloc.o)"),
        ("sink = new int;", "loop refers to operator new, libstdc++.a(new_op.o)"),
        (
            "std::array<int, 3> a{}; take(a.at(count));",
            "loop refers to std::__throw_out_of_range_fmt, libstdc++.a(functexcept.o)",
        ),
        ("take(std::sin(number));", "loop refers to sinf, libm.a(lib_a-sinf.o)"),
        ('take(std::printf("%d", count));', "loop refers to printf, libc.a(lib_a-printf.o)"),
        (
            "static const Early early; take(early.value);",
            "guard variable for loop::early: an object made at its first use",
        ),
        ("take(nowhere(count));", "loop refers to nowhere, in no library"),
    ],
    ids=["malloc", "new", "throw", "sinf", "printf", "static object", "undefined"],
)
def test_what_flight_code_may_not_call_is_found_with_its_caller(
    tmp_path: Path, body: str, said: str
) -> None:
    image = linked(
        tmp_path,
        """
        #include <array>
        #include <cmath>
        #include <cstdio>
        #include <cstdlib>
        int nowhere(int);
        namespace {
        void* volatile sink;
        volatile float number;
        volatile int count;
        [[maybe_unused]] void take(float value) { number = value; }
        [[maybe_unused]] void take(int value) { count = value; }
        struct Early { int value; Early() : value(count) {} };
        }
        """
        f'extern "C" void loop() {{ {body} (void)sink; (void)number; (void)count; }}\n',
    )
    assert said in foreign_calls(image)


@needs_rig
def test_double_precision_is_counted_by_function(tmp_path: Path) -> None:
    image = linked(tmp_path, 'volatile double x; extern "C" void loop() { x = x * x + 1.0; }\n')
    assert double_precision(image) == {"loop": 2}


@needs_rig
@pytest.mark.parametrize(
    ("source", "said"),
    [
        (
            "int deeper(int n) { return n == 0 ? 1 : 3 * other(n - 1) + n; }\n"
            "int other(int n) { return 2 * deeper(n) - n; }\n"
            'extern "C" void loop() { x = deeper(x); }\n',
            "recursion: deeper > other > deeper",
        ),
        (
            'extern "C" void loop() { char text[x]; fill(text); }\n',
            "loop takes an amount of stack that varies",
        ),
        ('extern "C" void loop() { (*pointer)(x); x = 1; }\n', "loop calls through a pointer"),
        (
            "int order(const void*, const void*) { return x; }\n"
            'extern "C" void loop() { std::qsort(table, 4, 4, order); }\n',
            "qsort calls through a pointer",
        ),
        (
            'extern "C" void loop() { fill(nullptr); }\n',
            "loop calls fill, whose frame is not known",
        ),
    ],
    ids=["recursion", "variable array", "pointer", "library's pointer", "unknown"],
)
def test_a_stack_without_a_bound_is_refused_by_name(tmp_path: Path, source: str, said: str) -> None:
    image = linked(
        tmp_path,
        "#include <cstdlib>\n"
        "volatile int x;\n"
        "int table[4];\n"
        "int (*volatile pointer)(int);\n"
        "void fill(char*);\n"
        "[[gnu::noinline]] int deeper(int);\n"
        "[[gnu::noinline]] int other(int);\n" + source,
    )
    with pytest.raises(UnboundedStackError) as refused:
        call_graph(image).depth("loop")
    assert str(refused.value) == said


@needs_rig
def test_stack_and_heap_of_a_watched_call_are_seen(tmp_path: Path) -> None:
    # 800 bytes that are written all, in a function below the watched one; memory that is asked for
    # twice and given back once; and a call of malloc that nobody watches.
    program = tmp_path / "program.cpp"
    program.write_text(
        r"""
        #include <cstdio>
        #include <cstdlib>
        #include "Watch.h"
        void* volatile kept;
        volatile char letter;
        [[gnu::noinline]] void below() {
          volatile char text[800];
          for (volatile char& c : text) c = letter;
        }
        extern "C" void loop(void*) {
          below();
          kept = new int;
          kept = std::malloc(8);
          std::free(kept);
        }
        m7::PaintedStack stack;
        int main() {
          kept = std::malloc(8);
          stack.call([](void*) {}, nullptr);
          std::printf("%lu %lu ", stack.used(), m7::heapCalls);
          stack.call(loop, nullptr);
          std::printf("%lu %lu\n", stack.used(), m7::heapCalls);
        }
        """
    )
    elf = build([program], tmp_path, last=[CALL_GRAPH])
    done = run(elf)
    assert done.status == 0
    stack_before, heap_before, stack, heap = (int(word) for word in done.output.split())
    assert (stack_before, heap_before, heap) == (0, 0, 3)
    # With operator new, and so all of newlib, on the way no graph has a bound: below() alone.
    graph = call_graph(Image(object_of(program, tmp_path), elf))
    with pytest.raises(UnboundedStackError):
        graph.depth("loop")
    assert 800 <= graph.depth("_Z5belowv").bytes <= stack


def test_a_stack_that_does_not_fit_or_disagrees_fails_by_name() -> None:
    def row(static: int, painted: int | None) -> StackRow:
        return StackRow("replay", "loop", Depth(static, (("loop", static),)), painted)

    assert stack_complaints([row(3000, 3000), row(3000, 1500), row(STACK - INTERRUPTS, None)]) == []
    assert stack_complaints([row(3000, 3004)]) == [
        "loop: 3004 bytes of stack seen, 3000 in the call graph"
    ]
    assert stack_complaints([row(3000, 1496)]) == ["loop: only 1496 bytes of stack seen of 3000"]
    (said,) = stack_complaints([row(STACK - INTERRUPTS + 4, None)])
    assert said == f"{STACK + 4} bytes of stack with interrupts, and only {STACK} there"


@needs_rig
def test_tables_and_results_say_the_same(taken: Footprint, tmp_path: Path) -> None:
    write_results(tmp_path / "results.csv", taken.sizes)
    with (tmp_path / "results.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    logger = {row["states"]: row for row in rows if row["library"] == "Logger"}
    (line,) = (line for line in size_table(taken.sizes).splitlines() if line.startswith("Logger"))
    assert line.split() == [
        "Logger",
        *(logger[states][kind] for states in ("18", "9") for kind in ("code", "constants", "ram")),
    ]
    assert "ESKF::setCovariance" in stack_table(taken.stack)


def test_a_missing_tool_is_named_with_its_package(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", "")
    assert footprint.main() == 2
    assert "gcc-arm-none-eabi" in capsys.readouterr().err
