"""The gyro's bias at standstill, and how it follows the temperature.

The bias changes from power-up to power-up, so the start-up calibration measures it each time and
include/Calibration.h has no place for it. What the bench tells is whether that will do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from strix.calibrate.outcome import AXES, Incomplete, numbers, sizes
from strix.calibrate.readings import Imu, Mag
from strix.calibrate.standstill import (
    Stretch,
    block_means,
    longest_still,
    mean_and_sigma,
    turned_deg,
)
from strix.flightlog import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST_STILL_S = 10.0
LEAST_SPAN_K = 5.0  # for a slope: the bias' own wander of minutes must not pass for one
MOST_TURN_DEG = 1.0  # of gravity: 10 K move an accelerometer's bias by 0.5 deg (0.8 mg/K)
MOST_MAG_TURN_DEG = 3.0  # of the field: 0.3 uT of noise and a car that passes
START_LIMIT_RAD_S = 0.2  # StartCalibrationConfig::gyroBiasLimit
BLOCKS_FOR_SLOPE_S = 5.0


@dataclass(frozen=True)
class GyroResult:
    where: str
    still: Stretch
    samples: int
    bias_rad_s: Array
    sigma_rad_s: Array
    noise_rad_s: Array  # one sigma of a sample
    temperature_degc: tuple[float, float]  # least and most, nan without a thermometer
    slope_rad_s_k: Array | None
    slope_sigma_rad_s_k: Array | None
    time_s: Array = field(repr=False)  # block means, for the figure
    blocks_rad_s: Array = field(repr=False)

    def sentences(self) -> list[str]:
        low, high = self.temperature_degc
        lines = [
            f"gyro bias over {self.still.duration_s:.1f} s of standstill from "
            f"{self.still.begin_s:.1f} s, {self.samples} samples, sensor axes",
            f"  bias   {numbers(self.bias_rad_s)} rad/s",
            f"  +-     {sizes(self.sigma_rad_s, 6)} rad/s (one sigma; the earth's own turn, "
            "0.00007, is in it)",
            f"  noise  {sizes(self.noise_rad_s)} rad/s a sample",
        ]
        if self.slope_rad_s_k is not None and self.slope_sigma_rad_s_k is not None:
            warm = 10.0 * float(np.abs(self.slope_rad_s_k).max())
            lines += [
                f"  slope  {numbers(self.slope_rad_s_k, 6)} rad/s/K, +- "
                f"{sizes(self.slope_sigma_rad_s_k, 6)}, {low:.1f} to {high:.1f} degC",
                f"  10 K of warming after the start-up calibration move it by {warm:.4f} rad/s "
                "(the filter starts with gyroBiasSigma0)",
            ]
        elif np.isfinite(low):
            lines.append(
                f"  next: for the temperature slope, log a start from cold: {high - low:.1f} K "
                f"here, {LEAST_SPAN_K:.0f} K are needed"
            )
        lines.append(
            "  the start-up calibration takes it off at each power-up: nothing to write"
            if float(np.linalg.norm(self.bias_rad_s)) < START_LIMIT_RAD_S
            else f"  NOT USABLE: the start-up calibration sees a turn above {START_LIMIT_RAD_S}"
        )
        return lines

    def to_dict(self) -> dict[str, Any]:
        return {
            "calibration": "gyro",
            "still": asdict(self.still),
            "samples": self.samples,
            "bias_rad_s": self.bias_rad_s.tolist(),
            "sigma_rad_s": self.sigma_rad_s.tolist(),
            "noise_rad_s": self.noise_rad_s.tolist(),
            "temperature_degc": [None if np.isnan(t) else t for t in self.temperature_degc],
            "slope_rad_s_k": _listed(self.slope_rad_s_k),
            "slope_sigma_rad_s_k": _listed(self.slope_sigma_rad_s_k),
        }

    def members(self) -> Mapping[str, Array]:
        return {}

    def draw(self, figure: Figure) -> None:
        axes = figure.subplots(3, 1, sharex=True)
        for i, axis in enumerate(axes):
            axis.plot(self.time_s, self.blocks_rad_s[:, i], ".-", linewidth=0.6, label="1 s mean")
            axis.axhline(self.bias_rad_s[i], color="tab:orange", label="bias")
            spread = self.sigma_rad_s[i]
            axis.axhspan(
                self.bias_rad_s[i] - spread,
                self.bias_rad_s[i] + spread,
                color="tab:orange",
                alpha=0.3,
            )
            axis.set_ylabel(f"{AXES[i]}, rad/s")
            axis.grid(visible=True, alpha=0.3)
        axes[0].legend(loc="upper right", ncols=2, fontsize="small")
        axes[0].set_title("Gyro at standstill, sensor axes", loc="left")
        axes[-1].set_xlabel("time since power-up, s")


def calibrate_gyro(imu: Imu, mag: Mag | None = None) -> GyroResult:
    """From the longest standstill of the log."""
    stretch = longest_still(imu)
    duration_s = stretch.duration_s if stretch else 0.0
    if stretch is None or duration_s < LEAST_STILL_S:
        at = f" at {stretch.begin_s:.1f} s" if stretch else ""
        lasted_s = float(imu.time_s[-1] - imu.time_s[0])
        raise Incomplete(
            f"{imu.where}: expected {LEAST_STILL_S:.0f} s of standstill, found {duration_s:.1f} s"
            f"{at} in a log of {lasted_s:.1f} s (thresholds: NavigationConfig::standstill); put "
            "the aircraft on a firm table, motors off, and log 20 s"
        )
    still = imu.part(stretch.begin, stretch.end)
    _refuse_turned(still, mag)
    bias, sigma = mean_and_sigma(still.time_s, still.gyro_rad_s)
    blocks = block_means(still.time_s, still.gyro_rad_s)
    slope, slope_sigma = _slope(still)
    return GyroResult(
        where=imu.where,
        still=stretch,
        samples=len(still.time_s),
        bias_rad_s=bias,
        sigma_rad_s=sigma,
        # Differences leave out the wander.
        noise_rad_s=np.diff(still.gyro_rad_s, axis=0).std(axis=0) / np.sqrt(2.0),
        temperature_degc=(
            float(still.temperature_degc.min()),
            float(still.temperature_degc.max()),
        ),
        slope_rad_s_k=slope,
        slope_sigma_rad_s_k=slope_sigma,
        time_s=still.time_s[0] + np.arange(len(blocks)) + 0.5,
        blocks_rad_s=blocks,
    )


def _refuse_turned(still: Imu, mag: Mag | None) -> None:
    """A slow even turn looks like a bias to the gyro: gravity and the field know better."""
    turn = turned_deg(still.time_s, still.accel_m_s2)
    if turn > MOST_TURN_DEG:
        raise Incomplete(
            f"{still.where}: expected a standstill, found gravity turned by {turn:.2f} deg between "
            f"{still.time_s[0]:.1f} and {still.time_s[-1]:.1f} s: put it on something firm"
        )
    if mag is None:
        return
    during = (mag.time_s >= still.time_s[0]) & (mag.time_s <= still.time_s[-1])
    if int(during.sum()) < 20:
        return
    turn = turned_deg(mag.time_s[during], mag.field_ut[during])
    if turn > MOST_MAG_TURN_DEG:
        raise Incomplete(
            f"{mag.where}: expected a standstill, found the field turned by {turn:.2f} deg "
            f"between {still.time_s[0]:.1f} and {still.time_s[-1]:.1f} s: the aircraft moved, or "
            "iron near it"
        )


def _slope(still: Imu) -> tuple[Array | None, Array | None]:
    """Straight line through block means over temperature, and its one sigma."""
    temperature = still.temperature_degc
    if not float(np.ptp(temperature)) > LEAST_SPAN_K:  # nor with nan
        return None, None
    table = np.column_stack([temperature, still.gyro_rad_s])
    blocks = block_means(still.time_s, table, BLOCKS_FOR_SLOPE_S)
    x = blocks[:, 0] - blocks[:, 0].mean()
    if len(x) < 4:
        return None, None
    y = blocks[:, 1:] - blocks[:, 1:].mean(axis=0)
    slope = x @ y / (x @ x)
    left = y - np.outer(x, slope)
    sigma = np.sqrt((left**2).sum(axis=0) / (len(x) - 2) / (x @ x))
    return np.asarray(slope), np.asarray(sigma)


def _listed(values: Array | None) -> list[float] | None:
    return None if values is None else [float(value) for value in values]
