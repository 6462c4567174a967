"""The gyro filter of the flight code against SciPy's designs, and against its own manual."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from numpy.typing import NDArray

from strix import _core

IMU_HZ = 1125.0
MANUAL = Path(__file__).parents[2] / "docs" / "filtering.md"

# From 1 Hz to Nyquist. The notch's own centre is among them where it is a whole number.
GRID_HZ = np.arange(1.0, IMU_HZ / 2.0)
# float32: a1 = -2 cos w is rounded by 1.2e-7, and 1 + a1 + a2, which places the poles, is 4 w^2
# or so: 1e-2 at 18 Hz, so 1e-5 of the cut-off. What rounding each sample adds is less.
AMPLITUDE_TOLERANCE = 5e-5
PHASE_TOLERANCE_DEG = 5e-3


def response(filter_: _core.GyroFilter, at_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
    """What the filter makes of an impulse, sample by sample in float32; to 0.1 Hz."""
    impulse = np.zeros((11250, 3), dtype=np.float32)  # 10 s: the narrowest notch rings for 0.5 s
    filter_.update(impulse[:1])  # the first sample counts as having been there for ever
    impulse[0] = 1.0, -1.0, 30.0
    out = filter_.update(impulse).astype(np.float64) / impulse[0]
    assert np.abs(out[-100:]).max() < 1e-9  # nothing of it is cut off
    axes = np.fft.rfft(out, axis=0)[np.rint(10.0 * at_hz).astype(int)]  # 0.1 Hz apart
    np.testing.assert_allclose(axes, axes[:, [0, 0, 0]], atol=2e-4)  # rounding rings too
    return np.asarray(axes[:, 0])


def low_pass(cutoff_hz: float) -> _core.GyroFilter:
    config = _core.GyroFilterConfig()
    config.lowPass = cutoff_hz
    return _core.GyroFilter(config, IMU_HZ, 500.0, 0.0)


def notch(centre_hz: float, q: float) -> _core.GyroFilter:
    config = _core.GyroFilterConfig()
    config.notchMin = config.notchMax = centre_hz
    config.notchQ = q
    return _core.GyroFilter(config, IMU_HZ, 500.0, 0.0)


def compare(found: NDArray[np.complex128], b: object, a: object, q: float = 0.7) -> None:
    """A centre that is off by a part of it turns a notch's response by 2 q times that."""
    steep = max(1.0, 2.0 * q / 5.0)
    _, wanted = scipy.signal.freqz(b, a, worN=GRID_HZ, fs=IMU_HZ)
    np.testing.assert_allclose(np.abs(found), np.abs(wanted), atol=AMPLITUDE_TOLERANCE * steep)
    passed = np.abs(wanted) > 0.02  # of what is hardly there the phase is rounding
    turned_deg = np.degrees(np.angle(found[passed] / wanted[passed]))
    scale = np.minimum(1.0, np.abs(wanted[passed]))
    np.testing.assert_allclose(turned_deg * scale, 0.0, atol=PHASE_TOLERANCE_DEG * steep)


@pytest.mark.parametrize("cutoff_hz", [15.0, 25.0, 40.0, 80.0, 111.0, 200.0, 400.0, 500.0])
def test_the_low_pass_is_scipys_butterworth(cutoff_hz: float) -> None:
    compare(response(low_pass(cutoff_hz), GRID_HZ), *scipy.signal.butter(2, cutoff_hz, fs=IMU_HZ))


@pytest.mark.parametrize("q", [1.0, 2.5, 20.0])
@pytest.mark.parametrize("centre_hz", [25.0, 80.0, 176.0, 320.0, 500.0])
def test_the_notch_is_scipys_iirnotch(centre_hz: float, q: float) -> None:
    found = response(notch(centre_hz, q), GRID_HZ)
    b, a = scipy.signal.iirnotch(centre_hz, q, fs=IMU_HZ)
    compare(found, b, a, q)
    assert np.abs(found[centre_hz == GRID_HZ]) < 1e-3  # 60 dB where it was put


def test_low_pass_and_notch_follow_each_other() -> None:
    config = _core.GyroFilterConfig()
    config.lowPass = 100.0
    config.notchMin = config.notchMax = 176.0
    config.notchQ = 3.0
    both = response(_core.GyroFilter(config, IMU_HZ, 500.0, 0.0), GRID_HZ)
    apart = response(low_pass(100.0), GRID_HZ) * response(notch(176.0, 3.0), GRID_HZ)
    np.testing.assert_allclose(both, apart, atol=AMPLITUDE_TOLERANCE)


@pytest.mark.parametrize("filter_", [low_pass(6.0), low_pass(80.0), notch(60.0, 1.0)])
def test_a_steady_turn_passes_as_it_is(filter_: _core.GyroFilter) -> None:
    turn = np.tile(np.array([[0.01, -2.0, 34.9]], dtype=np.float32), (20_000, 1))
    filter_.update(np.zeros((1, 3), dtype=np.float32))
    out = filter_.update(turn)
    # 6 Hz magnifies the rounding of a term (6e-8) by 1 / (1 + a1 + a2) = 900.
    np.testing.assert_allclose(out[-1], turn[-1], rtol=2e-4)


@pytest.mark.parametrize("wrong", [0.99, 1.01])
def test_a_sample_clock_one_percent_off_still_takes_the_line_out(wrong: float) -> None:
    """Then all frequencies are off by 1 %. At that distance from its centre a notch of Q 3 has
    2 Q 0.01 = 0.06 left, 24 dB; a low-pass at 80 Hz has its 3 dB at 79.2 or 80.8 Hz.
    """
    line_hz = np.array([176.0])
    assert np.abs(response(notch(176.0 * wrong, 3.0), line_hz))[0] < 0.065
    cutoff_hz = np.array([80.0])
    left = np.abs(response(low_pass(80.0 * wrong), cutoff_hz))[0]
    assert left == pytest.approx(np.sqrt(0.5), rel=0.012)


def test_the_manual_states_the_lag_and_the_attenuation_that_the_code_has() -> None:
    """Rows of docs/filtering.md: setting, deg of lag at 10 Hz, dB or % left at a motor's line."""
    rows = re.findall(
        r"^\| (low-pass|notch) (\d+) Hz(?:, Q ([\d.]+))? \| ([\d.]+) \| ([\d.]+) \|",
        MANUAL.read_text(),
        re.MULTILINE,
    )
    assert len(rows) >= 8
    for kind, hz, q, lag_deg, left_percent in rows:
        filter_ = low_pass(float(hz)) if kind == "low-pass" else notch(float(hz), float(q))
        at_hz = [10.0, 176.0 if kind == "low-pass" else 1.1 * float(hz)]
        found = response(filter_, np.array(at_hz))
        assert -np.degrees(np.angle(found[0])) == pytest.approx(float(lag_deg), abs=0.051)
        assert 100.0 * np.abs(found[1]) == pytest.approx(float(left_percent), abs=0.51)
