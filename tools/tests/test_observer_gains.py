"""Ugglan's gains: placed where they were meant to be, with the margins that are claimed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import place_poles

from strix import _core, observer_gains, observer_loop
from strix.errors import BadInput
from strix.observer_loop import Axis

ALL_POLES = observer_gains.POLES["UgglanQ450"]


@pytest.fixture(scope="module", params=ALL_POLES, ids=lambda chosen: chosen.name)
def design(request: pytest.FixtureRequest) -> observer_gains.Design:
    return observer_gains.design_observer(_core.vehicle("UgglanQ450"), request.param)


@pytest.fixture(scope="module")
def reports(design: observer_gains.Design) -> list[observer_loop.LoopReport]:
    return observer_gains.analyse_all(design)


def integrated_model(axis: Axis) -> tuple[np.ndarray, np.ndarray]:
    """[x0, x1, x_v, x_a], or without x1; written out, not taken from the module."""
    n = 4 if axis.has_angle else 3
    A, b = np.zeros((n, n)), np.zeros((n, 1))
    for i in range(n - 2):
        A[i, i + 1] = 1.0
    A[n - 2, n - 1] = 1.0 / axis.inertia_kg_m2
    A[n - 1, n - 1] = -1.0 / axis.motor_time_constant_s
    b[n - 1, 0] = 1.0 / axis.motor_time_constant_s
    return A, b


def ordered(poles: Iterable[complex]) -> np.ndarray:
    return np.sort_complex(np.array(list(poles), dtype=np.complex128))


def gain_row(axis: Axis) -> np.ndarray:
    row = [axis.l0, axis.l1, axis.l2, axis.l3]
    return np.array([row if axis.has_angle else [row[0], row[2], row[3]]])


def test_the_poles_are_where_they_were_placed_and_scipy_finds_the_same_gain(
    design: observer_gains.Design,
) -> None:
    chosen = design.chosen
    wanted = (chosen.tilt_rad_s, chosen.tilt_rad_s, chosen.yaw_rate_rad_s)
    for axis, poles in zip(design.axes, wanted, strict=True):
        A, b = integrated_model(axis)
        found = np.linalg.eigvals(A - b @ gain_row(axis))
        # Six digits of the gains move a pole by 1e-5 of it, and more where two are near.
        assert np.abs(ordered(found) / ordered(poles) - 1.0).max() < 1e-4
        np.testing.assert_allclose(
            place_poles(A, b, poles).gain_matrix, gain_row(axis), rtol=1e-4, atol=1e-7
        )


def test_sampled_ever_faster_it_has_the_placed_poles_and_the_observers(
    design: observer_gains.Design,
) -> None:
    roll = design.axes[0]
    dt = 2e-5
    T = observer_loop.closed_loop(roll, dt, roll.inertia_kg_m2, roll.motor_time_constant_s)
    z = np.linalg.eigvals(T)
    s = np.log(z[np.abs(z) > 1e-6].astype(complex)) / dt
    observer = -1.0 / roll.motor_time_constant_s - roll.observer / roll.inertia_kg_m2
    wanted = [complex(observer), *design.chosen.tilt_rad_s]
    # Backward differences move a pole p by p^2 dt/2 and more: 0.02 of the observer's 26.8.
    assert np.abs(ordered(s) - ordered(wanted)).max() < 0.05


def test_every_loop_keeps_45_deg_and_6_db(
    design: observer_gains.Design, reports: list[observer_loop.LoopReport]
) -> None:
    assert {r.rate_hz for r in reports} == set(design.chosen.rates_hz)
    for r in reports:
        assert r.phase_margin_deg >= 45.0, (r.name, r.rate_hz)
        assert r.gain_margin_db >= 6.0, (r.name, r.rate_hz)
        assert r.poles_rad_s.real.max() < 0.0, (r.name, r.rate_hz)
    observer_gains.refuse_thin_margins(design, reports)


def radius_with(axis: Axis, gain: float, delay_samples: int) -> float:
    """At 500 Hz with the plant's input multiplied and delayed, as a matrix in the time domain."""
    dt = 1.0 / 500.0
    F, G = observer_loop.plant(axis.inertia_kg_m2, axis.motor_time_constant_s, dt)
    b1, b2, b3 = observer_loop.recursion(axis, dt)
    n = 6 + delay_samples  # angle, rate, torque, x0, x_v before, x_a, u on its way
    e = np.eye(n)
    x0 = e[3] + dt * (e[0] if axis.has_angle else e[1])
    known = b1 * (e[5] - axis.observer * e[4]) + (b2 + axis.observer) * e[1]
    u = -(axis.l0 * x0 + axis.l1 * e[0] + axis.l2 * e[1] + axis.l3 * known) / (1.0 + axis.l3 * b3)
    T = np.zeros((n, n))
    T[:3, :3] = F
    T[:3] += gain * G * e[-1]
    T[3], T[4], T[5], T[6] = x0, e[1], known + b3 * u, u
    for i in range(7, n):
        T[i] = e[i - 1]
    if not axis.has_angle:
        T = T[1:, 1:]
    return float(np.abs(np.linalg.eigvals(T)).max())


