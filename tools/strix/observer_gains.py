"""The gains of Ugglan's attitude controller, by pole placement (lib/Control/ReducedObserver.h).

Per axis, with c = 1/J and the motors' time constant tau: angle' = x_v, x_v' = c x_a,
x_a' = (u - x_a)/tau, u = -(l0 x0 + l1 x1 + l2 x_v + l3 x_a). Roll and pitch: x1 the angle's error,
x0 its integral. Yaw: no x1, x_v the rate's error, x0 its integral. The characteristic polynomials

    roll, pitch  s^4 + (1 + l3)/tau s^3 + c l2/tau s^2 + c l1/tau s + c l0/tau
    yaw          s^3 + (1 + l3)/tau s^2 + c l2/tau s   + c l0/tau

are those of controllable canonical form, where Ackermann's formula is a comparison of
coefficients. The observer's pole, -(1/tau + a c), is placed by a. The design knows no sampling:
margins and stability are computed for the law as it is sampled, at Ugglan's own 50 Hz and at the
500 Hz of the flight software.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from strix.errors import BadInput
from strix.observer_loop import (
    FIXED_DELAY_S,
    Axis,
    LoopReport,
    analyse,
    continuous_step,
    sampled_step,
)

LEAST_PHASE_MARGIN_DEG = 45.0
LEAST_GAIN_MARGIN_DB = 6.0
REPOSITORY = Path(__file__).resolve().parents[2]
GAINS_FOLDER = REPOSITORY / "include" / "gains"
FIGURES_FOLDER = REPOSITORY / "docs" / "figures"

Numbers = Mapping[str, Any]  # of one vehicle, as _core.vehicle() gives them


@dataclass(frozen=True)
class Poles:
    """What is chosen for a vehicle and a use."""

    name: str  # of the constant in the header, after the vehicle's
    rates_hz: tuple[int, ...]  # at which it may fly
    tilt_rad_s: tuple[complex, ...]  # four: roll and pitch
    yaw_rate_rad_s: tuple[complex, ...]  # three
    observer: float  # a, N m/(rad/s)
    heading_per_s: float  # yaw rate asked for by a heading error
    # Limits of x0: roll and pitch in rad s, yaw in rad.
    anti_windup: tuple[float, float, float]


# ours, but a, which is the published recursion's test case, and the anti-windup, which is Ugglan's
# (pilot_control.h of 12 January 2021). At 50 Hz: one pole near the motors' own, 12.5 rad/s, which
# is expensive to move; the next as fast as leaves 45 deg with half a period of delay; the slowest
# is the integral's, it removes a torque offset in 2 s. At 500 Hz, under the position controller:
# twice as fast, so that a position loop that crosses at 1 to 2 rad/s keeps its margin around it.
POLES: dict[str, tuple[Poles, ...]] = {
    "UgglanQ450": (
        Poles(
            name="ObserverGains",
            rates_hz=(50, 500),
            tilt_rad_s=(-0.5, -4.5, -6.0, -12.0),
            yaw_rate_rad_s=(-0.8, -2.5, -12.0),
            observer=0.2,
            heading_per_s=0.8,
            anti_windup=(0.2, 0.2, 1.0),
        ),
        Poles(
            name="ObserverGains500Hz",
            rates_hz=(500,),
            tilt_rad_s=(-0.5, -8.0, -10.0 + 6.0j, -10.0 - 6.0j),
            yaw_rate_rad_s=(-0.8, -2.5, -12.0),
            observer=0.2,
            heading_per_s=0.8,
            anti_windup=(0.2, 0.2, 1.0),
        ),
    ),
}


@dataclass(frozen=True)
class Design:
    vehicle: str
    chosen: Poles
    axes: tuple[Axis, Axis, Axis]


def place(axis_poles: Sequence[complex], inertia: float, tau: float) -> list[float]:
    """[l0, l1, l2, l3] for four poles, [l0, 0, l2, l3] for three."""
    if len(axis_poles) not in (3, 4) or any(np.real(p) >= 0.0 for p in axis_poles):
        raise BadInput(f"poles: expected 3 or 4 left of the axis, found {list(axis_poles)}")
    poly = np.poly(np.asarray(axis_poles, dtype=complex))
    if np.abs(np.imag(poly)).max() > 1e-9 * np.abs(poly).max():
        raise BadInput(f"poles: expected conjugate pairs, found {list(axis_poles)}")
    p = np.real(poly)
    l3, l2 = float(p[1] * tau - 1.0), float(p[2] * tau * inertia)
    if len(axis_poles) == 3:
        return [float(p[3] * tau * inertia), 0.0, l2, l3]
    return [float(p[4] * tau * inertia), float(p[3] * tau * inertia), l2, l3]


def design_all(numbers: Numbers) -> list[Design]:
    """All that the vehicle's header has."""
    name = str(numbers["name"])
    if name not in POLES:
        raise BadInput(
            f"--vehicle: expected one that observer_gains.POLES has poles for "
            f"({', '.join(POLES)}), found '{name}'"
        )
    return [design_observer(numbers, chosen) for chosen in POLES[name]]


