"""Allan deviation of the IMU at rest, and the noise numbers of the filter.

Over the averaging time tau the Allan variance of white noise falls, that of a random walk grows,
between them the bias' flicker keeps it level (IEEE 952-1997, annex C):

    sigma^2(tau) = N^2 / tau + B^2 2 ln 2 / pi + K^2 tau / 3

N: angle or velocity random walk, unit/sqrt(Hz). B: bias instability. K: rate random walk, unit
times sqrt(Hz) = unit/sqrt(s). The three are fitted together, none below zero; how sure each is
comes from the tau at which it shows most, of whose length only a few fit into the log.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import allantools
import numpy as np
from scipy.optimize import nnls

from strix.calibrate.outcome import AXES, Incomplete
from strix.calibrate.readings import Imu
from strix.calibrate.standstill import GAP_S, Stretch, longest_still
from strix.flightlog import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST_STILL_S = 60.0
GOOD_STILL_S = 600.0
LEAST_CLUSTERS = 9  # of a tau in the log: beyond, the deviation is known to 25 % at best
TAUS_A_DECADE = 10
# The low-pass of the sensor (111 Hz and 120 Hz) bends the curve below this.
SHORTEST_TAU_S = 0.02
FLICKER = 2.0 * np.log(2.0) / np.pi  # B's minimum is 0.664 B, its square root


@dataclass(frozen=True)
class AxisNoise:
    """Of one axis; sigmas are relative, None where the log does not show the term."""

    white: float
    white_sigma: float | None
    instability: float
    instability_sigma: float | None
    walk: float
    walk_sigma: float | None
    tau_s: Array = field(repr=False)
    deviation: Array = field(repr=False)
    error: Array = field(repr=False)

    def fitted(self, tau_s: Array) -> Array:
        return np.asarray(
            np.sqrt(
                self.white**2 / tau_s + FLICKER * self.instability**2 + self.walk**2 * tau_s / 3.0
            )
        )

    def to_dict(self) -> dict[str, float | None]:
        return {
            "white": self.white,
            "white_relative_sigma": self.white_sigma,
            "bias_instability": self.instability,
            "bias_instability_relative_sigma": self.instability_sigma,
            "random_walk": self.walk,
            "random_walk_relative_sigma": self.walk_sigma,
        }


@dataclass(frozen=True)
class AllanResult:
    where: str
    still: Stretch
    rate_hz: float
    gyro: list[AxisNoise]
    accel: list[AxisNoise]

    def sentences(self) -> list[str]:
        lines = [
            f"Allan deviation over {self.still.duration_s:.0f} s of standstill from "
            f"{self.still.begin_s:.1f} s at {self.rate_hz:.0f} Hz, sensor axes"
        ]
        for name, unit, axes in (
            ("gyro", "rad/s", self.gyro),
            ("accelerometer", "m/s^2", self.accel),
        ):
            rows = (
                (f"white noise, {unit}/sqrt(Hz)", [(a.white, a.white_sigma) for a in axes]),
                (f"bias instability, {unit}", [(a.instability, a.instability_sigma) for a in axes]),
                (f"random walk, {unit}/sqrt(s)", [(a.walk, a.walk_sigma) for a in axes]),
            )
            lines += [
                f"  {name:13} {what:30}" + "  ".join(_shown(*one) for one in values)
                for what, values in rows
            ]
        lines.append("  the filter (NavigationConfig), by the worst axis:")
        lines += [f"    {line}" for line in self._filter_lines()]
        if self.still.duration_s < GOOD_STILL_S:
            lines.append(
                f"  next: {GOOD_STILL_S / 60.0:.0f} min at rest, an hour for the random walk: "
                f"{self.still.duration_s / 60.0:.1f} min show averages up to "
                f"{self.gyro[0].tau_s[-1]:.0f} s only"
            )
        return lines

    def suggestions(self) -> dict[str, float | None]:
        """NavigationConfig's names; None where the log does not show it."""
        return {
            "gyroNoise": _worst([(a.white, a.white_sigma) for a in self.gyro]),
            "accelNoise": _worst([(a.white, a.white_sigma) for a in self.accel]),
            "gyroBiasWalk": _worst([(a.walk, a.walk_sigma) for a in self.gyro]),
            "accelBiasWalk": _worst([(a.walk, a.walk_sigma) for a in self.accel]),
        }

    def _filter_lines(self) -> list[str]:
        """Beside the defaults, which also cover vibration and scale errors: never go below."""
        from strix import _core

        defaults = _core.NavigationConfig()
        lines = []
        for name, measured in self.suggestions().items():
            default = float(getattr(defaults, name))
            if measured is None:
                lines.append(f"{name}: not seen in this log; the default, {default:.2g}, stands")
            elif measured <= default:
                lines.append(
                    f"{name}: measured {measured:.2e}; the default, {default:.2g}, covers it"
                )
            else:
                lines.append(
                    f"config.navigation.{name} = {measured:.2e}F;  // the default is {default:.2g}"
                )
        return lines

    def to_dict(self) -> dict[str, Any]:
        return {
            "calibration": "allan",
            "duration_s": self.still.duration_s,
            "rate_hz": self.rate_hz,
            "gyro": [axis.to_dict() for axis in self.gyro],
            "accel": [axis.to_dict() for axis in self.accel],
            "navigation": self.suggestions(),
        }

    def members(self) -> Mapping[str, Array]:
        return {}

    def draw(self, figure: Figure) -> None:
        panels = figure.subplots(1, 2)
        for axis, name, unit, rows in zip(
            panels,
            ("Gyro", "Accelerometer"),
            ("rad/s", "m/s^2"),
            (self.gyro, self.accel),
            strict=True,
        ):
            colours = ("tab:blue", "tab:orange", "tab:green")
            for letter, row, colour in zip(AXES, rows, colours, strict=True):
                bottom = np.maximum(row.deviation - row.error, 0.1 * row.deviation)
                top = row.deviation + row.error
                axis.fill_between(row.tau_s, bottom, top, color=colour, alpha=0.2)
                axis.loglog(
                    row.tau_s, row.deviation, ".-", color=colour, label=letter, markersize=4
                )
                axis.loglog(row.tau_s, row.fitted(row.tau_s), "--", color=colour, linewidth=0.8)
            worst = max(rows, key=lambda row: row.white)
            tau_s, deviation = worst.tau_s, worst.deviation
            low = 0.5 * float(min(row.deviation.min() for row in rows))
            high = 2.0 * float(deviation.max())
            flicker = float(np.sqrt(FLICKER)) * worst.instability
            for values, dash, what in (
                (worst.white / np.sqrt(tau_s), ":", f"N = {worst.white:.2e}"),
                (np.full_like(tau_s, flicker), "-.", f"0.664 B = {flicker:.2e}"),
                (worst.walk * np.sqrt(tau_s / 3.0), "--", f"K = {worst.walk:.2e}"),
            ):
                if values.max() > low:
                    axis.loglog(tau_s, values, dash, color="black", linewidth=0.9, label=what)
            axis.set_ylim(low, high)
            for side in (axis.xaxis, axis.yaxis):
                side.set_major_formatter("{x:g}")
            axis.set_title(f"{name}, lines of the noisiest axis", loc="left")
            axis.set_xlabel("averaging time, s")
            axis.set_ylabel(f"Allan deviation, {unit}")
            axis.grid(visible=True, which="both", alpha=0.2)
            axis.legend(fontsize="small")


