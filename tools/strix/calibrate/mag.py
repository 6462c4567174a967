"""Magnetometer: hard and soft iron from a log in which the aircraft was turned every way.

    field = A (raw - h),  A symmetric: |field| is the same in every attitude.

An ellipsoid has nine numbers and needs the field seen from most directions; where it was not, a
bent part of the surface passes for a shifted whole, and only the centre of a sphere is fitted (the
hard iron, which is most of the error). Where even that is loose, nothing is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from strix.calibrate.accel import OFF_DIAGONAL, symmetric
from strix.calibrate.outcome import Incomplete, numbers, sizes, unit
from strix.calibrate.readings import Mag
from strix.calibrate.sphere import (
    CELLS,
    advice,
    cell_of,
    coverage,
    even_weights,
    unseen,
    weighted_median,
)
from strix.flightlog import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ELLIPSOID_COVERAGE = 0.6
SPHERE_COVERAGE = 0.2
LEAST_SAMPLES = 200
# One sigma of the hard iron, as a part of the field, beyond which a sphere is refused: 2 % turn
# the heading by 1.2 deg where the field is level, by 3 deg where it dips by 65 deg.
MOST_CENTRE_SIGMA = 0.02
# RMS of |field| about its mean, and part of the directions left out, beyond which the field was not
# the same everywhere: 5 % across it are 3 deg of heading where it is level, 7 deg at 65 deg dip.
MOST_RESIDUAL = 0.05
GOOD_RESIDUAL = 0.03
MOST_OUTLIERS = 0.1
MOST_STRETCH = 1.5  # of an axis (ArduPilot's limit): no iron of an aircraft does more
EARTH_UT = (20.0, 70.0)  # least and most on its surface (IGRF: 22 to 67)
# A sphere smaller than this is the noise about one attitude: no scale is off by half.
LEAST_RADIUS_UT = 10.0
OUTLIER = 4.0  # robust sigmas


@dataclass(frozen=True)
class MagResult:
    where: str
    samples: int
    outliers: int
    model: str  # "ellipsoid" or "sphere"
    hard_iron_ut: Array
    hard_sigma_ut: Array
    soft_iron: Array  # 3x3, symmetric
    soft_sigma: Array  # 3x3; zeros for a sphere
    field_ut: float  # length of the corrected field
    coverage: float  # part of the directions that were seen
    before: float  # RMS of |raw| about its mean, as a part of it
    after: float
    holes: list[Array] = field(repr=False)  # directions in sensor axes
    raw_ut: Array = field(repr=False)  # samples used, for the figure

    def sentences(self) -> list[str]:
        what = "hard and soft iron" if self.model == "ellipsoid" else "hard iron only"
        lines = [
            f"magnetometer, {what}, from {self.samples} samples "
            f"({self.outliers} outliers left out), sensor axes",
            f"  coverage {100 * self.coverage:.0f} % of all directions; |field| constant within "
            f"{100 * self.after:.2f} % RMS (before: {100 * self.before:.2f} %)",
            f"  hard iron  {numbers(self.hard_iron_ut, 2)} uT, +- {sizes(self.hard_sigma_ut, 2)}",
        ]
        if self.model == "ellipsoid":
            lines += [
                f"  soft iron  {numbers(row, 4)}   +- {sizes(sigma, 4)}"
                for row, sigma in zip(self.soft_iron, self.soft_sigma, strict=True)
            ]
        lines.append(f"  field {self.field_ut:.1f} uT")
        low, high = EARTH_UT
        if not low <= self.field_ut <= high:
            lines.append(
                f"  but the earth's is {low:.0f} to {high:.0f} uT: iron near, or a wrong scale; "
                "--field sets the length"
            )
        if self.after > GOOD_RESIDUAL:
            lines.append(
                f"  next: {100 * self.after:.1f} % is much: again, farther from iron and cars, "
                "outside, with the cables tied as in flight"
            )
        if self.model == "sphere":
            lines.append(
                f"  next: for the soft iron too, {100 * ELLIPSOID_COVERAGE:.0f} % of the "
                f"directions are needed; {advice(self.holes)}"
            )
        return lines

    def to_dict(self) -> dict[str, Any]:
        return {
            "calibration": "mag",
            "samples": self.samples,
            "outliers": self.outliers,
            "model": self.model,
            "hard_iron_ut": self.hard_iron_ut.tolist(),
            "hard_iron_sigma_ut": self.hard_sigma_ut.tolist(),
            "soft_iron": self.soft_iron.tolist(),
            "soft_iron_sigma": self.soft_sigma.tolist(),
            "field_ut": self.field_ut,
            "coverage": self.coverage,
            "norm_rms_before": self.before,
            "norm_rms_after": self.after,
        }

    def members(self) -> Mapping[str, Array]:
        return {"hardIron": self.hard_iron_ut, "softIron": self.soft_iron}

    def draw(self, figure: Figure) -> None:
        corrected = (self.raw_ut - self.hard_iron_ut) @ self.soft_iron.T
        axes = figure.subplots(2, 3)
        step = max(1, len(corrected) // 4000)
        around = np.linspace(0.0, 2.0 * np.pi, 200)
        circle = self.field_ut * np.column_stack([np.cos(around), np.sin(around)])
        for column, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
            for row, values in enumerate((self.raw_ut, corrected)):
                axis = axes[row, column]
                axis.plot(values[::step, i], values[::step, j], ".", markersize=1.5)
                axis.plot(circle[:, 0], circle[:, 1], color="tab:orange", linewidth=1.0)
                axis.plot([0.0], [0.0], "+", color="black")
                axis.set_aspect("equal", adjustable="datalim")
                axis.set_xlabel(f"{'xyz'[i]}, uT")
                axis.set_ylabel(f"{'xyz'[j]}, uT")
                axis.grid(visible=True, alpha=0.3)
        axes[0, 0].set_title("Raw; the circle is the corrected field's length", loc="left")
        axes[1, 0].set_title(
            f"Corrected ({self.model}), coverage {100 * self.coverage:.0f} %", loc="left"
        )


def calibrate_mag(mag: Mag, field_ut: float | None = None) -> MagResult:
    """`field_ut` is the corrected field's length; the raw field's about its centre if left out."""
    raw = mag.field_ut
    if len(raw) < LEAST_SAMPLES:
        raise Incomplete(
            f"{mag.where}: expected at least {LEAST_SAMPLES} samples, found {len(raw)}: turn the "
            "aircraft slowly every way for a minute"
        )
    centre, _ = fit_sphere(raw, np.ones(len(raw)))
    used = np.ones(len(raw), dtype=bool)
    for _ in range(3):  # outliers spoil the sphere that tells them: each round sees more clearly
        centre, radius = _even_sphere(raw[used], centre)
        arms = raw - centre
        used = _regular(np.linalg.norm(arms, axis=1) - radius, cell_of(arms))
    if radius < LEAST_RADIUS_UT:
        raise Incomplete(
            f"{mag.where}: expected the earth's field from most directions, found readings that "
            f"fill a ball of {radius:.1f} uT: the aircraft was not turned; {advice([])}"
        )
    cells = cell_of(raw - centre)
    covered = coverage(cells[used])
    if covered >= ELLIPSOID_COVERAGE:
        return _ellipsoid(mag.where, raw, centre, radius, field_ut)
    if covered >= SPHERE_COVERAGE:
        return _sphere(mag.where, raw, used, centre, radius, cells, field_ut)
    raise _too_little(mag.where, raw[used], centre, f"{100 * SPHERE_COVERAGE:.0f} % are needed")


def fit_sphere(raw: Array, weight: Array) -> tuple[Array, float]:
    """Centre and radius, linear in [2 c, r^2 - |c|^2]: |m|^2 = 2 c m + (r^2 - |c|^2)."""
    middle = raw.mean(axis=0)  # about which the numbers are small
    m = raw - middle
    scale = max(float(np.abs(m).max()), 1e-9)
    m = m / scale
    w = np.sqrt(weight)[:, None]
    A = np.column_stack([2.0 * m, np.ones(len(m))])
    found, *_ = np.linalg.lstsq(A * w, (m**2).sum(axis=1) * w[:, 0], rcond=None)
    centre = found[:3]
    radius = float(np.sqrt(max(found[3] + centre @ centre, 0.0)))
    return centre * scale + middle, radius * scale


def _even_sphere(raw: Array, centre: Array) -> tuple[Array, float]:
    return fit_sphere(raw, even_weights(cell_of(raw - centre)))


def _left_out(used: NDArray[np.bool_], cells: NDArray[np.int_]) -> float:
    """Part of the directions, not of the samples: a long rest beside iron is one of them."""
    return float(np.average(~used, weights=even_weights(cells)))


def _regular(left: Array, cells: NDArray[np.int_]) -> NDArray[np.bool_]:
    """Residuals within OUTLIER robust sigmas of their median (1.4826 times the median deviation is
    one sigma of a normal one). Medians over directions: a long rest must not set the measure.
    """
    weight = even_weights(cells)
    deviation = np.abs(left - weighted_median(left, weight))
    return np.asarray(deviation < OUTLIER * 1.4826 * max(weighted_median(deviation, weight), 1e-9))


def _ellipsoid(
    where: str, raw: Array, centre: Array, radius: float, field_ut: float | None
) -> MagResult:
    """Nonlinear least squares on |A (m - h)| = 1, in units of the sphere's radius."""
    m = (raw - centre) / radius
    x = np.concatenate([np.ones(3), np.zeros(6)])
    used = np.ones(len(m), dtype=bool)
    for _ in range(3):
        cells = cell_of((m[used] - x[6:9]) @ symmetric(x[:6]).T)
        root = np.sqrt(even_weights(cells))

        def residuals(x: Array, m: Array = m[used], root: Array = root) -> Array:
            return (_lengths(x, m) - 1.0) * root

        def slopes(x: Array, m: Array = m[used], root: Array = root) -> Array:
            return _slopes(x, m) * root[:, None]

        # A residual of 3 % weighs less than a small one would: iron that a turn came near.
        x = least_squares(residuals, x, jac=slopes, loss="soft_l1", f_scale=0.03).x
        used = _regular(_lengths(x, m) - 1.0, cell_of((m - x[6:9]) @ symmetric(x[:6]).T))
    kept = m[used]
    all_cells = cell_of((m - x[6:9]) @ symmetric(x[:6]).T)
    cells = all_cells[used]
    covariance = _clustered(_slopes(x, kept), _lengths(x, kept) - 1.0, cells)
    soft = symmetric(x[:6])
    _refuse_implausible(where, soft, _spread(kept - x[6:9], soft), _left_out(used, all_cells))
    # Of length one now; as long as the raw field about its centre, or as long as asked.
    weight = even_weights(cells)
    mean = float(np.average(np.linalg.norm(kept - x[6:9], axis=1), weights=weight)) * radius
    length_ut = mean if field_ut is None else field_ut
    scale = length_ut / radius
    sigma = np.sqrt(np.diag(covariance))
    return MagResult(
        where=where,
        samples=int(used.sum()),
        outliers=int((~used).sum()),
        model="ellipsoid",
        hard_iron_ut=centre + radius * x[6:9],
        hard_sigma_ut=radius * sigma[6:9],
        soft_iron=soft * scale,
        soft_sigma=symmetric(sigma[:6]) * scale,
        field_ut=length_ut,
        coverage=coverage(cells),
        before=_spread(raw[used]),
        after=_spread(kept - x[6:9], soft),
        holes=unseen(cells),
        raw_ut=raw[used],
    )