def design_observer(numbers: Numbers, chosen: Poles) -> Design:
    tau = float(numbers["motor_time_constant"])
    per_axis = (chosen.tilt_rad_s, chosen.tilt_rad_s, chosen.yaw_rate_rad_s)

    def axis(i: int) -> Axis:
        inertia = float(numbers["inertia"][i])
        l0, l1, l2, l3 = (float(f"{gain:.6g}") for gain in place(per_axis[i], inertia, tau))
        label = ("roll", "pitch", "yaw")[i]
        return Axis(label, inertia, tau, l0, l1, l2, l3, chosen.observer, chosen.anti_windup[i])

    return Design(str(numbers["name"]), chosen, (axis(0), axis(1), axis(2)))


def heading_axis(design: Design) -> Axis:
    """Yaw with a heading kept: a rate reference -k alpha makes u = -(l0 k int(alpha) + (l0 + l2 k)
    alpha + l2 x_v + l3 x_a), which has roll's form.
    """
    y, k = design.axes[2], design.chosen.heading_per_s
    return Axis(
        "heading",
        y.inertia_kg_m2,
        y.motor_time_constant_s,
        y.l0 * k,
        y.l0 + y.l2 * k,
        y.l2,
        y.l3,
        y.observer,
        y.limit,
    )


def analyse_all(design: Design) -> list[LoopReport]:
    loops = (design.axes[0], design.axes[1], design.axes[2], heading_axis(design))
    return [analyse(axis, rate) for rate in design.chosen.rates_hz for axis in loops]


def refuse_thin_margins(design: Design, reports: Sequence[LoopReport]) -> None:
    for r in reports:
        if r.phase_margin_deg < LEAST_PHASE_MARGIN_DEG or r.gain_margin_db < LEAST_GAIN_MARGIN_DB:
            raise BadInput(
                f"observer_gains.POLES, {design.vehicle}{design.chosen.name}: expected poles that "
                f"leave {LEAST_PHASE_MARGIN_DEG:.0f} deg and {LEAST_GAIN_MARGIN_DB:.0f} dB, found "
                f"{r.phase_margin_deg:.1f} deg and {r.gain_margin_db:.1f} dB of '{r.name}' at "
                f"{r.rate_hz} Hz"
            )


def render_header(designs: Sequence[Design]) -> str:
    """Text of include/gains/NAMEObserver.h."""
    name = designs[0].vehicle

    def row(axis: Axis) -> str:
        values = (axis.l0, axis.l1, axis.l2, axis.l3, axis.observer, axis.limit)
        return "    {" + ", ".join(_float(v) for v in values) + f"}},  // {axis.name}"

    lines = [
        f"/// Generated by `strix gains --controller ugglan --vehicle {name}` from",
        f"/// include/vehicles/{name}.h and tools/strix/observer_gains.py's poles: do not edit.",
        "#pragma once",
        "",
        '#include "ReducedObserver.h"',
        "",
        "namespace strix {",
        "",
        "// clang-format off",
        "// Rows: integral, angle, rate, torque, observer, limit of the integral.",
    ]
    for design in designs:
        chosen = design.chosen
        lines += [
            "",
            f"/// For {' and '.join(map(str, chosen.rates_hz))} Hz. Poles, rad/s: roll and pitch "
            f"{_poles(chosen.tilt_rad_s)};",
            f"/// yaw rate {_poles(chosen.yaw_rate_rad_s)}.",
            f"constexpr ObserverGains k{name}{chosen.name}{{",
            f'    "{name} reduced observer, {chosen.rates_hz[0]} Hz",',
            *(row(axis) for axis in design.axes),
            f"    {_float(chosen.heading_per_s)},  // 1/s, heading",
            "};",
        ]
    return "\n".join([*lines, "// clang-format on", "", "}  // namespace strix", ""])


