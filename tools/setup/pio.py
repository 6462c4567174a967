"""`make pio ARGS="..."`: run PlatformIO, with or without its registry (see pio_offline.py)."""

import subprocess
import sys
from pathlib import Path

from machine import ROOT
from pio_offline import environment


def run_pio(*arguments: str) -> int:
    pio = str(Path(sys.executable).parent / "pio")
    return subprocess.run([pio, *arguments], cwd=ROOT, env=environment(), check=False).returncode


if __name__ == "__main__":
    raise SystemExit(run_pio(*sys.argv[1:]))
