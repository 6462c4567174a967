"""The altimeter at rest: noise, drift over the log, and what the temperature does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from strix.calibrate.outcome import Incomplete
from strix.calibrate.readings import Baro, Imu
from strix.calibrate.standstill import block_means, still_stretches
from strix.flightlog import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST_S = 30.0
LEAST_SPAN_K = 5.0
LEAST_STILL = 0.9  # part of the log, where there is an IMU to tell
BLOCK_S = 5.0
# International Standard Atmosphere, as Geodesy.h: h = T0/L (1 - (p/p0)^k), so dh/dp = -T0 k / (L p)
# at p = p0.
SCALE_M = 288.15 / 0.0065 * 0.190263
AIR_PA = (30_000.0, 110_000.0)  # 9 km up, and more than was ever measured at the sea


@dataclass(frozen=True)
class AltimeterResult:
    where: str
    duration_s: float
    samples: int
    pressure_pa: float  # mean
    noise_pa: float  # one sigma of a sample
    drift_pa_min: float  # straight line
    drift_sigma_pa_min: float
    wander_pa: float  # one sigma of 5 s means about that line
    temperature_degc: tuple[float, float]
    slope_pa_k: float | None
    slope_sigma_pa_k: float | None
    time_s: Array = field(repr=False)  # for the figure
    all_pa: Array = field(repr=False)

    @property
    def metres_per_pa(self) -> float:
        return SCALE_M / self.pressure_pa

    def sentences(self) -> list[str]:
        per = self.metres_per_pa
        low, high = self.temperature_degc
        lines = [
            f"altimeter over {self.duration_s:.0f} s at rest, {self.samples} samples, mean "
            f"{self.pressure_pa:.1f} Pa, where 1 Pa is {per:.4f} m",
            f"  noise  {self.noise_pa:.2f} Pa, {self.noise_pa * per:.3f} m a sample",
            f"  drift  {self.drift_pa_min:+.2f} +- {self.drift_sigma_pa_min:.2f} Pa/min, "
            f"{-60.0 * self.drift_pa_min * per:+.2f} m an hour (weather included)",
            f"  wander {self.wander_pa:.2f} Pa, {self.wander_pa * per:.3f} m: 5 s means about it",
        ]
        if self.slope_pa_k is None:
            lines.append(
                f"  next: for the temperature coefficient, log a start from cold: {high - low:.1f} "
                f"K here, {LEAST_SPAN_K:.0f} K are needed"
            )
        else:
            lines.append(
                f"  temperature {self.slope_pa_k:+.2f} +- {self.slope_sigma_pa_k:.2f} Pa/K, "
                f"{low:.1f} to {high:.1f} degC (or the weather: repeat it)"
            )
        lines.append(
            f"  the filter: config.navigation.alt = {{{self.height_sigma_m:.2f}F, 0.0F}};  // m"
        )
        return lines

    @property
    def height_sigma_m(self) -> float:
        """Noise and wander together: a filter that is told the noise alone follows the wander."""
        return float(np.hypot(self.noise_pa, self.wander_pa)) * self.metres_per_pa

    def to_dict(self) -> dict[str, Any]:
        return {
            "calibration": "altimeter",
            "duration_s": self.duration_s,
            "samples": self.samples,
            "pressure_pa": self.pressure_pa,
            "noise_pa": self.noise_pa,
            "drift_pa_min": self.drift_pa_min,
            "drift_sigma_pa_min": self.drift_sigma_pa_min,
            "wander_pa": self.wander_pa,
            "temperature_degc": list(self.temperature_degc),
            "slope_pa_k": self.slope_pa_k,
            "slope_sigma_pa_k": self.slope_sigma_pa_k,
            "height_sigma_m": self.height_sigma_m,
        }

    def members(self) -> Mapping[str, Array]:
        return {}

    def draw(self, figure: Figure) -> None:
        axis = figure.subplots()
        means = block_means(self.time_s, self.all_pa[:, None], BLOCK_S)[:, 0]
        middle_s = self.time_s[0] + BLOCK_S * (np.arange(len(means)) + 0.5)
        axis.plot(self.time_s, self.all_pa - self.pressure_pa, ".", markersize=1, label="samples")
        axis.plot(middle_s, means - self.pressure_pa, "o-", markersize=3, label="5 s means")
        axis.set_xlabel("time since power-up, s")
        axis.set_ylabel("pressure minus mean, Pa")
        axis.set_title("Altimeter at rest", loc="left")
        axis.grid(visible=True, alpha=0.3)
        axis.legend()


def calibrate_altimeter(baro: Baro, imu: Imu | None) -> AltimeterResult:
    """`imu` tells whether the aircraft lay still."""
    time_s, pressure = baro.time_s, baro.pressure_pa
    duration_s = float(time_s[-1] - time_s[0])
    if duration_s < LEAST_S:
        raise Incomplete(
            f"{baro.where}: expected {LEAST_S:.0f} s at rest, found {duration_s:.1f} s"
        )
    low_pa, high_pa = AIR_PA
    if pressure.min() < low_pa or pressure.max() > high_pa:
        raise Incomplete(
            f"{baro.where}: expected pressures of air, {low_pa:.0f} to {high_pa:.0f} Pa, found "
            f"{pressure.min():.0f} to {pressure.max():.0f} Pa"
        )
    if imu is not None:
        still_s = sum(stretch.duration_s for stretch in still_stretches(imu))
        lasted_s = float(imu.time_s[-1] - imu.time_s[0])
        if still_s < LEAST_STILL * lasted_s:
            raise Incomplete(
                f"{baro.where}: expected an aircraft at rest, found it still for {still_s:.0f} s "
                f"of {lasted_s:.0f} s"
            )
    blocks = block_means(
        time_s, np.column_stack([time_s, pressure, baro.temperature_degc]), BLOCK_S
    )
    minutes, means, degrees = blocks[:, 0] / 60.0, blocks[:, 1], blocks[:, 2]
    drift, drift_sigma, wander = _line(minutes, means)
    slope = slope_sigma = None
    if float(np.ptp(baro.temperature_degc)) > LEAST_SPAN_K:
        slope, slope_sigma, _ = _line(degrees, means)
    return AltimeterResult(
        where=baro.where,
        duration_s=duration_s,
        samples=len(time_s),
        pressure_pa=float(pressure.mean()),
        noise_pa=float(np.diff(pressure).std() / np.sqrt(2.0)),
        drift_pa_min=drift,
        drift_sigma_pa_min=drift_sigma,
        wander_pa=wander,
        temperature_degc=(
            float(baro.temperature_degc.min()),
            float(baro.temperature_degc.max()),
        ),
        slope_pa_k=slope,
        slope_sigma_pa_k=slope_sigma,
        time_s=time_s,
        all_pa=pressure,
    )


def _line(x: Array, y: Array) -> tuple[float, float, float]:
    """Slope, its one sigma, and one sigma about the line."""
    x = x - x.mean()
    slope = float(x @ (y - y.mean()) / (x @ x))
    left = y - y.mean() - slope * x
    sigma = float(np.sqrt((left**2).sum() / (len(x) - 2)))
    return slope, sigma / float(np.sqrt(x @ x)), sigma
