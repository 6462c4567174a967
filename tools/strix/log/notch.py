"""Which notch the motors' line in a gyro log asks for (lib/Sensors/GyroFilter.h)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from strix import _core
from strix.log.motor_lines import MotorLine

# Below a tenth of the power above 20 Hz a perfect notch lowers the RMS by less than 5 %: not worth
# its lag.
LEAST_SHARE = 0.1
MARGIN = 1.2  # between the slowest and fastest turns of this log and the notch's limits
HIGHEST = 0.45  # of the sample rate: isFilterFrequency
# Q = f / (6 d) leaves (2 Q d / f)^2 = 1/9 of the power of a line that is d off, RMS. Not above 5,
# where the same is left of a line that is 3 % off: no ESC curve is better than that.
SPREADS, MOST_Q = 6.0, 5.0
LAG_AT_HZ = 10.0


@dataclass(frozen=True)
class NotchProposal:
    min_hz: float
    max_hz: float
    q: float
    harmonics: int
    lag_deg: float  # at LAG_AT_HZ, while the motors turn as slowly as min_hz

    def lines(self) -> list[str]:
        """To paste into include/FlightConfig.h."""
        return [
            f"config.gyroFilter.notchMin = {self.min_hz:.1f}F;",
            f"config.gyroFilter.notchMax = {self.max_hz:.1f}F;",
            f"config.gyroFilter.notchQ = {self.q:.1f}F;",
            f"config.gyroFilter.notchHarmonics = {self.harmonics};",
        ]


def propose(
    lines: Sequence[MotorLine], rate_hz: float, control_hz: float, motor_time_constant_s: float
) -> NotchProposal | None:
    """None when no line is worth a notch, or none that is can be reached by one."""
    highest_hz = HIGHEST * rate_hz
    worth = [
        line
        for line in lines
        if line.found_order is not None and line.share >= LEAST_SHARE and line.to_hz <= highest_hz
    ]
    if not worth:
        return None
    harmonics = max(line.order for line in worth)
    first = lines[0]
    middle_hz = (first.from_hz + first.to_hz) / 2.0
    q = min(line.order * middle_hz / (SPREADS * line.off_hz) for line in worth)
    min_hz = float(np.floor(max(first.from_hz / MARGIN, rate_hz / 200.0 + 1.0)))
    max_hz = max(min_hz, float(np.floor(min(first.to_hz * MARGIN, highest_hz / harmonics))))
    config = _core.GyroFilterConfig()
    config.notchMin, config.notchMax = min_hz, max_hz
    config.notchQ = float(np.clip(np.floor(10.0 * q) / 10.0, 1.0, MOST_Q))
    config.notchHarmonics = harmonics
    filter_ = _core.GyroFilter(config, rate_hz, control_hz, motor_time_constant_s)
    assert filter_.valid  # the flight code will take it
    return NotchProposal(min_hz, max_hz, config.notchQ, harmonics, _lag_deg(filter_, rate_hz))


def _lag_deg(filter_: _core.GyroFilter, rate_hz: float) -> float:
    """Of a sine at LAG_AT_HZ through the flight code, by correlation over whole periods."""
    period = round(rate_hz / LAG_AT_HZ)
    turns = np.exp(2j * np.pi * np.arange(20 * period) / period)
    sine = np.stack([turns.real, turns.imag, 0.0 * turns.real], axis=1).astype(np.float32)
    out = filter_.update(sine)[-10 * period :].astype(np.float64)  # settled
    gain = np.mean((out[:, 0] + 1j * out[:, 1]) / turns[-10 * period :])
    return float(-np.degrees(np.angle(gain)))
