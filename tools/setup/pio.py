"""`make pio ARGS="..."`: run PlatformIO, with or without its registry (see pio_offline.py)."""

import subprocess
import sys
from pathlib import Path

from machine import ROOT, alone
from pio_offline import environment


def run_pio(*arguments: str) -> int:
    pio = str(Path(sys.executable).parent / "pio")
    with alone("pio"):
        variables = environment("teensy41" if "teensy41" in arguments else "native")
        return subprocess.run([pio, *arguments], cwd=ROOT, env=variables, check=False).returncode


if __name__ == "__main__":
    raise SystemExit(run_pio(*sys.argv[1:]))