def _sphere(
    where: str,
    raw: Array,
    used: NDArray[np.bool_],
    centre: Array,
    radius: float,
    cells: NDArray[np.int_],
    field_ut: float | None,
) -> MagResult:
    kept = raw[used]

    arms = kept - centre
    reach = np.linalg.norm(arms, axis=1)
    J = np.column_stack([-arms / reach[:, None], -np.ones(len(arms))])
    covariance = _clustered(J, reach - radius, cells[used])[:3, :3]
    sigma = np.sqrt(np.diag(covariance))
    if not float(np.linalg.norm(sigma)) < MOST_CENTRE_SIGMA * radius:
        loose = "xyz"[int(np.argmax(sigma))]
        raise Incomplete(
            f"{where}: expected the field from most directions, found a hard iron that is "
            f"known to {sizes(sigma, 1)} uT only, of {radius:.0f} uT: turn the aircraft about "
            f"another axis too, so that the sensor's {loose} axis meets the field with either end"
        )
    after = _spread(kept - centre)
    _refuse_implausible(where, np.eye(3), after, _left_out(used, cells))
    length_ut = radius if field_ut is None else field_ut
    return MagResult(
        where=where,
        samples=len(kept),
        outliers=int((~used).sum()),
        model="sphere",
        hard_iron_ut=centre,
        hard_sigma_ut=sigma,
        soft_iron=np.eye(3) * (length_ut / radius),
        soft_sigma=np.zeros((3, 3)),
        field_ut=length_ut,
        coverage=coverage(cells[used]),
        before=_spread(kept),
        after=after,
        holes=unseen(cells[used]),
        raw_ut=kept,
    )


