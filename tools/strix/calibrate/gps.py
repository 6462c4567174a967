"""The GPS at rest: where it is, how far the fixes scatter, and for how long they err alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from strix.calibrate.outcome import Incomplete
from strix.calibrate.readings import Gps
from strix.flightlog import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST_FIXES = 100
LEAST_S = 60.0
KNOT_M_S = 0.514444
RADIUS_M = 6_371_000.0  # metres for an angle; 0.3 % off, of a scatter of metres
MOST_SPEED_M_S = 1.0  # mean of a receiver at rest
MOST_SPREAD_M = 50.0


@dataclass(frozen=True)
class GpsResult:
    where: str
    duration_s: float
    fixes: int
    left_out: int  # without a three-dimensional fix
    lat_deg: float
    lon_deg: float
    alt_m: float
    scatter_m: Array  # north, east, up: one sigma
    mean_sigma_m: Array  # of the mean, correlation counted
    correlation_s: float
    velocity_sigma_m_s: float  # of one horizontal component
    hdop: float  # median
    satellites: float  # median
    offset_m: Array = field(repr=False)  # (N, 3), for the figure

    def sentences(self) -> list[str]:
        north, east, up = self.scatter_m
        position = float(np.hypot(north, east) / np.sqrt(2.0))
        return [
            f"GPS over {self.duration_s:.0f} s at rest, {self.fixes} fixes "
            f"({self.left_out} left out), median {self.satellites:.0f} satellites, HDOP "
            f"{self.hdop:.1f}",
            f"  mean   {self.lat_deg:.7f} deg, {self.lon_deg:.7f} deg, {self.alt_m:.1f} m, +- "
            f"{self.mean_sigma_m[0]:.2f} m north, {self.mean_sigma_m[1]:.2f} m east, "
            f"{self.mean_sigma_m[2]:.2f} m up",
            f"  scatter {north:.2f} m north, {east:.2f} m east, {up:.2f} m up; velocity "
            f"{self.velocity_sigma_m_s:.3f} m/s a component",
            f"  fixes err alike for {self.correlation_s:.1f} s: {self.independent:.0f} of them "
            "are worth something of their own",
            f"  the filter, at least: config.navigation.gpsPositionSigma = {position:.2f}F;  // m",
            "                        config.navigation.gpsVelocitySigma = "
            f"{self.velocity_sigma_m_s:.3f}F;  // m/s",
            "  a receiver at rest filters itself: in flight, and on another day, it is worse",
        ]

    @property
    def independent(self) -> float:
        return max(1.0, self.duration_s / max(2.0 * self.correlation_s, 1e-9))

    def to_dict(self) -> dict[str, Any]:
        return {
            "calibration": "gps",
            "duration_s": self.duration_s,
            "fixes": self.fixes,
            "left_out": self.left_out,
            "lat_deg": self.lat_deg,
            "lon_deg": self.lon_deg,
            "alt_m": self.alt_m,
            "scatter_neu_m": self.scatter_m.tolist(),
            "mean_sigma_neu_m": self.mean_sigma_m.tolist(),
            "correlation_s": self.correlation_s,
            "velocity_sigma_m_s": self.velocity_sigma_m_s,
            "hdop": self.hdop,
            "satellites": self.satellites,
        }

    def members(self) -> Mapping[str, Array]:
        return {}

    def draw(self, figure: Figure) -> None:
        axis = figure.subplots()
        axis.plot(self.offset_m[:, 1], self.offset_m[:, 0], ".-", linewidth=0.4, markersize=3)
        axis.plot([0.0], [0.0], "x", color="tab:orange", markersize=12, zorder=5, label="mean")
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_xlabel("east of the mean, m")
        axis.set_ylabel("north of the mean, m")
        axis.set_title("GPS fixes of an aircraft at rest", loc="left")
        axis.grid(visible=True, alpha=0.3)
        axis.legend()


def calibrate_gps(gps: Gps) -> GpsResult:
    usable = gps.fix_type >= 3
    time_s = gps.time_s[usable]
    duration_s = float(time_s[-1] - time_s[0]) if len(time_s) else 0.0
    if len(time_s) < LEAST_FIXES or duration_s < LEAST_S:
        raise Incomplete(
            f"{gps.where}: expected {LEAST_FIXES} three-dimensional fixes over {LEAST_S:.0f} s, "
            f"found {len(time_s)} of {len(usable)} over {duration_s:.1f} s: open sky, antenna up, "
            "10 minutes"
        )
    lat, lon, alt = gps.lat_deg[usable], gps.lon_deg[usable], gps.alt_m[usable]
    # About the first fix, and around the date line.
    d_lat, d_lon = lat - lat[0], (lon - lon[0] + 180.0) % 360.0 - 180.0
    north = np.radians(d_lat) * RADIUS_M
    east = np.radians(d_lon) * RADIUS_M * np.cos(np.radians(lat[0]))
    offset = np.column_stack([north, east, alt])
    offset = offset - offset.mean(axis=0)
    speed = gps.speed_knots[usable] * KNOT_M_S
    spread_m = float(np.linalg.norm(offset[:, :2], axis=1).max())
    if float(np.median(speed)) > MOST_SPEED_M_S or spread_m > MOST_SPREAD_M:
        raise Incomplete(
            f"{gps.where}: expected an aircraft at rest, found a median speed of "
            f"{np.median(speed):.2f} m/s and fixes up to {spread_m:.0f} m from their mean"
        )
    correlation_s = max(_correlation_s(time_s, offset[:, axis]) for axis in range(3))
    scatter = offset.std(axis=0)
    independent = max(1.0, duration_s / (2.0 * correlation_s))
    course = np.radians(gps.course_deg[usable])
    velocity = np.column_stack([speed * np.cos(course), speed * np.sin(course)])
    mean_lon = (lon[0] + float(d_lon.mean()) + 180.0) % 360.0 - 180.0
    return GpsResult(
        where=gps.where,
        duration_s=duration_s,
        fixes=len(time_s),
        left_out=int((~usable).sum()),
        lat_deg=float(lat.mean()),
        lon_deg=float(mean_lon),
        alt_m=float(alt.mean()),
        scatter_m=scatter,
        mean_sigma_m=scatter / np.sqrt(independent),
        correlation_s=correlation_s,
        velocity_sigma_m_s=float(np.sqrt(np.mean(velocity**2))),
        hdop=float(np.median(gps.hdop[usable])),
        satellites=float(np.median(gps.satellites[usable])),
        offset_m=offset,
    )


def _correlation_s(time_s: Array, values: Array) -> float:
    """Time after which the autocorrelation is below 1/e; at least one fix."""
    period_s = float(np.median(np.diff(time_s)))
    x = values - values.mean()
    size = len(x)
    spectrum = np.fft.rfft(x, 2 * size)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2)[:size]
    if correlation[0] <= 0.0:
        return period_s
    below = np.flatnonzero(correlation / correlation[0] < np.exp(-1.0))
    return period_s * float(below[0] if below.size else size)
