"""Flight code linked without a program around it, and what the binutils tell of the result."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from m7 import (
    CXX,
    HERE,
    LINK,
    NM,
    PROCESSOR,
    compile_flags,
    include_flags,
    must,
    object_of,
    require_tools,
)

OBJDUMP = "arm-none-eabi-objdump"
CXXFILT = "arm-none-eabi-c++filt"

ROOTS = ("construct", "setup", "loop")  # of footprint.cpp, as in src/main.cpp
LOADED = (".text", ".data", ".bss")  # the output sections of mps2-an500.ld that hold flight code

# GCC's call graph with every function's frame, in a file beside the object file.
CALL_GRAPH = "-fcallgraph-info=su"


@dataclass(frozen=True)
class Image:
    """A linked program, and what the compiler and the linker wrote beside it."""

    object_file: Path
    elf: Path

    @property
    def call_graph(self) -> str:
        return self.object_file.with_suffix(".ci").read_text()

    @property
    def map_text(self) -> str:
        return self.elf.with_suffix(".map").read_text()


@dataclass(frozen=True)
class Piece:
    """One input section as the linker placed it, or the gap before the next."""

    output: str
    name: str
    address: int
    size: int
    origin: str  # object file, or archive(member); of a gap, nothing


@dataclass(frozen=True)
class DrawnIn:
    """A member of an archive that the linker took in, for the sake of a symbol."""

    member: str  # archive(member)
    by: str  # object file or archive(member)
    symbol: str


@dataclass(frozen=True)
class Instruction:
    """One instruction, or a word of data between instructions."""

    address: int
    text: str
    function: str
    file: str  # the source of the innermost inlined function; empty without debug information


@dataclass(frozen=True)
class Symbol:
    name: str
    letter: str  # nm's type: U is undefined
    address: int
    size: int
    file: str  # where it is declared; empty without debug information


def link_alone(
    source: Path, folder: Path, flags: Sequence[str] = (), roots: Sequence[str] = ROOTS
) -> Image:
    """Compile one source as the aircraft's code is, and link what its roots reach.

    Without startup.cpp and without main: whatever is in the image, and every archive member in its
    map, is there because the flight code reaches it. What no library has stays undefined.
    """
    require_tools()
    folder.mkdir(parents=True, exist_ok=True)
    image = Image(object_of(source, folder), folder / f"{source.stem}.elf")
    options = [*flags, *compile_flags(), *include_flags(), "-g", CALL_GRAPH]
    must([CXX, *options, "-c", str(source), "-o", str(image.object_file)])
    keep = [f"-Wl,--undefined={root}" for root in roots]
    keep += [f"-Wl,--entry={roots[0]}", "-Wl,--unresolved-symbols=ignore-all"]
    keep.append("-Wl,--defsym=__dso_handle=0")  # a hidden name, which exceptions may not lack
    script = ["-T", str(HERE / "mps2-an500.ld"), "-Wl,--no-demangle"]
    script.append(f"-Wl,-Map={image.elf.with_suffix('.map')}")
    must([CXX, *PROCESSOR, str(image.object_file), *LINK, *keep, *script, "-o", str(image.elf)])
    return image


def pieces(map_text: str) -> Iterator[Piece]:
    """The input sections and gaps of the output sections that hold flight code."""
    output = ""
    for found in re.finditer(
        r"^( ?)(\.[^\s(]+|COMMON|\*fill\*)\s+0x([0-9a-f]+)\s+0x([0-9a-f]+)(?: (.*))?$",
        map_text[map_text.index("\nLinker script and memory map") :],
        re.MULTILINE,
    ):
        inner, name, address, size, origin = found.groups()
        if not inner:
            output = name
        elif output in LOADED and int(size, 16) > 0:
            yield Piece(output, name, int(address, 16), int(size, 16), (origin or "").strip())


def output_sizes(map_text: str) -> dict[str, int]:
    """Bytes of the same output sections, as the linker adds them up."""
    found = re.findall(r"^(\.\w+)\s+0x[0-9a-f]+\s+0x([0-9a-f]+)", map_text, re.MULTILINE)
    return {name: int(size, 16) for name, size in found if name in LOADED}


def drawn_in(map_text: str) -> list[DrawnIn]:
    """The archive members of the image, each after the one that asked for it."""
    listed = map_text[: map_text.index("\nLinker script and memory map")]
    found = re.findall(r"^(\S+\))\s+(\S+) \((.+)\)$", listed, re.MULTILINE)
    return [DrawnIn(*row) for row in found]


def instructions(elf: Path) -> list[Instruction]:
    """The program as machine code, in the order of addresses."""
    found = []
    function = file = ""
    for line in must([OBJDUMP, "-d", "-l", "--no-show-raw-insn", str(elf)]).splitlines():
        if name := re.fullmatch(r"[0-9a-f]+ <(.+)>:", line):
            function, file = name[1], ""
        elif place := re.match(r"(/.+):\d+(?: \(discriminator \d+\))?$", line):
            file = place[1]
        elif code := re.match(r" *([0-9a-f]+):\t(.+)", line):
            found.append(Instruction(int(code[1], 16), code[2], function, file))
    return found


def references(object_file: Path) -> dict[str, set[str]]:
    """What each function and constant of an object file refers to, by the linker's names."""
    found: dict[str, set[str]] = {}
    names: set[str] = set()
    for line in must([OBJDUMP, "-r", str(object_file)]).splitlines():
        if section := re.match(r"RELOCATION RECORDS FOR \[\.(\w+)\.(.+)\]:", line):
            # -ffunction-sections: .text.NAME, or .text.unlikely.NAME for the rare part of it.
            name = re.sub(r"^(?:unlikely|startup)\.", "", section[2])
            names = found.setdefault(name, set()) if section[1] in ("text", "rodata") else set()
        elif line.startswith("RELOCATION RECORDS"):
            names = set()  # of the debug information
        elif reference := re.match(r"[0-9a-f]+ +R_ARM_\w+ +(\S+?)(?:[+-]0x[0-9a-f]+)?$", line):
            names.add(reference[1])
    return found


def symbols(file: Path) -> list[Symbol]:
    found = []
    for line in must([NM, "-l", "-S", "--format=posix", str(file)]).splitlines():
        symbol, _, place = line.partition("\t")
        name, letter, *numbers = symbol.split()
        address, size = ([int(number, 16) for number in numbers] + [0, 0])[:2]
        found.append(Symbol(name, letter, address, size, place.rpartition(":")[0]))
    return found


def readable(name: str) -> str:
    """A linker's name as in the source, without parameters and the arguments of templates."""
    text = must([CXXFILT, "--no-params", name]).strip().replace("(anonymous namespace)::", "")
    while (shorter := re.sub(r"<[^<>]*>", "", text)) != text:
        text = shorter
    return text