def _lengths(x: Array, m: Array) -> Array:
    """|A (m - h)|, x = A's six numbers and h."""
    return np.asarray(np.linalg.norm((m - x[6:9]) @ symmetric(x[:6]), axis=1))


def _slopes(x: Array, m: Array) -> Array:
    """Their derivatives: with n = A (m - h) / |A (m - h)|, d = m - h, those by A_ij are n_i d_j
    (and n_j d_i beside it, off the diagonal), those by h are -A n.
    """
    A = symmetric(x[:6])
    d = m - x[6:9]
    n = unit(d @ A)
    off = [n[:, i] * d[:, j] + n[:, j] * d[:, i] for i, j in OFF_DIAGONAL]
    return np.column_stack([n * d, *off, -n @ A])


def _clustered(J: Array, left: Array, cells: NDArray[np.int_]) -> Array:
    """Covariance of a fit with even weights. What is left over in one cell may be one error (iron,
    a shape that is no ellipsoid), not many: residuals are summed by cell before they are squared.
    """
    weight = even_weights(cells)
    sums = np.zeros((CELLS, J.shape[1]))
    np.add.at(sums, cells, J * (weight * left)[:, None])
    bread = np.linalg.pinv((J * weight[:, None]).T @ J)
    seen = len(np.unique(cells))
    correction = seen / max(seen - J.shape[1], 1)
    return np.asarray(correction * bread @ (sums.T @ sums) @ bread)