def test_the_gain_margin_is_the_gain_at_which_the_loop_turns_unstable(
    design: observer_gains.Design, reports: list[observer_loop.LoopReport]
) -> None:
    for report in (r for r in reports if r.rate_hz == 500):
        axis = {a.name: a for a in design.axes}.get(report.name)
        if axis is None:
            axis = observer_gains.heading_axis(design)
        margin = 10.0 ** (report.gain_margin_db / 20.0)
        # 3 ms and half a period of 2 ms are two samples.
        stable = [radius_with(axis, g, 2) < 1.0 for g in (0.97 * margin, 1.03 / margin)]
        upset = [radius_with(axis, g, 2) >= 1.0 for g in (1.03 * margin, 0.97 / margin)]
        assert all(stable), report.name
        assert any(upset), report.name


def test_it_is_stable_with_half_or_half_more_of_the_lag_and_20_percent_of_inertia(
    design: observer_gains.Design,
) -> None:
    for axis in (*design.axes, observer_gains.heading_axis(design)):
        for rate_hz in design.chosen.rates_hz:
            for lag in (0.5, 1.0, 1.5):
                for inertia in (0.8, 1.0, 1.2):
                    T = observer_loop.closed_loop(
                        axis,
                        1.0 / rate_hz,
                        inertia * axis.inertia_kg_m2,
                        lag * axis.motor_time_constant_s,
                    )
                    assert np.abs(np.linalg.eigvals(T)).max() < 1.0


def test_the_sampled_steps_are_those_of_the_continuous_law(design: observer_gains.Design) -> None:
    for axis in (design.axes[0], design.axes[2]):
        t, wanted, _ = observer_loop.continuous_step(axis, 5.0)
        for rate_hz in design.chosen.rates_hz:
            tolerance = float(np.gradient(wanted, t).max()) / rate_hz  # late by a period at most
            ts, y, u = observer_loop.sampled_step(axis, rate_hz, 5.0)
            np.testing.assert_allclose(y, np.interp(ts, t, wanted), atol=tolerance)
            assert abs(y[-1] - 1.0) < 0.05
            assert np.abs(u).max() <= 1.05 * abs(u[0])  # no kick beyond the first


def test_the_committed_header_is_what_the_poles_give() -> None:
    committed = observer_gains.GAINS_FOLDER / "UgglanQ450Observer.h"
    designs = observer_gains.design_all(_core.vehicle("UgglanQ450"))
    assert committed.read_text(encoding="utf-8") == observer_gains.render_header(designs)


def test_it_writes_header_and_figure_and_check_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = observer_gains.run_observer_gains
    assert not run("ugglanq450", True, tmp_path, tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert run("ugglanq450", False, tmp_path, tmp_path)
    assert (tmp_path / "ugglan_step.png").read_bytes()[:4] == b"\x89PNG"
    assert run(None, True, tmp_path, tmp_path)
    header = tmp_path / "UgglanQ450Observer.h"
    header.write_text(header.read_text().replace("0.84F", "0.85F"))
    assert not run(None, True, tmp_path, tmp_path)
    assert "not what the poles give" in capsys.readouterr().out


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(BadInput, match="Quad5in"):
        observer_gains.design_all(_core.vehicle("Quad5in"))
    with pytest.raises(BadInput, match="conjugate"):
        observer_gains.place((-1.0, -2.0, -3.0 + 1.0j), 0.014, 0.08)
    with pytest.raises(BadInput, match="left"):
        observer_gains.place((-1.0, -2.0, 3.0), 0.014, 0.08)
    greedy = replace(ALL_POLES[0], tilt_rad_s=ALL_POLES[1].tilt_rad_s)
    fast = observer_gains.design_observer(_core.vehicle("UgglanQ450"), greedy)
    with pytest.raises(BadInput, match="'roll' at 50 Hz"):
        observer_gains.refuse_thin_margins(fast, observer_gains.analyse_all(fast))
