"""The designed gains: what is committed is what the vehicle files give, and it flies."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov

from strix import _core, gains
from strix.errors import BadInput

VEHICLES: list[str] = _core.vehicle_names()


@pytest.fixture(scope="module", params=VEHICLES)
def design(request: pytest.FixtureRequest) -> gains.Design:
    return gains.design_gains(_core.vehicle(request.param))


@pytest.fixture(scope="module")
def reports(design: gains.Design) -> list[gains.ChannelReport]:
    return gains.analyse(design)


def spectral_radius(design: gains.Design, channel: gains.Channel) -> float:
    F, _ = gains.sampled_loop(design, channel)
    return float(np.abs(np.linalg.eigvals(F)).max())


def test_the_committed_headers_are_what_the_vehicle_files_give(design: gains.Design) -> None:
    committed = (gains.GAINS_FOLDER / f"{design.name}.h").read_text(encoding="utf-8")
    assert gains.render_header(design) == committed, "run `make gains` and commit include/gains/"


def test_the_closed_loop_is_stable_with_and_without_motor_lag(design: gains.Design) -> None:
    Ad, Bd = gains.discretise(design.A, design.B)
    assert np.abs(np.linalg.eigvals(Ad - Bd @ design.K)).max() < 1.0
    for channel in gains.CHANNELS:
        assert spectral_radius(design, channel) < 1.0


def test_every_channel_keeps_45_deg_and_6_db_with_motor_lag_and_delay(
    reports: list[gains.ChannelReport],
) -> None:
    for report in reports:
        assert report.phase_margin_deg >= 45.0, report.name
        assert report.gain_margin_db >= 6.0, report.name


def test_steps_settle_in_10_s_without_overshoot_and_ask_little(
    design: gains.Design, reports: list[gains.ChannelReport]
) -> None:
    numbers = _core.vehicle(design.name)
    for report in reports:
        assert report.settling_s < 10.0, report.name
        assert report.overshoot < 0.02, report.name
    weight_n = numbers["mass"] * gains.GRAVITY_M_S2
    forward, right, down, _ = reports
    assert down.largest_control < 0.3 * weight_n
    arm_m = abs(numbers["rotors"][0]["x"])
    for report in (forward, right):
        assert report.largest_control < 0.03 * weight_n * arm_m


def test_the_margins_are_those_at_which_the_sampled_loop_turns_unstable(
    design: gains.Design, reports: list[gains.ChannelReport]
) -> None:
    """Independent of the frequency response: eigenvalues of the loop with changed gain. 2 %: the
    sampled loop holds its output where the analysis delays it half a sample.
    """
    for report, channel in zip(reports, gains.CHANNELS, strict=True):
        factor = 10.0 ** (report.gain_margin_db / 20.0)
        # The chains of four integrators fail first by too little gain, the short ones by too much.
        less = len(channel.states) == 4
        for change, stable in ((0.98, True), (1.02, False)):
            scale = 1.0 / (factor * change) if less else factor * change
            changed = replace(design, K=scale * design.K)
            assert (spectral_radius(changed, channel) < 1.0) == stable, report.name


def test_the_phase_margin_is_the_delay_at_which_the_sampled_loop_turns_unstable(
    design: gains.Design, reports: list[gains.ChannelReport]
) -> None:
    """A delay of phase margin / crossover eats the margin up. 3 %, and a sample, for the hold."""
    for report, channel in zip(reports, gains.CHANNELS, strict=True):
        F, _ = gains.sampled_loop(design, channel)
        n = len(F)
        limit = np.radians(report.phase_margin_deg) / report.crossover_rad_s * gains.RATE_HZ
        for samples, stable in ((int(0.97 * limit) - 1, True), (int(1.03 * limit) + 2, False)):
            late = np.eye(n + samples, k=1)  # each sample moves one place forward on its way
            late[:n, :n] = F
            late[n - 1, :n] = 0.0
            late[n - 1, n] = 1.0
            late[-1, :n] = F[-1]  # and the controller's newest enters at the end
            assert (np.abs(np.linalg.eigvals(late)).max() < 1.0) == stable, report.name


def test_no_other_gain_costs_less() -> None:
    """The definition of the regulator: sum of x'Qx + u'Ru from every start is least."""
    numbers = _core.vehicle("Quad5in")
    design = gains.design_gains(numbers)
    Q, R = gains.bryson_weights(numbers)
    Ad, Bd = gains.discretise(design.A, design.B)

    def cost(K: gains.Matrix) -> float:
        return float(np.trace(solve_discrete_lyapunov((Ad - Bd @ K).T, Q + K.T @ R @ K)))

    best = cost(design.K)
    random = np.random.default_rng(1)
    for _ in range(50):
        change = 1.0 + 0.05 * random.standard_normal(design.K.shape)
        assert cost(design.K * change) > best


def test_signs_are_those_of_the_aircraft(design: gains.Design) -> None:
    """With u = -K e. Too far forward: nose up. Too far right: roll left. Too low: more thrust."""
    thrust, roll, pitch, yaw = -design.K
    assert pitch[0] > 0.0 and pitch[3] > 0.0
    assert roll[1] < 0.0 and roll[4] < 0.0
    assert thrust[2] > 0.0 and thrust[5] > 0.0
    assert max(roll[6], roll[9], pitch[7], pitch[10], yaw[8], yaw[11]) < 0.0
    assert np.count_nonzero(design.K) == 12


def test_weights_that_are_too_fast_for_the_motors_are_refused() -> None:
    numbers: dict[str, Any] = dict(_core.vehicle("Quad5in"))
    numbers["bryson"] = {**numbers["bryson"], "torque": 0.1}
    with pytest.raises(
        BadInput, match=r"Quad5in\.h, bryson: expected .* 45 deg .* found"
    ) as caught:
        design = gains.design_gains(numbers)
        gains.refuse_thin_margins(design, gains.analyse(design))
    assert "\n" not in str(caught.value)


def test_checking_writes_nothing_and_tells_a_stale_header(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert not gains.run_gains(None, check=True, folder=tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert gains.run_gains(None, check=False, folder=tmp_path)
    assert sorted(file.stem for file in tmp_path.iterdir()) == sorted(VEHICLES)
    assert gains.run_gains(None, check=True, folder=tmp_path)
    stale = tmp_path / "Quad5in.h"
    stale.write_text(stale.read_text().replace("F,", "1F,", 1))
    assert not gains.run_gains("quad5in", check=True, folder=tmp_path)
    printed = capsys.readouterr().out
    assert "Quad5in.h: not what the vehicle file gives" in printed
    assert "forward" in printed


def test_an_unknown_vehicle_or_folder_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"--vehicle: expected one of .*, found 'Quad6in'"):
        gains.run_gains("Quad6in", check=False, folder=tmp_path)
    with pytest.raises(BadInput, match="expected a file to write, found: No such file"):
        gains.run_gains("Quad5in", check=False, folder=tmp_path / "none")
