"""How deep the stack can get: the deepest path of GCC's call graph, whether it is ever taken."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from linked import Image, Instruction, instructions, readable, references, symbols

STACK = 64 * 1024  # issue 5; the Teensy gives all that is left of RAM1, four times as much

# Interrupts use the same stack. At worst each priority of the processor (i.MX RT1060: 4 bits) waits
# for the one above it: 26 words with the floating-point registers and one for alignment (Armv7-M
# manual, B1.5.7), and 256 bytes for the handler. The firmware's deepest handler, usb_isr, takes 108
# by the call graph of the whole firmware.
INTERRUPTS = 16 * (27 * 4 + 256)


class UnboundedStackError(Exception):
    """No depth can be given; the text names the function and says why."""


@dataclass(frozen=True)
class Depth:
    """The deepest path from a function: bytes, and the functions on it, each with its own frame."""

    bytes: int
    path: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class StackRow:
    """What a function of a program takes at worst, and what it took where it ran."""

    program: str
    function: str
    depth: Depth
    painted: int | None


@dataclass
class CallGraph:
    """Who calls whom, by the linker's names, and what each function takes of the stack."""

    frames: dict[str, int] = field(default_factory=dict)
    calls: dict[str, set[str]] = field(default_factory=dict)
    unbounded: dict[str, str] = field(default_factory=dict)  # why a frame has no known size
    known: dict[str, Depth] = field(default_factory=dict)

    def depth(self, function: str, callers: tuple[str, ...] = ()) -> Depth:
        """@param callers  outermost first"""
        if function in self.known:
            return self.known[function]
        if function in callers:
            circle = (*callers[callers.index(function) :], function)
            raise UnboundedStackError(f"recursion: {' > '.join(map(readable, circle))}")
        if function in self.unbounded:
            raise UnboundedStackError(f"{readable(function)} {self.unbounded[function]}")
        if function not in self.frames:
            by = readable(callers[-1]) if callers else "the program"
            raise UnboundedStackError(f"{by} calls {readable(function)}, whose frame is not known")
        below = [
            self.depth(name, (*callers, function)) for name in sorted(self.calls.get(function, ()))
        ]
        deepest = max(below, key=lambda depth: depth.bytes, default=Depth(0, ()))
        frame = self.frames[function]
        self.known[function] = Depth(frame + deepest.bytes, ((function, frame), *deepest.path))
        return self.known[function]


def call_graph(image: Image) -> CallGraph:
    """Our functions as GCC tells of them; those of a library as their instructions do."""
    graph = CallGraph()
    read_compiler(graph, image.call_graph)
    ours = {symbol.name for symbol in symbols(image.object_file) if symbol.letter != "U"}
    read_library(graph, (code for code in instructions(image.elf) if code.function not in ours))

    # A constructor may have two names for one address, of which the graph knows one.
    linked = [symbol for symbol in symbols(image.elf) if symbol.letter in "tTwW"]
    at = {symbol.address: symbol.name for symbol in linked if symbol.name in graph.frames}
    alias = {symbol.name: at[symbol.address] for symbol in linked if symbol.address in at}
    # Calls that the linker sees and GCC's graph might not; whoever takes an address may call it.
    for function, names in references(image.object_file).items():
        if function in graph.calls:
            graph.calls[function] |= {name for name in names if name in alias}
    for function, names in graph.calls.items():
        graph.calls[function] = {alias.get(name, name) for name in names}
    return graph


# A title is the linker's name, behind the source's where another source could have the same.
TITLE = r'"(?:[^":]+:)?([^"]+)"'
EDGE = re.compile(f"edge: {{ sourcename: {TITLE} targetname: {TITLE}")
NODE = re.compile(rf'node: {{ title: {TITLE} label: ".*\\n(\d+) bytes \((.+?)\)')


def read_compiler(graph: CallGraph, text: str) -> None:
    """GCC's graph (-fcallgraph-info=su): one line a function, one line a call."""
    for line in text.splitlines():
        if edge := EDGE.match(line):
            graph.calls.setdefault(edge[1], set()).add(edge[2])
            if edge[2] == "__indirect_call":
                graph.unbounded[edge[1]] = "calls through a pointer"
        elif node := NODE.match(line):
            graph.frames[node[1]] = int(node[2])
            graph.calls.setdefault(node[1], set())
            if node[3] != "static":
                graph.unbounded.setdefault(node[1], "takes an amount of stack that varies")


BRANCH = re.compile(r"(b\w*|cbn?z)(?:\.[nw])?\s+(?:\w+, )?[0-9a-f]+ <([^+>]+)")
POINTER = re.compile(r"blx\s+(?![0-9a-f]+ <)|bx\s+(?!lr)")


def read_library(graph: CallGraph, code: Iterable[Instruction]) -> None:
    """Functions that are there as machine code alone. All that one pushes anywhere counts."""
    for instruction in code:
        function = instruction.function
        calls = graph.calls.setdefault(function, set())
        pushed = bytes_pushed(instruction.text)
        graph.frames[function] = graph.frames.get(function, 0) + (pushed or 0)
        if pushed is None:
            graph.unbounded[function] = f"moves the stack by {instruction.text!r}"
        if POINTER.match(instruction.text):
            graph.unbounded[function] = "calls through a pointer"
        # A branch within a function is no call; one into another's midst may be.
        to = BRANCH.match(instruction.text)
        if to and (to[1] == "bl" or to[2] != function):
            calls.add(to[2])


def bytes_pushed(instruction: str) -> int | None:
    """What an instruction takes of the stack; None where it cannot be told."""
    operation, _, operands = instruction.partition("\t")
    operation = operation.split(".")[0]
    if operation in ("push", "vpush") or (operation in ("stmdb", "vstmdb") and "sp!" in operands):
        count = 0
        for first, last in re.findall(
            r"([a-z]+\d*)(?:-[a-z](\d+))?", operands[operands.index("{") :]
        ):
            count += int(last) - int(first[1:]) + 1 if last else 1
        return count * (8 if "{d" in operands else 4)
    if by := re.search(r"\[sp, #-(\d+)\]!", operands):
        return int(by[1])
    if operation in ("sub", "subw") and (
        by := re.fullmatch(r"sp, (?:sp, )?#(\d+)(?:\s.*)?", operands)
    ):
        return int(by[1])
    if operation in ("sub", "subw", "mov", "ldr", "bic", "and") and operands.startswith("sp,"):
        return None
    return 0


def with_interrupts(rows: Sequence[StackRow]) -> int:
    return max(row.depth.bytes for row in rows) + INTERRUPTS


def stack_complaints(rows: Sequence[StackRow]) -> list[str]:
    said = []
    for row in rows:
        static, painted = row.depth.bytes, row.painted
        if painted is None:
            continue
        if painted > static:
            said.append(
                f"{row.function}: {painted} bytes of stack seen, {static} in the call graph"
            )
        # A flight does not take every path, but it begins with the deepest: alignment.
        if 2 * painted < static:
            said.append(f"{row.function}: only {painted} bytes of stack seen of {static}")
    if with_interrupts(rows) > STACK:
        said.append(
            f"{with_interrupts(rows)} bytes of stack with interrupts, and only {STACK} there"
        )
    return said
