"""Reading recordings, good and bad."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import synthetic_recording as synthetic

from strix.errors import BadInput
from strix.recording import read_recording, read_table

Edit = Callable[[list[str]], list[str]]
SHORT = synthetic.make(synthetic.Case(duration_s=1.0)).tables


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return synthetic.write(tmp_path / "flight", SHORT)


def edit(path: Path, change: Edit) -> None:
    """Change a file's lines; the file ends with a line end unless the last line is cut by hand."""
    packed = path.suffix == ".gz"
    text = gzip.decompress(path.read_bytes()).decode() if packed else path.read_text()
    data = "\n".join(change(text.split("\n"))).encode()
    path.write_bytes(gzip.compress(data) if packed else data)


def replaced(line: int, column: int, value: str) -> Edit:
    """One field replaced; lines are counted from 1, columns from 0."""

    def change(lines: list[str]) -> list[str]:
        fields = lines[line - 1].split(",")
        fields[column] = value
        return [*lines[: line - 1], ",".join(fields), *lines[line:]]

    return change


def said(folder: Path) -> str:
    with pytest.raises(BadInput) as caught:
        read_recording(folder)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_what_was_written_is_read(folder: Path) -> None:
    recording = read_recording(folder)
    for name in ("imu", "mag", "baro", "gps"):
        np.testing.assert_allclose(getattr(recording, name), SHORT[name], rtol=1e-9, atol=1e-9)


def test_only_the_imu_is_required(tmp_path: Path) -> None:
    recording = read_recording(synthetic.write(tmp_path, {"imu": SHORT["imu"]}))
    assert len(recording.imu) == 200
    assert recording.mag.shape == (0, 4)
    assert recording.gps.shape == (0, 8)


def test_columns_are_found_by_name_and_others_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "baro.csv"
    path.write_bytes(b"\xef\xbb\xbfname, alt_m ,t_s\r\nfirst,2.5,0\r\nsecond,3.5,0.1\r\n")
    np.testing.assert_array_equal(read_table(path, ("t_s", "alt_m")), [[0.0, 2.5], [0.1, 3.5]])


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        (
            "mag.csv",
            lambda s: ["t_s,mx_uT,mz_uT", *s[1:]],
            ["line 1", "column my_uT", "'t_s,mx_uT"],
        ),
        ("imu.csv.gz", replaced(7, 3, "nan"), ["line 7", "column az", "finite", "nan"]),
        ("imu.csv.gz", replaced(8, 6, "inf"), ["line 8", "column gz", "finite", "inf"]),
        ("mag.csv", replaced(3, 2, "x9"), ["line 3", "column my_uT", "a number", "'x9'"]),
        ("mag.csv", replaced(3, 2, ""), ["line 3", "column my_uT", "a number", "''"]),
        ("baro.csv", replaced(5, 1, "1e39"), ["line 5", "column alt_m", "from -100000 to"]),
        ("gps.csv", replaced(4, 2, "91"), ["line 4", "column lat_deg", "from -90 to 90", "91"]),
        ("imu.csv.gz", replaced(9, 0, "0.001"), ["line 9", "column t_s", "0.030000", "0.001000"]),
        ("gps.csv", replaced(2, 0, "1e300"), ["line 2", "column t_s", "1e+300"]),
        ("imu.csv.gz", lambda s: [*s[:20], s[20][:9]], ["line 21", "column ax", "end of the file"]),
        ("imu.csv.gz", lambda s: [*s[:20], s[20]], ["line 21", "column gz", "line end"]),
        ("mag.csv", lambda s: [*s[:4], "0.08,1.5", *s[5:]], ["line 5", "my_uT", "4 columns", "2:"]),
        ("mag.csv", lambda s: [*s[:4], s[4] + ",7", *s[5:]], ["line 5", "4 columns", "5:"]),
        ("mag.csv", lambda s: [*s[:4], "", *s[5:]], ["line 5", "4 columns", "''"]),
        ("mag.csv", lambda s: [s[0], ""], ["line 2", "a row of numbers", "the end of the file"]),
        ("mag.csv", lambda _: [""], ["mag.csv", "t_s,mx_uT,my_uT,mz_uT", "an empty file"]),
        ("imu.csv.gz", lambda _: [""], ["imu.csv.gz", "t_s,ax,ay,az,gx,gy,gz", "an empty file"]),
        ("mag.csv", lambda _: ["t_s,mx"], ["line 1", "line end"]),
    ],
)
def test_a_bad_file_is_refused_with_its_place(
    folder: Path, name: str, change: Edit, words: list[str]
) -> None:
    edit(folder / name, change)
    message = said(folder)
    assert message.startswith(f"{folder / name}: ")
    for word in ["expected", "found", *words]:
        assert word in message, message


@pytest.mark.parametrize("kept", [0, 5, 15, 1000, 8000])
def test_a_cut_gzip_file_is_refused(folder: Path, kept: int) -> None:
    path = folder / "imu.csv.gz"
    path.write_bytes(path.read_bytes()[:kept])
    message = said(folder)
    assert message.startswith(f"{path}: ")
    if kept >= 1000:
        assert "line " in message
        assert "column " in message
        assert "(the file is cut)" in message


def test_damaged_and_mislabelled_gzip_files_are_refused(folder: Path) -> None:
    path = folder / "imu.csv.gz"
    good = bytearray(path.read_bytes())
    good[2000] ^= 0xFF
    path.write_bytes(good)
    assert str(path) in said(folder)
    path.write_text("t_s,ax,ay,az,gx,gy,gz\n")
    assert "found damaged gzip data" in said(folder)


def test_bytes_that_are_no_text_are_refused(folder: Path) -> None:
    (folder / "mag.csv").write_bytes(bytes(range(256)) * 4)
    assert str(folder / "mag.csv") in said(folder)


def test_folders_that_are_no_recording_are_refused(tmp_path: Path) -> None:
    assert "found nothing" in said(tmp_path / "absent")
    (tmp_path / "file").touch()
    assert "found a file" in said(tmp_path / "file")
    (tmp_path / "empty").mkdir()
    assert "expected imu.csv or imu.csv.gz" in said(tmp_path / "empty")
    (tmp_path / "empty" / "imu.csv").mkdir()
    assert "Is a directory" in said(tmp_path / "empty")