def measure_allan(imu: Imu) -> AllanResult:
    """From the longest standstill of the log."""
    stretch = longest_still(imu)
    duration_s = stretch.duration_s if stretch else 0.0
    if stretch is None or duration_s < LEAST_STILL_S:
        raise Incomplete(
            f"{imu.where}: expected a standstill of {LEAST_STILL_S:.0f} s at least and of "
            f"{GOOD_STILL_S / 60.0:.0f} min for sure numbers, without a gap of {GAP_S} s, found "
            f"{duration_s:.1f} s in {imu.time_s[-1] - imu.time_s[0]:.1f} s: leave the aircraft on "
            "a firm floor, motors off, nobody walking by"
        )
    still = imu.part(stretch.begin, stretch.end)
    rate_hz = still.rate_hz
    return AllanResult(
        where=imu.where,
        still=stretch,
        rate_hz=rate_hz,
        gyro=[axis_noise(still.gyro_rad_s[:, i], rate_hz) for i in range(3)],
        accel=[axis_noise(still.accel_m_s2[:, i], rate_hz) for i in range(3)],
    )


def axis_noise(values: Array, rate_hz: float) -> AxisNoise:
    """Of one axis, evenly sampled."""
    duration_s = len(values) / rate_hz
    shortest_s = max(SHORTEST_TAU_S, 1.0 / rate_hz)
    longest_s = duration_s / LEAST_CLUSTERS
    decades = np.log10(longest_s / shortest_s)
    wanted = np.geomspace(shortest_s, longest_s, max(4, round(decades * TAUS_A_DECADE)))
    tau_s, deviation, _, _ = allantools.oadev(
        values - values.mean(), rate=rate_hz, data_type="freq", taus=wanted
    )
    # One sigma of a deviation from n clusters (IEEE 952-1997, annex C).
    relative = 1.0 / np.sqrt(2.0 * (duration_s / tau_s - 1.0))
    variance = deviation**2
    terms = np.column_stack([1.0 / tau_s, np.full_like(tau_s, FLICKER), tau_s / 3.0])
    weight = 1.0 / (2.0 * relative * variance)  # of a variance; its logarithm has twice the sigma
    squares, _ = nnls(terms * weight[:, None], variance * weight)
    parts = terms * squares
    sizes: list[float] = []
    sigmas: list[float | None] = []
    for column in range(3):
        share = parts[:, column] / parts.sum(axis=1)
        at = int(np.argmax(share))
        seen = squares[column] > 0.0 and share[at] > 0.5
        sizes.append(float(np.sqrt(squares[column])))
        sigmas.append(float(relative[at] / share[at]) if seen else None)
    return AxisNoise(
        sizes[0],
        sigmas[0],
        sizes[1],
        sigmas[1],
        sizes[2],
        sigmas[2],
        np.asarray(tau_s),
        np.asarray(deviation),
        np.asarray(deviation * relative),
    )


def _shown(value: float, sigma: float | None) -> str:
    return f"{'not seen':>18}" if sigma is None else f"{value:.2e} +- {100.0 * sigma:4.1f} %"


def _worst(values: list[tuple[float, float | None]]) -> float | None:
    return max((value for value, sigma in values if sigma is not None), default=None)
