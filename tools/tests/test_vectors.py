"""The committed sim_vectors/ are what tools/matlab writes."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
COMMITTED = ROOT / "sim_vectors"
SCRIPT = ROOT / "tools" / "setup" / "vectors.py"

# Numbers are printed with 7 digits or more: a last digit that rounds the other way is 1e-6 of the
# number at most. Where a number is a small difference of large ones (a covariance between states
# that hardly touch) the last bits of sin, cos and log show, which differ between C libraries. One
# bit changed in every step of the flight made 4e-13 of the largest in the column.
RELATIVE = 1e-6
OF_COLUMN = 1e-11


@pytest.fixture(scope="module")
def regenerated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not shutil.which("octave-cli"):
        pytest.skip("octave-cli is not installed: sudo apt-get install octave octave-control")
    folder = tmp_path_factory.mktemp("vectors")
    run = subprocess.run(
        [sys.executable, str(SCRIPT), "--out", str(folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    return folder


def files(folder: Path) -> list[str]:
    return sorted(str(file.relative_to(folder)) for file in folder.rglob("*.csv"))


def test_the_same_files_with_the_same_columns_come_out_again(regenerated: Path) -> None:
    assert files(regenerated) == files(COMMITTED)
    for name in files(COMMITTED):
        heads = [
            (folder / name).read_text().splitlines()[:2] for folder in (regenerated, COMMITTED)
        ]
        assert heads[0] == heads[1], f"{name}: run `make vectors` and commit sim_vectors/"
        assert heads[1][0].startswith("# tools/matlab/make_vectors.m, "), name


def test_the_same_numbers_come_out_again(regenerated: Path) -> None:
    for name in files(COMMITTED):
        found, wanted = (read_numbers(folder / name) for folder in (regenerated, COMMITTED))
        assert found.shape == wanted.shape, name
        allowed = RELATIVE * np.abs(wanted) + OF_COLUMN * np.abs(wanted).max(axis=0)
        wrong = ~(np.abs(found - wanted) <= allowed)  # true for NaN
        assert not wrong.any(), (
            f"{name}: {wrong.sum()} numbers differ, first in row {np.argwhere(wrong)[0][0]}: "
            "run `make vectors` and commit sim_vectors/"
        )


def read_numbers(file: Path) -> np.ndarray:
    """All but the two lines of heading, and the names in a name,value file."""
    lines = file.read_text().splitlines()
    columns = None if lines[1] != "name,value" else (1,)
    return np.loadtxt(lines[2:], delimiter=",", usecols=columns, ndmin=2)
