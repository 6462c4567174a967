"""The spectrum of a log's gyro or accelerometer: peaks, motor lines, clipping, aliasing, notch.

Frequencies in Hz, power densities in the sensor's unit squared a Hz, one-sided.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy.ndimage
import scipy.signal

from strix.errors import BadInput
from strix.flightlog import Array
from strix.log.motor_lines import (
    LEAST_AVERAGES,
    MOTION_HZ,
    PEAK_SIGMAS,
    MotorLine,
    line_about,
    mean_turns,
    motor_lines,
    standing_out_db,
)
from strix.log.notch import NotchProposal, propose
from strix.log.spectrum_input import UNITS, even_samples, read_samples

FULL_SCALE = 0.999  # of the range: Sensors.h counts a sample from there as clipped
FLOOR_HZ = 50.0  # of the running median that counts as noise
MOST_PEAKS = 10  # told
PILE_DB = 3.0  # and more than chance makes of the n / 20 bins of its tenth


@dataclass(frozen=True)
class Peak:
    hz: float
    above_floor_db: float
    rms: float  # all axes, what is above the floor
    axis: str  # that has most of it


@dataclass(frozen=True)
class Spectrum:
    """All that is found."""

    where: str
    topic: str  # gyro or accel
    unit: str
    begin_s: float
    end_s: float
    whole: bool  # all that the log has, and not the time the motors pull or what was asked for
    samples: int
    rate_hz: float
    resolution_hz: float
    averages: int
    jitter_us: float  # RMS of the sample times about an even clock
    missing: int  # single samples that were filled in
    resampled: bool
    full_scale: float
    clipped: tuple[int, int, int]  # samples at full scale, by axis
    noise_rms: tuple[float, float, float]  # above MOTION_HZ, by axis
    piles_up_db: float  # density of the last tenth before Nyquist over what is below
    piled_up: bool
    peaks: list[Peak]
    motor_lines: list[MotorLine] | None  # None: the log does not tell the motors' speed
    notch: NotchProposal | None
    # For the figure
    hz: Array = field(repr=False)
    density: Array = field(repr=False)  # (len(hz), 3)
    segment_s: Array = field(repr=False)  # middles
    waterfall: Array = field(repr=False)  # all axes together, (len(hz), len(segment_s))
    turns_hz: Array = field(repr=False)  # mean of the motors in each segment, nan: unknown
    clipped_s: Array = field(repr=False)

    @property
    def aliased(self) -> bool:
        """Something of what is seen lies elsewhere in truth."""
        lines = self.motor_lines or []
        return self.piled_up or any(line.folds_to_hz and line.found_order for line in lines)

    def to_dict(self) -> dict[str, Any]:
        """For JSON: without the arrays."""
        found = {
            key: value for key, value in vars(self).items() if not isinstance(value, np.ndarray)
        }
        for key in ("peaks", "motor_lines"):
            if found[key] is not None:
                found[key] = [asdict(part) for part in found[key]]
        found["notch"] = None if self.notch is None else asdict(self.notch)
        return {**found, "aliased": self.aliased}


def spectrum(
    path: Path,
    topic: str = "gyro",
    from_s: float | None = None,
    to_s: float | None = None,
    full_scale: float | None = None,
) -> Spectrum:
    """Of a flight log, or of a recording's IMU.

    from_s, to_s: by default while the motors pull, else all. full_scale: in UNITS.
    """
    log = read_samples(path, topic)
    unit = UNITS[topic]
    full_scale = unit.full_scale if full_scale is None else full_scale
    part, whole = log.cut(from_s, to_s)
    at_end = np.abs(part.values) >= FULL_SCALE * full_scale * unit.factor
    even = even_samples(part)
    if even.rate_hz < 2.0 * MOTION_HZ:
        raise BadInput(
            f"{part.where}: expected at least {2.0 * MOTION_HZ:g} samples a second, "
            f"found {even.rate_hz:.1f}: below {MOTION_HZ:g} Hz the aircraft itself moves"
        )
    n = 2 ** round(np.log2(even.rate_hz))  # about 1 Hz apart
    averages = 2 * len(even.values) // n - 1
    if averages < LEAST_AVERAGES:
        needed_s = (LEAST_AVERAGES + 1) / 2 * n / even.rate_hz
        raise BadInput(
            f"{part.where}: expected at least {needed_s:.1f} s of samples, "
            f"found {part.time_s[-1] - part.time_s[0]:.1f} s"
        )
    # Welch's method is the mean of these over the segments (scipy.signal.welch does the same).
    hz, middle_s, parts = scipy.signal.spectrogram(
        even.values, even.rate_hz, "hann", n, n // 2, detrend="constant", axis=0
    )
    density = parts.mean(axis=2)
    waterfall = parts.sum(axis=1)
    segment_s = even.begin_s + middle_s
    high = hz >= MOTION_HZ
    spacing = float(hz[1])
    least_db = standing_out_db(averages)

    piles_db = _piles_up_db(density)
    turns_hz = np.full(len(segment_s), np.nan)
    lines = notch = None
    if log.turns is not None:
        turns_hz = mean_turns(log.turns, segment_s, n / even.rate_hz)
        lines = motor_lines(hz, waterfall, turns_hz, even.rate_hz)
        if topic == "gyro":
            notch = propose(lines, even.rate_hz, log.turns.control_hz, log.turns.time_constant_s)
    return Spectrum(
        where=log.where,
        topic=topic,
        unit=unit.name,
        begin_s=float(part.time_s[0]),
        end_s=float(part.time_s[-1]),
        whole=whole,
        samples=len(part.values),
        rate_hz=even.rate_hz,
        resolution_hz=spacing,
        averages=averages,
        jitter_us=even.jitter_us,
        missing=even.missing,
        resampled=even.resampled,
        full_scale=full_scale,
        clipped=_three(at_end.sum(axis=0), int),
        noise_rms=_three(np.sqrt(density[high].sum(axis=0) * spacing), float),
        piles_up_db=piles_db,
        piled_up=piles_db > max(PILE_DB, PEAK_SIGMAS * 4.34 / np.sqrt(averages * n / 20)),
        peaks=find_peaks(hz, density, least_db),
        motor_lines=lines,
        notch=notch,
        hz=hz,
        density=density,
        segment_s=segment_s,
        waterfall=waterfall,
        turns_hz=turns_hz,
        clipped_s=part.time_s[at_end.any(axis=1)],
    )


def find_peaks(hz: Array, density: Array, least_db: float) -> list[Peak]:
    """The strongest lines; those of several axes at one frequency are one."""
    spacing = float(hz[1])
    high = hz >= MOTION_HZ
    at_hz = hz[high]
    found: list[tuple[float, float, float, int]] = []  # power, hz, dB, axis
    for axis in range(3):
        its = density[high, axis]
        if not its.max() > 0.0:
            continue  # a sensor that is dead or exactly still
        floor, above_db = _above_floor(its, round(FLOOR_HZ / spacing))
        tops, _ = scipy.signal.find_peaks(
            np.pad(above_db, 1, constant_values=-np.inf), height=least_db, prominence=least_db
        )
        for top in tops - 1:
            line = line_about(above_db, int(top))
            power = float((its[line] - floor[line]).sum()) * spacing
            found.append((power, float(at_hz[top]), float(above_db[top]), axis))
    found.sort(reverse=True)
    peaks: list[Peak] = []
    while found:
        _, at, db, axis = found[0]
        same = [one for one in found if abs(one[1] - at) <= 3.0 * spacing]
        strongest = {one[3]: one[0] for one in reversed(same)}  # of each axis
        peaks.append(Peak(at, db, float(np.sqrt(sum(strongest.values()))), "xyz"[axis]))
        found = [one for one in found if one not in same]
    return peaks[:MOST_PEAKS]


def _above_floor(density: Array, width: int) -> tuple[Array, Array]:
    """The running median, and by how many dB each bin is above it."""
    floor = scipy.ndimage.median_filter(density, size=2 * (width // 2) + 1, mode="nearest")
    floor = np.maximum(floor, 1e-12 * density.max())
    return floor, 10.0 * np.log10(np.maximum(density, 1e-30) / floor)


def _piles_up_db(density: Array) -> float:
    """How far the last tenth before Nyquist lies above what is below it, on the worst axis. By
    medians: a single line does not count. The last bin is one-sided by itself.
    """
    n = len(density)
    top = np.median(density[int(0.9 * n) : n - 1], axis=0)
    below = np.median(density[n // 2 : int(0.9 * n)], axis=0)
    heard = below > 0.0
    return float(np.max(10.0 * np.log10(top[heard] / below[heard]), initial=-200.0))


def _three(values: Array, kind: type[Any]) -> tuple[Any, Any, Any]:
    x, y, z = (kind(value) for value in values)
    return x, y, z
