"""The designed gains: what is committed is what the vehicle files give, and it flies."""

from __future__ import annotations

import copy
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov

from strix import _core
from strix.errors import BadInput
from strix.gains.analysis import DesignReport, design_and_analyse, refuse_thin_margins
from strix.gains.command import GAINS_FOLDER, run_gains
from strix.gains.corners import corner_table
from strix.gains.design import KINDS, Design, Kind, bryson_weights, design_gains, design_model
from strix.gains.header import render_header
from strix.gains.model import CHANNELS, GRAVITY_M_S2, Matrix
from strix.replay import read_gains

VEHICLES: list[str] = _core.vehicle_names()
FLOWN, NO_INTEGRAL, NO_LAG, PLAIN = KINDS


@pytest.fixture(scope="module", params=VEHICLES)
def reports(request: pytest.FixtureRequest) -> list[DesignReport]:
    return design_and_analyse(_core.vehicle(request.param))


@pytest.fixture(scope="module")
def designs(reports: list[DesignReport]) -> list[Design]:
    return [report.design for report in reports]


@pytest.fixture(scope="module")
def quad() -> DesignReport:
    """The flown design of Quad5in."""
    return design_and_analyse(_core.vehicle("Quad5in"))[0]


def changed_weights(member: str, **weights: float) -> dict[str, Any]:
    numbers = copy.deepcopy(_core.vehicle("Quad5in"))
    numbers[member].update(weights)
    return numbers


def gain_row(design: Design, row: int, states: Sequence[int]) -> Matrix:
    """The gains of a channel in the order of its design model."""
    middle = design.k[row, list(states)]
    first = [design.integral[row]] if design.kind.integral else []
    last = [design.lag[row]] if design.kind.lag else []
    return np.array([[*first, *middle, *last]])


def test_the_committed_headers_are_what_the_vehicle_files_give(designs: list[Design]) -> None:
    committed = (GAINS_FOLDER / f"{designs[0].vehicle}.h").read_text(encoding="utf-8")
    assert render_header(designs) == committed, "run `make gains` and commit include/gains/"


@pytest.mark.parametrize("kind", [FLOWN, PLAIN], ids=lambda kind: str(kind.title))
def test_the_gain_is_where_the_riccati_recursion_ends(kind: Kind) -> None:
    """Independent of SciPy's solver, which goes through eigenvalues: value iteration from P = Q.
    20 000 steps are 40 s, eight of the slowest pole's time constants (5 s), and P converges twice
    as fast: 5e-8. Six digits are kept.
    """
    design = design_gains(_core.vehicle("Quad5in"), kind)
    for channel in CHANNELS:
        A, B = design_model(design.numbers, channel, kind)
        Q, R = bryson_weights(design.numbers, channel, kind)
        P, K = Q, np.zeros((1, len(Q)))
        for _ in range(20_000):
            K = (B.T @ P @ A) / (R + B.T @ P @ B)
            P = Q + A.T @ P @ (A - B @ K)
        found = gain_row(design, channel.control, channel.states)
        np.testing.assert_allclose(found, K, rtol=1e-5)


def test_no_other_gain_costs_less() -> None:
    """The definition of the regulator: sum of x'Qx + u'Ru from every start is least."""
    design = design_gains(_core.vehicle("Quad5in"), FLOWN)
    random = np.random.default_rng(1)
    for channel in CHANNELS:
        A, B = design_model(design.numbers, channel, FLOWN)
        Q, R = bryson_weights(design.numbers, channel, FLOWN)

        def cost(K: Matrix, A: Matrix = A, B: Matrix = B, Q: Matrix = Q, R: Matrix = R) -> float:
            return float(np.trace(solve_discrete_lyapunov((A - B @ K).T, Q + K.T @ R @ K)))

        K = gain_row(design, channel.control, channel.states)
        for _ in range(20):
            assert cost(K * (1.0 + 0.05 * random.standard_normal(K.shape))) > cost(K)


def test_signs_are_those_of_the_aircraft(designs: list[Design]) -> None:
    """With u = -K e. Too far forward: nose up. Too far right: roll left. Too low: more thrust."""
    for design in designs:
        thrust, roll, pitch, yaw = -design.k
        assert pitch[0] > 0.0 and pitch[3] > 0.0
        assert roll[1] < 0.0 and roll[4] < 0.0
        assert thrust[2] > 0.0 and thrust[5] > 0.0
        assert max(roll[6], roll[9], pitch[7], pitch[10], yaw[8], yaw[11]) < 0.0
        assert np.count_nonzero(design.k) == 12  # and nothing from one channel into another
        if design.kind.integral:  # they push as the positions do
            assert np.array_equal(
                np.sign(design.integral), np.sign([-thrust[2], -roll[1], -pitch[0], -yaw[8]])
            )
        assert bool(np.all(design.lag > 0.0)) == design.kind.lag
        assert bool(np.all(design.integral != 0.0)) == design.kind.integral
        assert bool(np.any(design.integral)) == design.kind.integral


