"""What the machine itself must offer: an interpreter, a compiler, Debian packages.

Standard library only, and readable by any Python 3.7: it runs before anything is installed.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

ROOT = Path(__file__).resolve().parents[2]
SUPPORTED = ((3, 11), (3, 12), (3, 13))


def fail(message: str) -> NoReturn:
    """End with one line that says what is wrong and what to do."""
    print(f"setup: {message}", file=sys.stderr)
    raise SystemExit(2)


def say(message: str) -> None:
    print(f"setup: {message}", flush=True)


@contextlib.contextmanager
def alone(name: str) -> Iterator[None]:
    """Two runs at once take turns here. The lock is freed however the one before us ended."""
    (ROOT / "build").mkdir(exist_ok=True)
    with (ROOT / "build" / f"{name}.lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say(f"waiting for another run of make (build/{name}.lock)")
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def use_supported_python() -> None:
    """Start again under a supported Python if this one is not and another is installed."""
    if sys.version_info[:2] in SUPPORTED:
        return
    for major, minor in SUPPORTED:
        other = shutil.which(f"python{major}.{minor}")
        if other:
            os.execv(other, [other, *sys.argv])
    found = "{}.{}".format(*sys.version_info[:2])
    fail(f"needs Python 3.11 to 3.13, found {found}: install one, or set PYTHON=/path/to/python")


def require_build_tools() -> None:
    """A compiler, Python's headers and the means to make a virtual environment."""
    version = "python{}.{}".format(*sys.version_info[:2])
    missing = []
    if not shutil.which("g++"):
        missing.append("g++")
    if not Path(sysconfig.get_path("include"), "Python.h").exists():
        missing.append(f"{version}-dev")
    try:
        import ensurepip  # noqa: F401  (Debian moves it out into a package of its own)
    except ImportError:
        missing.append(f"{version}-venv")
    if missing:
        install(missing)


# What some tests want and skip without: the independent reference, the emulated processor, a second
# compiler.
OPTIONAL_PACKAGES = {
    "octave-cli": ["octave", "octave-control"],
    "arm-none-eabi-g++": [
        "gcc-arm-none-eabi",
        "libnewlib-arm-none-eabi",
        "libstdc++-arm-none-eabi-newlib",
    ],
    "qemu-system-arm": ["qemu-system-arm"],
    "clang++": ["clang"],
    "llvm-mca": ["llvm"],
    "spin": ["spin"],
}


def install_optional() -> None:
    """Install what is missing of it; where that fails, the tests say what they skip and why."""
    for program, packages in OPTIONAL_PACKAGES.items():
        if shutil.which(program):
            continue
        try:
            install(packages)
        except SystemExit:
            say(f"goes on without {program}")


def install(packages: list[str]) -> None:
    """Install Debian packages if we may, else say in one line what to install."""
    names = " ".join(packages)
    if not shutil.which("apt-get"):
        fail(f"please install (names as in Debian): {names}")
    if os.geteuid() != 0:
        fail(f"please run: sudo apt-get install {names}")
    say(f"installing {names}")
    command = ["apt-get", "install", "-y", "-q", "--no-install-recommends", *packages]
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for attempt in ("with the package lists as they are", "with fresh ones"):
        if attempt == "with fresh ones":
            subprocess.run(["apt-get", "update", "-q"], env=environment, check=False)
        if subprocess.run(command, env=environment, check=False).returncode == 0:
            return
    fail(f"apt-get could not install {names}")
