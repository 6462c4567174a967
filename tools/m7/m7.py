"""Build a C++ program for a Cortex-M7 and run it on QEMU's machine mps2-an500.

The program is an ordinary one: main(), printf, files on the host. Its output and exit status come
back as those of a process would; startup.cpp and mps2-an500.ld do the rest. What it executes is the
aircraft's instruction set, compiled as the aircraft's code is; what it does not have is the
aircraft's caches, memories and devices.
"""

from __future__ import annotations

import configparser
import shutil
import subprocess
import sysconfig
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
CXX = "arm-none-eabi-g++"
NM = "arm-none-eabi-nm"
QEMU = "qemu-system-arm"

# The processor and the options that PlatformIO's platform `teensy` gives a Teensy 4.1
# (builder/frameworks/arduino.py there); the project's own come from platformio.ini.
PROCESSOR = ["-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard"]
TEENSY = ["-O2", "-ffunction-sections", "-fdata-sections", "-fno-threadsafe-statics"]
LINK = ["-nostartfiles", "--specs=rdimon.specs", "-Wl,--gc-sections", "-Wl,--fatal-warnings"]


class MissingToolError(Exception):
    """The cross compiler or the emulator is not installed; the text says what to install."""


class BuildError(Exception):
    """The compiler or the linker refused; the text is what it said."""


@dataclass(frozen=True)
class Run:
    """What a program on the emulated processor left."""

    status: int
    output: str


def require_tools() -> None:
    """Raise MissingToolError with the Debian packages to install, if any is missing."""
    missing = []
    if not shutil.which(CXX):
        missing.append("gcc-arm-none-eabi")
    if not has_library("rdimon.specs"):
        missing.append("libnewlib-arm-none-eabi")
    if not has_library("libstdc++.a"):
        missing.append("libstdc++-arm-none-eabi-newlib")
    if not shutil.which(QEMU):
        missing.append("qemu-system-arm")
    if missing:
        raise MissingToolError(f"please install (names as in Debian): {' '.join(missing)}")


def has_library(name: str) -> bool:
    """Whether the cross compiler finds a file of its C or C++ library: then it names its path."""
    if not shutil.which(CXX):
        return False
    found = execute([CXX, *PROCESSOR, f"-print-file-name={name}"]).stdout.strip()
    return Path(found).is_absolute()


def compile_flags() -> list[str]:
    """The flags of the aircraft's own code."""
    ini = configparser.ConfigParser(inline_comment_prefixes=(";",), interpolation=None)
    ini.read(ROOT / "platformio.ini", encoding="utf-8")
    determinism = ini["strix"]["determinism"].split()
    own = ini["env"]["custom_own_flags"].split()
    return [*PROCESSOR, *TEENSY, "-std=gnu++17", "-DNDEBUG", *determinism, *own]


def include_flags() -> list[str]:
    """Where headers are: ours with -I; Eigen and MAVLink, which are not, as system headers."""
    libraries = sorted(manifest.parent for manifest in (ROOT / "lib").glob("*/library.json"))
    ours = [HERE, *libraries, ROOT / "include"]
    eigen = Path(sysconfig.get_path("purelib"), "cmeel.prefix/include/eigen3")
    system = ("-isystem", str(eigen), "-isystem", str(ROOT / "build/mavlink"))
    return [*(f"-I{folder}" for folder in ours), *system]


def build(
    sources: Sequence[Path],
    folder: Path,
    flags: Sequence[str] = (),
    last: Sequence[str] = (),
    link: Sequence[str] = (),
) -> Path:
    """Compile and link; return the ELF file, named after the first source.

    The folder, made if need be, also gets one object file per source and the linker's map.
    @param flags  come before all others, so that an -I of theirs is searched first
    @param last  come after all others, to take back one of them
    @param link  more for the linker
    """
    require_tools()
    folder.mkdir(parents=True, exist_ok=True)
    objects = []
    for source in (*sources, HERE / "startup.cpp"):
        target = object_of(source, folder)
        options = [*flags, *compile_flags(), *include_flags(), *last]
        must([CXX, *options, "-c", str(source), "-o", str(target)])
        objects.append(str(target))
    elf = folder / f"{sources[0].stem}.elf"
    script = ["-T", str(HERE / "mps2-an500.ld"), f"-Wl,-Map={elf.with_suffix('.map')}"]
    must([CXX, *PROCESSOR, *objects, *LINK, *script, *link, "-o", str(elf)])
    return elf


def object_of(source: Path, folder: Path) -> Path:
    """Where build() puts the object file of a source."""
    return folder / f"{source.stem}.o"


def run(elf: Path, arguments: Sequence[str] = (), timeout_s: float = 60.0) -> Run:
    """Run a program to its end, or to the timeout. No argument may have a space in it.

    A processor fault gives status 99 and a line that says so, the timeout status 124.
    """
    require_tools()
    command = [QEMU, "-M", "mps2-an500", "-nographic", "-monitor", "none", "-serial", "none"]
    words = "".join(f",arg={word}" for word in (elf.name, *arguments))
    command += ["-semihosting-config", f"enable=on,target=native{words}"]
    # One instruction lasts 2^10 ns of emulated time: see InstructionCounter.h.
    command += ["-icount", "shift=10,align=off,sleep=off", "-kernel", str(elf)]
    try:
        done = execute(command, timeout_s)
    except subprocess.TimeoutExpired:
        return Run(124, f"m7: {elf.name} did not end within {timeout_s:g} s\n")
    return Run(done.returncode, done.stdout)


def must(command: Sequence[str]) -> str:
    done = execute(command)
    if done.returncode != 0:
        raise BuildError(done.stdout)
    return done.stdout


def execute(
    command: Sequence[str], timeout_s: float | None = None
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=timeout_s,
        check=False,
    )