def test_with_quick_motors_and_a_free_integral_the_flown_design_is_the_plain_one() -> None:
    numbers = copy.deepcopy(_core.vehicle("Quad5in"))
    numbers["bryson"] = {
        **numbers["bryson_no_lag"],
        "integral_horizontal": 1e5,
        "integral_vertical": 1e5,
        "integral_yaw": 1e5,
    }
    plain = design_gains(numbers, PLAIN).k
    numbers["motor_time_constant"] = 1e-6
    flown = design_gains(numbers, FLOWN)
    # The lag takes 1e-6 s of the rate loop's 0.1 s, the integral 1e-5 of the position loop's gain.
    np.testing.assert_allclose(flown.k, plain, rtol=2e-4)
    assert np.abs(flown.integral).max() < 1e-4


def test_every_channel_keeps_45_deg_and_6_db_with_motor_lag_and_delay(
    reports: list[DesignReport],
) -> None:
    refuse_thin_margins([report.design for report in reports])
    for report in reports:
        channels = [(r.name, r.margins) for r in report.channels]
        for name, margins in channels + [(r.name, r.margins) for r in report.attitudes]:
            assert margins.phase_deg >= 45.0, (report.design.title, name)
            assert margins.gain_db >= 6.0, (report.design.title, name)
        for channel in report.channels:
            assert channel.poles_rad_s.real.max() < 0.0


def test_quad5in_is_as_quick_as_the_issue_asks(quad: DesignReport) -> None:
    """Issue 7, 7: rise under 0.20 s and overshoot under 10 % for a 30 deg step of roll or pitch,
    yaw within 1 s, with torques that the motors have. The linear model keeps 5 % for the rest.
    """
    pitch, roll, yaw = quad.attitudes
    for axis in (pitch, roll):
        assert axis.rise_s < 0.19
        assert axis.overshoot < 0.05
        assert axis.largest_torque < 0.9 * axis.torque_limit
    assert yaw.reached_s < 0.95
    assert yaw.largest_torque < 0.6 * yaw.torque_limit
    # With its integral, as where a heading is held, the bare yaw step stays within 3 of 30 deg.
    assert quad.channels[3].overshoot < 0.1


def test_position_follows_a_smooth_path_without_overshoot_and_wind_is_forgotten(
    reports: list[DesignReport],
) -> None:
    flown = reports[0]
    quick = flown.design.vehicle == "Quad5in"
    for channel in flown.channels[:3]:
        assert channel.smooth_settling_s < 10.0
        # Of 1 m in 5 s; 0.02 is what settled means. UgglanQ450's motors lag the path twice as long.
        assert channel.smooth_overshoot < (0.01 if quick else 0.03)
        assert channel.offset_gone_s < (5.0 if quick else 6.0)
    # Without integral action it never is, and a bare step does not overshoot.
    for channel in reports[1].channels[:3]:
        assert channel.offset_gone_s == float("inf")
        assert channel.overshoot < 0.01
        assert channel.settling_s < 10.0


def test_the_noise_of_the_gyro_does_not_rattle_the_motors(reports: list[DesignReport]) -> None:
    for axis in reports[0].attitudes:
        assert axis.noise_torque < 0.02 * axis.torque_limit


def test_the_flown_design_survives_every_corner(designs: list[Design]) -> None:
    """Mass, inertia and thrust 20 % off at once, motors twice as slow as Quad5in's. 20 deg: the
    wrench that the controller believes in is then half a time constant ahead of the true one.
    """
    table = corner_table(designs[0])
    assert {c.motor_time_constant_s for c in table} == (
        {0.04, 0.08} if designs[0].vehicle == "Quad5in" else {0.08}
    )
    for corner in table:
        assert corner.stable, corner
        assert corner.margins.gain_db > 6.0, corner
        as_slow_as_said = corner.motor_time_constant_s < 0.05 or designs[0].vehicle != "Quad5in"
        assert corner.margins.phase_deg > (40.0 if as_slow_as_said else 20.0), corner
        assert corner.overshoot is None or corner.overshoot < 0.25, corner


