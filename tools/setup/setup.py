"""`make setup`: the virtual environment and the compiled core, made or brought up to date.

Three steps, each skipped when its result is current, so a second run costs a fraction of a second
(`setup.py environment` leaves out the third; `setup.py optional` does something else: it installs
the Debian packages that some tests want and skip without):

1. .venv with the pinned packages of tools/requirements.txt;
2. the package `strix` in it, editable: Python files are used where they lie;
3. the extension strix._core, built by CMake and Ninja in build/core from lib/ and tools/strix/core.

A run that was killed leaves no stamp (it is written last), and the next run starts that step anew.
Standard library only: it runs before anything is installed.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
from pathlib import Path

from machine import (
    ROOT,
    alone,
    fail,
    install_optional,
    require_build_tools,
    say,
    use_supported_python,
)

VENV = ROOT / ".venv"
STAMP = VENV / "strix-setup.stamp"
TOOLS = ROOT / "tools"
REQUIREMENTS = TOOLS / "requirements.txt"
CORE_BUILD = ROOT / "build" / "core"


def main() -> None:
    use_supported_python()
    with alone("setup"):
        if sys.argv[1:] == ["optional"]:
            install_optional()
            return
        set_up_environment()
        run(str(VENV / "bin" / "python"), str(TOOLS / "setup" / "mavlink.py"))
        if sys.argv[1:] != ["environment"]:
            build_core()


def set_up_environment() -> None:
    wanted = fingerprint(REQUIREMENTS, TOOLS / "pyproject.toml")
    found = STAMP.read_text() if STAMP.exists() else None
    if found == wanted:
        return
    require_build_tools()
    if found is None or found.splitlines()[0] != wanted.splitlines()[0]:
        # Half-finished, moved, or of another Python: not worth repairing.
        shutil.rmtree(VENV, ignore_errors=True)
        say(f"making .venv with Python {sys.version.split()[0]}")
        run(base_python(), "-m", "venv", str(VENV))
    STAMP.unlink(missing_ok=True)
    say("installing the pinned Python packages (about 700 MB)")
    pip("-r", str(REQUIREMENTS))
    # In place and without CMake: a path entry and the command `strix`. Ninja builds the core.
    options = ["--config-settings=editable.mode=inplace", "--config-settings=wheel.cmake=false"]
    pip("--no-deps", "--no-build-isolation", *options, "-e", str(TOOLS))
    write_last(STAMP, wanted)


def fingerprint(*files: Path) -> str:
    """First the machine's side, which decides whether .venv is any use, then the wanted content."""
    content = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    return f"{sys.base_prefix} {sys.version.split()[0]} {ROOT}\n{content}\n"


def base_python() -> str:
    """The interpreter behind the one we run under, which may be .venv's own (it is activated)."""
    return getattr(sys, "_base_executable", sys.executable)


def build_core() -> None:
    """Ninja knows what is out of date, also after it was killed; CMake runs when it must."""
    python = VENV / "bin" / "python"
    ninja = VENV / "bin" / "ninja"
    stamp = CORE_BUILD / "configured.stamp"
    wanted = STAMP.read_text()
    if not stamp.exists() or stamp.read_text() != wanted:
        require_build_tools()
        shutil.rmtree(CORE_BUILD, ignore_errors=True)
        say("configuring the core (about a minute to compile)")
        run(
            *(str(VENV / "bin" / "cmake"), "-S", str(TOOLS), "-B", str(CORE_BUILD), "-G", "Ninja"),
            *(f"-DCMAKE_MAKE_PROGRAM={ninja}", f"-DPython_EXECUTABLE={python}"),
        )
        write_last(stamp, wanted)
    run(str(ninja), "-C", str(CORE_BUILD), "--quiet")


def pip(*arguments: str) -> None:
    python = str(VENV / "bin" / "python")
    run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *arguments)


def run(*command: str) -> None:
    """Quiet if all goes well; else everything the command said, and one line that it failed."""
    done = subprocess.run(
        command, check=False, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    if done.returncode != 0:
        print(done.stdout, file=sys.stderr)
        fail(f"this command failed, its output is above: {' '.join(command)}")


def write_last(stamp: Path, text: str) -> None:
    """A stamp is there whole or not at all."""
    partial = stamp.with_suffix(".partial")
    partial.write_text(text)
    partial.replace(stamp)


if __name__ == "__main__":
    main()
