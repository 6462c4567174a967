"""The figures of `strix identify`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from strix.identify.inertia import InertiaResult
    from strix.identify.motor import MotorResult
    from strix.identify.thrust import ThrustResult


def draw_motors(figure: Figure, found: MotorResult) -> None:
    """Readings of all steps as shares of their steps, and the fitted answer."""
    from strix.identify.lag import HIGH, LOW, share_done

    axes = figure.subplots(1, len(found.motors), squeeze=False, sharey=True)[0]
    for ax, lag in zip(axes, found.motors, strict=True):
        end_s = 8.0 * lag.tau_s + 1.5 * found.window_s
        near = np.abs(lag.points[:, 0]) < end_s
        ax.plot(*lag.points[near].T, ".", markersize=6, alpha=0.6, label="readings")
        time_s = np.linspace(-0.3 * end_s, end_s, 400)
        share = share_done(time_s - (lag.dead_time_s or 0.0), lag.tau_s, found.window_s)
        ax.plot(time_s, share, label=f"{1e3 * lag.tau_s:.1f} ms")
        ax.axhspan(LOW, HIGH, color="0.92", zorder=0)
        ax.set(title=f"M{lag.motor}", xlabel="time behind the step, s", xlim=(-0.3 * end_s, end_s))
        ax.legend(loc="lower right")
    axes[0].set(ylabel="share of the step", ylim=(-0.2, 1.2))


def draw_thrust(figure: Figure, found: ThrustResult) -> None:
    """Thrust (and torque) against rate squared, command against rate, and what is left over."""
    count = 2 if found.torque is None else 3
    top, bottom = figure.subplots(2, count, sharex="col", height_ratios=(2, 1))
    square = found.rate**2
    lines = [("thrust, N", found.thrust, found.thrust_measured)]
    if found.torque is not None and found.torque_measured is not None:
        lines.append(("torque, N m", found.torque, found.torque_measured))
    for i, (label, fit, measured) in enumerate(lines):
        x = np.linspace(0.0, float(square.max()), 100)
        top[i].plot(square, measured, "o", label="measured")
        top[i].plot(x, fit.constant * x + fit.offset, label=f"{fit.constant:.4g} n^2")
        top[i].set(ylabel=label)
        top[i].legend()
        bottom[i].plot(square, measured - fit.constant * square - fit.offset, "o")
        bottom[i].axhline(0.0, color="0.5")
        bottom[i].set(xlabel=f"n^2, ({found.unit})^2", ylabel="left over")
    curve = found.curve
    x = np.linspace(0.0, float(found.rate.max()), 100)
    top[-1].plot(found.rate, found.command, "o", label="measured")
    top[-1].plot(x, curve.at(x), label=curve.name)
    top[-1].set(ylabel="command")
    top[-1].legend()
    bottom[-1].plot(found.rate, found.command - curve.at(found.rate), "o")
    bottom[-1].axhline(0.0, color="0.5")
    bottom[-1].set(xlabel=f"n, {found.unit}", ylabel="left over")


def draw_inertia(figure: Figure, found: InertiaResult) -> None:
    """Where the parts are, from above and from the right, and what the inertia is made of."""
    above, side, bars = figure.subplots(1, 3)
    body = found.body
    if body is not None:
        heaviest = max(part.mass_kg for part in body.parts)
        for ax, (i, j), names in (
            (above, (1, 0), ("right, m", "forward, m")),
            (side, (0, 2), ("forward, m", "down, m")),
        ):
            for part in body.parts:
                size = 20.0 + 400.0 * part.mass_kg / heaviest
                ax.scatter(part.position_m[i], part.position_m[j], s=size, alpha=0.5)
            ax.plot(body.centre_m[i], body.centre_m[j], "k+", markersize=14, label="centre of mass")
            ax.set(xlabel=names[0], ylabel=names[1])
            ax.set_aspect("equal", adjustable="datalim")
            ax.legend()
        side.invert_yaxis()
    places = np.arange(3)
    if body is not None:
        bars.bar(places - 0.2, np.diag(body.inertia_kg_m2), 0.4, label="parts list")
    for swing in found.swings:
        bars.errorbar(swing.axis + 0.2, swing.inertia_kg_m2, swing.sigma_kg_m2, fmt="o", color="C1")
    bars.set(xticks=places, xticklabels=["Jxx", "Jyy", "Jzz"], ylabel="kg m^2", ylim=(0.0, None))
    bars.set_title("bars: parts; dots: pendulum" if found.swings else "parts")
