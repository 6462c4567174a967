"""`make vectors`: write sim_vectors/ anew with tools/matlab, by GNU Octave or by MATLAB.

Standard library only: it needs neither the virtual environment nor the compiled core.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from machine import ROOT, fail

# What Octave 7.3 says at the end of every run that has no terminal, also of a good one.
OCTAVE_FAREWELL = "error: ignoring const execution_exception& while preparing to exit"
SOURCES = ROOT / "tools" / "matlab"


def command(folder: Path) -> list[str]:
    """What writes the vectors into the folder, with the interpreter that is there."""
    run = f"make_vectors({quoted(folder)})"
    octave, matlab = shutil.which("octave-cli"), shutil.which("matlab")
    if not octave and not matlab:
        fail("vectors need GNU Octave or MATLAB: sudo apt-get install octave octave-control")
    if octave:
        return [octave, "--no-init-file", "--quiet", "--path", str(SOURCES), "--eval", run]
    return [str(matlab), "-batch", f"addpath({quoted(SOURCES)}); {run}"]


def quoted(path: Path) -> str:
    """As text between single quotes is written in both languages."""
    return "'" + str(path).replace("'", "''") + "'"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "sim_vectors", help="folder to fill")
    folder = parser.parse_args().out.resolve()
    run = subprocess.run(command(folder), stderr=subprocess.PIPE, text=True, check=False)
    for line in run.stderr.splitlines():
        if line != OCTAVE_FAREWELL:
            print(line, file=sys.stderr)
    return run.returncode


if __name__ == "__main__":
    raise SystemExit(main())
