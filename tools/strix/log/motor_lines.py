"""Lines in a spectrum that go with the motors' turns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from strix.flightlog import Array
from strix.log.spectrum_input import Turns

MOTION_HZ = 20.0  # below, the aircraft itself moves
LEAST_AVERAGES = 7  # half-overlapping segments: 4 segments' length
PEAK_DB, PEAK_SIGMAS = 6.0, 5.0
ORDERS = (1, 2, 3)  # per turn: unbalance, two and three blades
ORDER_TOLERANCE = 0.15  # of the order: what ESC curve and battery may be off
SAME_RATIO = 0.03  # it is the same for all orders, to the width of a line


@dataclass(frozen=True)
class MotorLine:
    """A line at `order` times the motors' turns."""

    order: int
    from_hz: float  # as the commands predict, 1st to 99th percentile of the time
    to_hz: float
    folds_to_hz: tuple[float, float] | None  # of from_hz and to_hz, if to_hz is above Nyquist
    found_order: float | None = None  # None: no such line
    above_floor_db: float = 0.0
    rms: float = 0.0
    share: float = 0.0  # of the power above MOTION_HZ
    off_hz: float = 0.0  # RMS distance of the line's power from the prediction


def standing_out_db(averages: int) -> float:
    """What is a line: four times the power of the floor, and more than chance makes of a few
    averages. One bin's standard deviation is 4.34 dB / sqrt(averages); the largest of 1500 bins is
    3.2 of them above the median, and prominence counts from a valley: five.
    """
    return float(max(PEAK_DB, PEAK_SIGMAS * 4.34 / np.sqrt(averages)))


def motor_lines(hz: Array, waterfall: Array, turns_hz: Array, rate_hz: float) -> list[MotorLine]:
    """Looks for each order where the motors' speed of every segment puts it, folded at Nyquist.

    By order and not by frequency a line stays sharp while the throttle moves. The median over the
    segments finds it: a line that stays at its frequency, or a knock, has each order only at times.
    """
    flying = np.isfinite(turns_hz)
    if np.count_nonzero(flying) < LEAST_AVERAGES:
        return []
    turns = turns_hz[flying]
    middle_hz = float(np.median(turns))
    spacing = float(hz[1])
    density = [CubicSpline(hz, column) for column in np.sqrt(waterfall[:, flying].T)]
    least_db = standing_out_db(len(turns))
    all_power = float(np.median(waterfall[hz >= MOTION_HZ][:, flying].sum(axis=0))) * spacing
    slow, fast = (float(speed) for speed in np.percentile(turns, [1.0, 99.0]))

    lines: list[MotorLine] = []
    taken_hz: list[float] = []
    ratio, tolerance = 1.0, ORDER_TOLERANCE  # of the true speed to the predicted one
    for order in ORDERS:
        folds = None
        if order * fast > rate_hz / 2.0:
            folds = (folded(order * slow, rate_hz), folded(order * fast, rate_hz))
        line = MotorLine(order, order * slow, order * fast, folds)
        lines.append(line)
        seen_hz = folded(order * middle_hz, rate_hz)
        if any(abs(seen_hz - other) < 5.0 * spacing for other in taken_hz):
            continue  # folded onto a lower order, which has it already
        reach = 2.0 * ORDER_TOLERANCE * order
        orders = np.arange(order - reach, order + reach, spacing / middle_hz)
        rows = [
            spline(np.clip(folded(orders * speed, rate_hz), MOTION_HZ, rate_hz / 2.0)) ** 2
            for spline, speed in zip(density, turns, strict=True)
        ]
        by_order = np.median(rows, axis=0)
        floor = max(float(np.median(by_order)), 1e-30)
        above_db = 10.0 * np.log10(np.maximum(by_order, 1e-30) / floor)
        near = np.abs(orders - ratio * order) <= tolerance * order
        top = int(np.argmax(np.where(near, above_db, -np.inf)))
        if above_db[top] < least_db:
            continue
        its = line_about(above_db, top)
        mean = np.mean(rows, axis=0)
        power = np.maximum(mean[its] - np.median(mean), 1e-30) * spacing
        off = (orders[its] - order) * middle_hz
        lines[-1] = MotorLine(
            order,
            line.from_hz,
            line.to_hz,
            folds,
            found_order=float(np.average(orders[its], weights=power)),
            above_floor_db=float(above_db[top]),
            rms=float(np.sqrt(power.sum())),
            share=float(power.sum() / all_power),
            off_hz=float(np.sqrt(np.average(off**2, weights=power))),
        )
        taken_hz.append(seen_hz)
        ratio, tolerance = float(np.average(orders[its], weights=power)) / order, SAME_RATIO
    return lines


def line_about(above_db: Array, top: int) -> slice:
    """The bins that belong to a line: down to twice the floor, and 20 dB below its top."""
    low = max(3.0, float(above_db[top]) - 20.0)
    first = last = top
    while first > 0 and above_db[first - 1] >= low:
        first -= 1
    while last + 1 < len(above_db) and above_db[last + 1] >= low:
        last += 1
    return slice(first, last + 1)


def folded(hz: Any, rate_hz: float) -> Any:
    """Where a frequency shows up after sampling."""
    seen = np.abs(hz - rate_hz * np.round(hz / rate_hz))
    return seen if isinstance(hz, np.ndarray) else float(seen)


def mean_turns(turns: Turns, segment_s: Array, length_s: float) -> Array:
    """Of all motors over each segment; nan where one stood, all idled or nothing is known."""
    means = np.full(len(segment_s), np.nan)
    firsts = np.searchsorted(turns.time_s, segment_s - length_s / 2.0)
    lasts = np.searchsorted(turns.time_s, segment_s + length_s / 2.0)
    expected = length_s * turns.control_hz
    for i, (first, last) in enumerate(zip(firsts, lasts, strict=True)):
        its = turns.hz[first:last]
        if last - first > 0.9 * expected and its.min() > 0.0:
            means[i] = its.mean()
    return np.where(turns.flying(means), means, np.nan)
