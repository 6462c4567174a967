"""What the compiled flight code must not have, whether a flight comes by it or not."""

from __future__ import annotations

import re
from pathlib import Path

from m7 import CXX, NM, must

# All that flight code on this machine may take from the mathematical library: sqrtf sets errno for
# a negative number; the root itself is the processor's, which IEEE 754 wants correctly rounded.
ALLOWED_LIBM = {"sqrtf"}

# Fused multiply-adds of x86 (vfmadd132ss, vfmaddsub132ps, ...), Arm M-profile (vfma.f32, vfnms.f64,
# ...) and AArch64 (fmadd, fmla, fcmla, ...): they round once where the source rounds twice.
FUSED = re.compile(r"\t(v?f(?:n?m(?:add|sub)|n?m[as]\b|ml[as]\b|cmla\b)\S*)")


def misplaced(compiler: str, object_file: Path, program: Path) -> list[str]:
    """One sentence for each thing that is in an object file and must not be.

    @param program  what was linked from it
    """
    said = [
        f"{function} has the fused instruction {name}"
        for name, function in fused_instructions(compiler, object_file, program).items()
    ]
    if compiler != CXX:
        taken = libm_calls(compiler, object_file) - ALLOWED_LIBM
        said += [f"calls {name} of the C library" for name in sorted(taken)]
    return said


def fused_instructions(compiler: str, object_file: Path, program: Path) -> dict[str, str]:
    """Each kind of fused multiply-add in the object's functions, and the first that has it.

    GCC makes some in spite of -ffp-contract=off: docs/determinism.md. The program is read, not the
    object, which takes objdump minutes; what the linker added from libraries does not count.
    """
    objdump = NM.replace("nm", "objdump") if compiler == CXX else "objdump"
    ours = {name for name, kind in symbols(object_file, "--defined-only") if kind in "TtWwVv"}
    function = ""
    found: dict[str, str] = {}
    for line in must([objdump, "-d", "--no-show-raw-insn", str(program)]).splitlines():
        if line.endswith(">:"):
            function = line[line.index("<") + 1 : -2]
        elif function in ours and (match := FUSED.search(line)):
            found.setdefault(match[1], function)
    return {name: must(["c++filt", function]).strip() for name, function in found.items()}


def libm_calls(compiler: str, object_file: Path) -> set[str]:
    """The functions that an object file of this machine takes from the mathematical library."""
    libm = must([compiler, "-print-file-name=libm.so.6"]).strip()
    exported = {name.split("@")[0] for name, _ in symbols(Path(libm), "-D", "--defined-only")}
    return {name for name, _ in symbols(object_file, "--undefined-only")} & exported


def symbols(file: Path, *options: str) -> list[tuple[str, str]]:
    """Name and nm's letter of the symbols of an object file or a library."""
    lines = must(["nm", "--format=posix", *options, str(file)]).splitlines()
    return [(name, kind) for name, kind, *_ in map(str.split, lines)]
