"""How many bytes each library has in an image of footprint.cpp: code, constants and RAM."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from linked import Image, Piece, Symbol, instructions, output_sizes, pieces, readable, symbols

from m7 import ROOT

# Rows that are no library.
PROGRAM = "footprint.cpp"  # the board without devices, and three calls
TEXTS = "texts"  # string literals: the linker merges those of all files
GAPS = "alignment"
UNPLACED = "unplaced"  # constants without a name, or whose place nobody knows

# Where FlightSoftware lies, and what the libraries have of it: names in footprint.cpp.
MEMORY = "memory"
PART = "partOf"


@dataclass
class Sizes:
    """Bytes by library."""

    code: Counter[str] = field(default_factory=Counter)
    constants: Counter[str] = field(default_factory=Counter)
    ram: Counter[str] = field(default_factory=Counter)

    def libraries(self) -> list[str]:
        """Ours, then those of others, then what is no library."""
        last = (TEXTS, UNPLACED, GAPS, PROGRAM)
        ours = {"include", *(folder.name for folder in (ROOT / "lib").iterdir())}

        def place(row: str) -> tuple[int, int, str]:
            return row not in ours, last.index(row) + 1 if row in last else 0, row.lower()

        return sorted({*self.code, *self.constants, *self.ram}, key=place)


class SizesDisagreeError(Exception):
    """The pieces do not add up to what the linker says."""


def measure(image: Image) -> Sizes:
    """Every byte of the image, given to the library it is from.

    An instruction belongs to the source file of the innermost function inlined there, the words of
    data behind a function to that of its last instruction.
    """
    sizes = Sizes()
    code = instructions(image.elf)
    addresses = [instruction.address for instruction in code]
    named = {symbol.address: symbol for symbol in symbols(image.elf)}
    for piece in pieces(image.map_text):
        if piece.output != ".text":
            share(sizes.ram, piece, image)
        elif piece.origin != str(image.object_file):
            kind = sizes.constants if piece.name.startswith(".rodata") else sizes.code
            kind[archive(piece)] += piece.size
        elif re.search(r"\.str\d+\.\d+$", piece.name):
            sizes.constants[TEXTS] += piece.size
        elif piece.name.startswith(".rodata"):
            sizes.constants[library_of_constant(named.get(piece.address))] += piece.size
        else:
            end = piece.address + piece.size
            for at in range(bisect_left(addresses, piece.address), bisect_left(addresses, end)):
                after = addresses[at + 1] if at + 1 < len(code) else end
                sizes.code[library_of(code[at].file)] += min(after, end) - addresses[at]
    said = output_sizes(image.map_text)
    found = (sizes.code.total() + sizes.constants.total(), sizes.ram.total())
    if found != (said[".text"], said[".data"] + said[".bss"]):
        raise SizesDisagreeError(f"{found} bytes of ROM and RAM, but the linker's map has {said}")
    return sizes


def share(ram: Counter[str], piece: Piece, image: Image) -> None:
    """A piece of RAM; that of FlightSoftware is shared among the libraries that it is made of."""
    if piece.origin != str(image.object_file):
        ram[archive(piece)] += piece.size
        return
    if MEMORY not in piece.name:
        ram[PROGRAM] += piece.size
        return
    parts = {
        symbol.name.removeprefix(PART): symbol.size
        for symbol in symbols(image.object_file)
        if symbol.name.startswith(PART)
    }
    ram.update(parts)
    ram["FlightSoftware"] += piece.size - sum(parts.values())


def archive(piece: Piece) -> str:
    """Its name: .../libc.a(lib_a-memcpy.o) is from libc."""
    return Path(piece.origin.partition("(")[0]).stem if piece.origin else GAPS


def library_of(file: str) -> str:
    path = Path(file)
    if path.is_relative_to(ROOT / "lib"):
        return path.relative_to(ROOT / "lib").parts[0]
    if path.is_relative_to(ROOT / "include"):
        return "include"
    if "eigen3" in path.parts:
        return "Eigen"
    return "libstdc++" if "c++" in path.parts else PROGRAM


def library_of_constant(symbol: Symbol | None) -> str:
    """A class's own constant has no place in nm's list, but the class a header of its name."""
    if symbol is None:
        return UNPLACED
    if symbol.file:
        return library_of(symbol.file)
    *_, owner, _name = ("", *readable(symbol.name).split("::"))
    headers = [str(header) for header in (ROOT / "lib").glob(f"*/{owner}.h")]
    return library_of(headers[0]) if headers else UNPLACED