def test_the_designs_that_know_the_lag_are_quicker(reports: list[DesignReport]) -> None:
    flown, no_integral, no_lag, plain = (r.attitudes[1] for r in reports)
    assert max(flown.rise_s, no_integral.rise_s) < 0.6 * min(no_lag.rise_s, plain.rise_s)


@pytest.mark.parametrize(
    ("member", "weights", "said"),
    [
        ("bryson", {"rate": 5.0}, "bryson: .*'forward' of the design 'lag and integral'"),
        ("bryson_no_lag", {"torque": 0.1}, "brysonNoLag: .*of the design 'integral only'"),
        (
            "bryson_no_lag",
            {"yaw_torque": 3.0},
            "brysonNoLag: .*found an unstable loop in channel 'yaw' of the design 'integral only'",
        ),
        ("bryson", {"thrust": 3000.0}, "bryson: .*'down' of the design 'lag and integral'"),
    ],
)
def test_weights_that_are_too_fast_for_the_motors_are_refused(
    member: str, weights: dict[str, float], said: str
) -> None:
    with pytest.raises(BadInput, match=r"Quad5in\.h, " + said) as caught:
        numbers = changed_weights(member, **weights)
        refuse_thin_margins([design_gains(numbers, kind) for kind in KINDS])
    assert "expected weights that leave 45 deg and 6 dB, found" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_unstable_design_has_no_report() -> None:
    with pytest.raises(BadInput, match="found an unstable loop in channel 'yaw'"):
        design_and_analyse(changed_weights("bryson_no_lag", yaw_torque=3.0))


def test_the_flown_design_is_read_back_from_its_header(designs: list[Design]) -> None:
    flown = designs[0]
    rows = np.array(read_gains(GAINS_FOLDER / f"{flown.vehicle}.h"))
    assert np.array_equal(rows, np.column_stack([flown.k, flown.lag, flown.integral]))


def test_checking_writes_nothing_and_tells_a_stale_header(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert not run_gains("quad5in", check=True, folder=tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert run_gains("quad5in", check=False, folder=tmp_path, figures=tmp_path / "figures")
    assert [file.name for file in tmp_path.glob("*.h")] == ["Quad5in.h"]
    assert {file.name for file in (tmp_path / "figures").iterdir()} == {
        "control_steps_Quad5in.png",
        "control_margins_Quad5in.png",
    }
    capsys.readouterr()
    assert run_gains("quad5in", check=True, folder=tmp_path, corners=True, as_json=True)
    (told,) = json.loads(capsys.readouterr().out)
    assert told["header_as_designed"] and told["vehicle"] == "Quad5in"
    assert len(told["designs"]) == 4 and len(told["corners"]) == 7 * 6
    stale = tmp_path / "Quad5in.h"
    stale.write_text(stale.read_text().replace("F,", "1F,", 1))
    assert not run_gains("quad5in", check=True, folder=tmp_path, corners=True)
    printed = capsys.readouterr().out
    assert "Quad5in.h: not what the vehicle file gives" in printed
    assert "design: plain" in printed and "when the aircraft differs" in printed


def test_an_unknown_vehicle_or_folder_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"--vehicle: expected one of .*, found 'Quad6in'"):
        run_gains("Quad6in", check=False, folder=tmp_path)
    with pytest.raises(BadInput, match="expected a file to write, found: No such file"):
        run_gains("Quad5in", check=False, folder=tmp_path / "none")


def test_a_gain_header_without_all_its_numbers_is_refused(tmp_path: Path) -> None:
    short = tmp_path / "Quad5in.h"
    text = (GAINS_FOLDER / "Quad5in.h").read_text(encoding="utf-8")
    short.write_text(text.replace("0.0F, 0.0F, ", "", 1))
    with pytest.raises(BadInput, match=r"expected 4 rows of 12 gains, .* 56 numbers, found 54"):
        read_gains(short)


def test_an_aircraft_hangs_on_its_thrust_constant_not_on_its_weight() -> None:
    """The tilt's pull is g whatever the rotors give: at hover they give the weight."""
    numbers = _core.vehicle("Quad5in")
    lighter = {**numbers, "mass": 0.5 * numbers["mass"]}
    one, other = (design_gains(n, FLOWN) for n in (numbers, lighter))
    assert np.array_equal(one.k[1:], other.k[1:])
    assert not np.array_equal(one.k[0], other.k[0])
    assert pytest.approx(9.80665) == GRAVITY_M_S2
