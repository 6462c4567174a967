"""A lithium-polymer battery: rest voltage over charge, a resistance, and a slower one behind it.

The Thevenin model: V = V_rest(charge) - R I - u, with du/dt = (r I - u) / T. All but the rest
voltage and the way it falls are ours, as no figure of the aircraft's batteries is published.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

# Rest voltage of a cell, V, every 5 % from empty to full: the LiPo voltage chart that
# blog.ampow.com and many sellers print.
_REST_V = (
    3.27, 3.61, 3.69, 3.71, 3.73, 3.75, 3.77, 3.79, 3.80, 3.82, 3.84,
    3.85, 3.87, 3.91, 3.95, 3.98, 4.02, 4.08, 4.11, 4.15, 4.20,
)  # fmt: skip

# Motor and ESC together: shaft power over battery power. Brushless motors of this size reach
# 0.7 to 0.85 at hover; Quad5in then draws 137 W, 6 A, which is usual for its size.
MOTOR_EFFICIENCY = 0.75
ELECTRONICS_W = 3.0  # ours: Teensy, sensors, GPS and receiver, 0.6 A at 5 V


@dataclass(frozen=True)
class BatteryNumbers:
    """One cell, and how long the pack lasts."""

    endurance_s: float = 420.0  # of the vehicle in hover, from full to empty; ours, usual: 7 min
    resistance_ohm: float = 0.008  # a cell's share of pack, leads and plug; ours
    slow_resistance_ohm: float = 0.004  # of diffusion; ours
    slow_time_s: float = 15.0  # ours


def rest_voltage_v(charge: float) -> float:
    """Of a cell; charge is 0 to 1, and an empty cell stays at its lowest."""
    place = min(max(charge, 0.0), 1.0) * (len(_REST_V) - 1)
    below = min(int(place), len(_REST_V) - 2)
    return _REST_V[below] + (place - below) * (_REST_V[below + 1] - _REST_V[below])


# Mean over the charge, by the trapezoidal rule, which is exact on straight pieces.
MEAN_REST_V = (sum(_REST_V) - 0.5 * (_REST_V[0] + _REST_V[-1])) / (len(_REST_V) - 1)


class Battery:
    """Starts full and rested; voltage and current are the pack's."""

    def __init__(self, numbers: BatteryNumbers, cells: int, hover_power_w: float) -> None:
        """hover_power_w is what the vehicle draws in hover, electronics included."""
        if cells <= 0:
            raise ValueError(f"a battery has at least 1 cell, found {cells}")
        self._cells = cells
        self._resistance = cells * numbers.resistance_ohm
        self._slow_resistance = cells * numbers.slow_resistance_ohm
        self._slow_time_s = numbers.slow_time_s
        self.capacity_c = hover_power_w * numbers.endurance_s / (cells * MEAN_REST_V)
        self.charge = 1.0  # 0 to 1
        self.current_a = 0.0
        self._slow_v = 0.0
        self.voltage_v = cells * rest_voltage_v(1.0)

    def advance(self, power_w: float, duration_s: float) -> None:
        """Give that power for a time; more than the resistance lets through is not given.

        P = V I and V = E - R I: R I^2 - E I + P = 0, of whose two solutions the one with the
        smaller current is stable.
        """
        electromotive_v = self._cells * rest_voltage_v(self.charge) - self._slow_v
        r = self._resistance
        root = math.sqrt(max(electromotive_v**2 - 4.0 * r * power_w, 0.0))
        self.voltage_v = 0.5 * (electromotive_v + root)
        self.current_a = (electromotive_v - self.voltage_v) / r
        self.charge = max(self.charge - self.current_a * duration_s / self.capacity_c, 0.0)
        settle = 1.0 - math.exp(-duration_s / self._slow_time_s)
        self._slow_v += (self._slow_resistance * self.current_a - self._slow_v) * settle