def _spread(vectors: Array, soft: Array | None = None) -> float:
    """RMS of the length about its mean, as a part of it; each direction counts the same."""
    vectors = vectors if soft is None else vectors @ soft.T
    weight = even_weights(cell_of(vectors))
    sizes = np.linalg.norm(vectors, axis=1)
    mean = float(np.average(sizes, weights=weight))
    return float(np.sqrt(np.average((sizes - mean) ** 2, weights=weight))) / mean


def _refuse_implausible(where: str, soft: Array, residual: float, outliers: float) -> None:
    if residual > MOST_RESIDUAL or outliers > MOST_OUTLIERS:
        raise Incomplete(
            f"{where}: expected |field| constant within {100 * MOST_RESIDUAL:.0f} % after the fit "
            f"and at most {100 * MOST_OUTLIERS:.0f} % outliers, found {100 * residual:.1f} % RMS "
            f"and {100 * outliers:.1f} %: the field was not the same everywhere; go outside, away "
            "from iron, motors off"
        )
    stretch = np.asarray(np.linalg.eigvalsh(soft), dtype=np.float64)
    if stretch.min() > 0.0:
        stretch = stretch / float(np.cbrt(np.prod(stretch)))
    if stretch.min() < 1.0 / MOST_STRETCH or stretch.max() > MOST_STRETCH:
        raise Incomplete(
            f"{where}: expected a soft iron that stretches by less than {MOST_STRETCH}, found "
            f"{sizes(stretch, 2)}: the readings are not those of one field"
        )


def _too_little(where: str, raw: Array, centre: Array, why: str) -> Incomplete:
    cells = cell_of(raw - centre)
    return Incomplete(
        f"{where}: expected the field from most directions, found {100 * coverage(cells):.0f} % "
        f"of them ({why}); {advice(unseen(cells))}"
    )
