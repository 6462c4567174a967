"""The C headers of MAVLink's dialect `common`, which the telemetry is compiled with.

pymavlink's generator writes them from its own copy of the dialect into build/mavlink; they are not
committed. Runs in two ways: as a program of .venv, which `make setup` starts, and as a build script
of PlatformIO (`extra_scripts = pre:tools/setup/mavlink.py`), where pymavlink is installed into
PlatformIO's own Python when it is not there. Where the headers are current, nothing is done.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

PYMAVLINK = "2.4.50"  # as pinned in tools/pyproject.toml: other versions have other dialects
DIALECT = "common"


def generate(root: Path) -> Path:
    """Have the headers in build/mavlink and return that folder."""
    out = root / "build" / "mavlink"
    stamp = out / "generated.stamp"
    wanted = f"pymavlink {PYMAVLINK}, {DIALECT}, MAVLink 2\n"
    if stamp.exists() and stamp.read_text() == wanted:
        return out
    have_pymavlink()
    from pymavlink.dialects import v20
    from pymavlink.generator import mavgen, mavparse

    # `v20` is a package without a file of its own.
    definition = Path(next(iter(v20.__path__))) / f"{DIALECT}.xml"
    options = mavgen.Opts(
        output=str(out),
        wire_protocol=mavparse.PROTOCOL_2_0,
        language="C",
        validate=False,  # it is the file that pymavlink was released with
        strict_units=False,
    )
    print(f"setup: writing MAVLink's headers to {out.relative_to(root)}", flush=True)
    with Path(os.devnull).open("w") as silence:
        talk, sys.stdout = sys.stdout, silence
        try:
            written = mavgen.mavgen(options, [str(definition)])
        finally:
            sys.stdout = talk
    if written is False:
        raise SystemExit("setup: pymavlink could not write MAVLink's headers")
    stamp.write_text(wanted)
    return out


def have_pymavlink() -> None:
    """Only PlatformIO's Python can be without it: .venv has it from tools/requirements.txt."""
    try:
        import pymavlink  # noqa: F401
    except ImportError:
        print(f"setup: installing pymavlink {PYMAVLINK} for PlatformIO", flush=True)
        command = [sys.executable, "-m", "pip", "install", "--quiet", f"pymavlink=={PYMAVLINK}"]
        subprocess.run(command, check=True)


if __name__ == "__main__":
    generate(Path(__file__).resolve().parents[2])
elif "Import" in globals():  # SCons puts this name here
    Import("env")  # type: ignore[name-defined]  # noqa: F821
    generate(Path(env.subst("$PROJECT_DIR")))  # type: ignore[name-defined]  # noqa: F821
