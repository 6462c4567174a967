"""What the flight code takes from the libraries of compiler and C library: next to nothing."""

from __future__ import annotations

from pathlib import Path

from linked import Image, drawn_in, instructions, readable, references, symbols

# All it may take. No heap, no exception, no text conversion, and of libm only what IEEE 754 fixes
# to the last bit: others agree between two releases (sinf of newlib and glibc did over a million
# arguments), which is no promise of the next.
ALLOWED = {
    "memchr": "finds a byte",
    "memcpy": "moves bytes",
    "memcmp": "compares bytes",
    "memmove": "moves bytes",
    "memset": "sets bytes",
    "strlen": "length of a text",
    "sqrtf": "errno of a negative number; the root is the processor's vsqrt, exact by IEEE 754",
    "__ieee754_sqrtf": "of sqrtf",
    "__fdlib_version": "of sqrtf: whether it sets errno",
    "__errno": "of sqrtf: where errno is",
    "_impure_ptr": "of errno",
    "__aeabi_l2f": "64-bit integer to float, integer arithmetic (Arm RTABI32, 4.1.2)",
}


def foreign_calls(image: Image) -> list[str]:
    """Whatever the flight code calls that it may not, and what calls it."""
    sources = {row.symbol: Path(row.member).name for row in drawn_in(image.map_text)}
    own = symbols(image.object_file)
    foreign = {symbol.name for symbol in own if symbol.letter in "Uwv"} - ALLOWED.keys()
    said = [
        f"{readable(function)} refers to {readable(name)}, {sources.get(name, 'in no library')}"
        for function, names in references(image.object_file).items()
        for name in sorted(names & foreign)
    ]
    # What an allowed function takes in turn. Members that a foreign one takes are no news.
    sound = {str(image.object_file)}
    for row in drawn_in(image.map_text):
        if row.by not in sound:
            continue
        if row.symbol in ALLOWED:
            sound.add(row.member)
        elif row.by != str(image.object_file):
            said.append(f"{Path(row.by).name} refers to {row.symbol}, {Path(row.member).name}")
    said += [
        f"{readable(symbol.name)}: an object made at its first use"
        for symbol in own
        if symbol.name.startswith("_ZGV")
    ]
    return said


def double_precision(image: Image) -> dict[str, int]:
    """Double-precision instructions by function: the processor has them, but they are slower."""
    found: dict[str, int] = {}
    for instruction in instructions(image.elf):
        if ".f64" in instruction.text:
            found[instruction.function] = found.get(instruction.function, 0) + 1
    return found