def render_report(design: Design, reports: Sequence[LoopReport]) -> str:
    """The table a person reads before believing a gain."""
    name = design.vehicle + design.chosen.name
    lines = [f"{name}: state feedback with a reduced observer, by pole placement"]
    lines.append("axis     l0        l1        l2        l3       observer rad/s")
    for axis in design.axes:
        pole = -1.0 / axis.motor_time_constant_s - axis.observer / axis.inertia_kg_m2
        lines.append(
            f"{axis.name:<9}{axis.l0:<10.5f}{axis.l1:<10.5f}{axis.l2:<10.5f}{axis.l3:<9.4f}"
            f"{pole:.1f}"
        )
    lines.append("loop     rate Hz  phase deg  gain dB  crossover rad/s  poles as sampled, rad/s")
    for r in reports:
        poles = _poles(r.poles_rad_s)
        lines += [
            f"{r.name:<9}{r.rate_hz:<9d}{r.phase_margin_deg:<11.1f}{r.gain_margin_db:<9.1f}"
            f"{r.crossover_rad_s:<17.2f}{poles}"
        ]
    lines.append(
        "Margins at the plant input, with the hold, half a period for the mean rate and "
        f"{1e3 * FIXED_DELAY_S:.0f} ms of delay."
    )
    return "\n".join(lines)


def plot_steps(design: Design, file: Path) -> None:
    """Step responses of the continuous law and of the law as it is sampled."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2, sharex=True)
    steps = (
        (design.axes[0], np.pi / 8.0, "roll and pitch: full stick", "angle, deg", 180.0 / np.pi),
        (design.axes[2], 1.0, "yaw rate: 1 rad/s", "rate, rad/s", 1.0),
    )
    for column, (axis, size, title, label, unit) in enumerate(steps):
        above, below = axes[0][column], axes[1][column]
        above.axhline(size * unit, color="0.7", linewidth=0.8)
        t, y, u = continuous_step(axis, 5.0)
        thick = {"color": "0.6", "linewidth": 4.0}
        above.plot(t, size * unit * y, **thick, label="continuous, torque known")
        below.plot(t, size * u, **thick)
        for rate_hz, colour in zip(design.chosen.rates_hz, ("C3", "C0"), strict=False):
            t, y, u = sampled_step(axis, rate_hz, 5.0)
            above.step(t, size * unit * y, colour, where="post", label=f"sampled at {rate_hz} Hz")
            below.step(t, size * u, colour, where="post")
        below.set_xlim(0.0, 3.0)
        above.set(title=title, ylabel=label)
        below.set(xlabel="time, s", ylabel="u, N m")
        for each in (above, below):
            each.grid(alpha=0.3)
    axes[0][0].legend()
    figure.suptitle(f"{design.vehicle}{design.chosen.name}: reduced observer, pole placement")
    figure.savefig(file, dpi=110, metadata={"Software": None})


def run_observer_gains(
    vehicle: str | None,
    check: bool,
    figures: Path | None = FIGURES_FOLDER,
    folder: Path = GAINS_FOLDER,
) -> bool:
    """Place the poles of one vehicle, or of all that have some; print; write header and figure.

    With check nothing is written. Returns whether every header was as it must be.
    """
    from strix import _core
    from strix.vehicles import vehicle_name

    current = True
    for name in POLES if vehicle is None else [vehicle_name(vehicle)]:
        designs = design_all(_core.vehicle(name))
        for design in designs:
            reports = analyse_all(design)
            print(render_report(design, reports), end="\n\n")
            refuse_thin_margins(design, reports)
        file, text = folder / f"{name}Observer.h", render_header(designs)
        try:
            same = file.exists() and file.read_bytes() == text.encode()
            if check:
                print(f"{file}: {'as designed' if same else 'not what the poles give'}")
                current = current and same
                continue
            if not same:
                file.write_text(text, encoding="utf-8")
            print(f"{file}: {'unchanged' if same else 'written; build again (make setup)'}")
            if figures is not None:
                plot_steps(designs[0], figures / "ugglan_step.png")
        except OSError as error:
            raise BadInput(f"{file}: expected a file to write, found: {error.strerror}") from None
    return current


def _float(value: float) -> str:
    text = f"{value + 0.0:.6g}"
    return (text if "." in text or "e" in text else text + ".0") + "F"


def _poles(poles: Iterable[complex]) -> str:
    """One of each pair."""
    return "  ".join(
        f"{p.real:.2f}" + (f"+-{p.imag:.2f}i" if p.imag > 1e-6 else "")
        for p in (complex(p) for p in poles)
        if p.imag > -1e-6
    )
