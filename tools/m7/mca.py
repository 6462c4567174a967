"""Estimated cycles of counted calls: what they executed, through llvm-mca's model of a Cortex-M7.

trace_plugin.c writes the address of every instruction of a call, llvm-objdump says what stands
there, and llvm-mca says how long a Cortex-M7's pipelines take for these instructions in this order.
It knows no cache, no memory and no branch that was predicted wrongly: an estimate.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from m7 import HERE, QEMU, BuildError, execute, must

OBJDUMP = "llvm-objdump"  # GNU's writes some instructions in a way that llvm-mca does not read
MCA = "llvm-mca"
MODEL = ["-mtriple=thumbv7em-none-eabihf", "-mcpu=cortex-m7", "-iterations=1"]
SUMMARY = ["-instruction-info=0", "-resource-pressure=0"]
CC = "cc"
CONDITIONS = "eq|ne|hs|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le"  # what `it` puts at the end of a name


class EstimateError(Exception):
    """There can be no estimate; the text says why."""


@dataclass(frozen=True)
class Estimate:
    cycles: int
    left_out: tuple[str, ...]  # instructions that llvm-mca does not know


def estimates(
    elf: Path, arguments: Sequence[str], calls: Mapping[int, int], folder: Path
) -> dict[int, Estimate]:
    """The estimate of each of a program's counted calls.

    @param calls  the call's number and how many instructions were counted in it
    @param folder  for the plugin and the trace
    """
    require_tools()
    listing = disassembly(elf)
    trace = traced(elf, arguments, calls, window(listing), folder)
    found = {}
    for number, counted in calls.items():
        addresses = trace.get(number, [])
        # One more than counted: the call's return, which an empty call has as well.
        if len(addresses) != counted + 1:
            raise EstimateError(
                f"{elf.stem}, call {number}: {counted} instructions counted, "
                f"{len(addresses)} traced"
            )
        found[number] = estimate([listing[address] for address in addresses])
    return found


def require_tools() -> None:
    """Raise EstimateError with the Debian packages to install, if any is missing."""
    missing = []
    if not (shutil.which(OBJDUMP) and shutil.which(MCA)):
        missing.append("llvm")
    if not shutil.which(CC):
        missing.append("gcc")
    if missing:
        raise EstimateError(f"please install (names as in Debian): {' '.join(missing)}")


def disassembly(elf: Path) -> dict[int, str]:
    """The instruction at each address."""
    text = must([OBJDUMP, "-d", "--no-show-raw-insn", "--mcpu=cortex-m7", str(elf)])
    lines = re.findall(r"^\s*([0-9a-f]+):\s+([^@<\n]+)", text, re.MULTILINE)
    return {int(address, 16): " ".join(said.split()) for address, said in lines}


def window(listing: Mapping[int, str]) -> tuple[int, int]:
    """Addresses of countedCall's blx (InstructionCounter.h) and of what follows it.

    Nobody else calls between two readings of the timer, which stands at 0x40000000.
    """
    order = sorted(listing)
    for before, call, back in zip(order, order[1:], order[2:], strict=False):
        here = (listing[before], listing[call], listing[back])
        if here == ("ldr r5, [r4, #4]", "blx r2", "ldr r6, [r4, #4]"):
            return call, back
    raise EstimateError("countedCall of InstructionCounter.h is not in the program")


def traced(
    elf: Path,
    arguments: Sequence[str],
    numbers: Collection[int],
    between: tuple[int, int],
    folder: Path,
) -> dict[int, list[int]]:
    """The addresses that the calls of these numbers executed, in their order."""
    plugin = folder / "trace_plugin.so"
    flags = ["-shared", "-fPIC", "-O2", "-std=c11", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
    try:
        must([CC, *flags, str(HERE / "trace_plugin.c"), "-o", str(plugin)])
    except BuildError as refused:
        raise EstimateError(f"the tracer does not build: {refused}") from None
    out = folder / f"{elf.stem}.trace"
    wanted = "+".join(str(number) for number in sorted(numbers))
    call, back = between
    option = f"file={plugin},call={call:#x},back={back:#x},numbers={wanted},out={out}"
    # As m7.run, but at any speed: here nothing is counted by time.
    words = "".join(f",arg={word}" for word in (elf.name, *arguments))
    machine = [QEMU, "-M", "mps2-an500", "-nographic", "-monitor", "none", "-serial", "none"]
    host = ["-semihosting-config", f"enable=on,target=native{words}", "-plugin", option]
    done = execute([*machine, *host, "-kernel", str(elf)])
    if done.returncode != 0:
        raise EstimateError(f"{elf.stem} does not run with the tracer: {done.stdout.strip()}")
    found: dict[int, list[int]] = {}
    for line in out.read_text(encoding="ascii").splitlines():
        if line.startswith("call "):
            addresses = found.setdefault(int(line.removeprefix("call ")), [])
        else:
            addresses.append(int(line, 16))
    return found


def estimate(instructions: Sequence[str]) -> Estimate:
    """What llvm-mca makes of instructions in the order of their execution."""
    program = straight(instructions)
    left_out: list[str] = []
    while program:
        done = subprocess.run(
            [MCA, *MODEL, *SUMMARY, "-"],
            input="\n".join(program) + "\n",
            capture_output=True,
            text=True,
            check=False,
        )
        refused = refused_lines(done.stderr, program)  # unread ones are no failure of llvm-mca's
        cycles = re.search(r"^Total Cycles:\s+(\d+)", done.stdout, re.MULTILINE)
        if not refused and cycles:
            return Estimate(int(cycles[1]), tuple(left_out))
        if not refused:
            raise EstimateError(f"{MCA}: {done.stderr.strip()}")
        left_out += [line for i, line in enumerate(program) if i in refused]
        program = [line for i, line in enumerate(program) if i not in refused]
    return Estimate(0, tuple(left_out))


def refused_lines(said: str, program: Sequence[str]) -> set[int]:
    """Lines, from 0, that llvm-mca could not read or of which it has no model."""
    errors = re.findall(r"^<stdin>:(\d+):\d+: error", said, re.MULTILINE)
    unread = {int(line) - 1 for line in errors}
    unknown = {" ".join(text.split()) for text in re.findall(r"note: instruction:(.*)", said)}
    return unread | {i for i, line in enumerate(program) if line in unknown}


def straight(instructions: Sequence[str]) -> list[str]:
    """A trace as a program without jumps, in words that llvm-mca has a model of.

    A call becomes a branch (it would add 100 cycles), a branch goes nowhere, `it` becomes a nop and
    what it makes conditional is executed, and a comparison that can trap or has a zero becomes
    the ordinary one of two registers, which takes as long.
    """
    program = []
    left = 0  # instructions that the last `it` makes conditional
    for text in instructions:
        name, _, operands = text.partition(" ")
        if left:
            left -= 1
            name = re.sub(rf"({CONDITIONS})(?=\.|$)", "", name, count=1)
        elif block := re.fullmatch(r"it([te]*)", name):
            left = 1 + len(block[1])
            name, operands = "nop", ""
        operands = re.sub(r"\b0x[0-9a-f]+$", "#4", operands)
        name = {"bl": "b", "blx": "bx"}.get(name, name)
        if name.startswith("vcmp"):
            first = operands.split(",")[0]
            name, operands = name.replace("vcmpe", "vcmp"), f"{first}, {first}"
        program.append(f"{name} {operands}".strip())
    return program
