"""The allocation of the flight code beside a quadratic program, and on layouts that cannot fly."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import daqp
import numpy as np
import pytest
from numpy.typing import NDArray

from strix import _core

Array = NDArray[np.float64]
Place = tuple[float, float, int]  # x forward m, y right m, +1 clockwise seen from above

# Parts of what each axis has at most about the middle of the rotors' range, from far too little to
# far too much: 14 x 14 x 14 x 14 wrenches a vehicle. Roll, pitch and yaw have steps of their own.
THRUST = (-0.3, 0.0, 0.08, 0.31, 0.52, 0.83, 0.97, 1.1, 1.28, 1.52, 1.71, 1.93, 2.5, 4.0)
ROLL = (-1.53, -0.62, -0.26, -0.11, -0.04, -0.003, 0.0, 0.047, 0.15, 0.24, 0.41, 0.57, 0.83, 2.1)
PITCH = (-1.91, -0.71, -0.33, -0.13, -0.021, 0.0, 0.002, 0.07, 0.1, 0.19, 0.36, 0.47, 0.61, 1.3)
YAW = (-2.3, -0.87, -0.37, -0.14, -0.05, -0.017, 0.0, 0.004, 0.06, 0.11, 0.23, 0.35, 0.53, 1.7)

X_LAYOUT: list[Place] = [(0.1, -0.1, 1), (0.1, 0.1, -1), (-0.1, 0.1, 1), (-0.1, -0.1, -1)]


@dataclass(frozen=True)
class Craft:
    """Four rotors and the limits of their squared speeds."""

    rotors: list[Place]
    thrust_constant: float
    torque_constant: float
    low: float
    high: float
    tolerance: float  # of the range: what float32 makes of squared speeds

    @property
    def effect(self) -> Array:
        """Wrench per squared speed, from r x F: its force is -z, and drag turns the other way."""
        columns = []
        for x, y, spin in self.rotors:
            moment = np.cross([x, y, 0.0], [0.0, 0.0, -self.thrust_constant])
            columns.append([self.thrust_constant, *moment[:2], -spin * self.torque_constant])
        return np.array(columns).T

    def allocate(self, wrenches: Array) -> Array:
        numbers = (self.thrust_constant, self.torque_constant, self.low, self.high)
        squares = _core.allocate(self.rotors, *numbers, wrenches.astype(np.float32))
        return np.asarray(squares, dtype=np.float64)


def flown(name: str) -> Craft:
    v = _core.vehicle(name)
    curve = v["command"]
    rise = v["command_flight_max"] - curve["offset"]
    top = rise / curve["linear"] if curve["linear"] else np.sqrt(rise / curve["quadratic"])
    rotors = [(r["x"], r["y"], r["spin"]) for r in v["rotors"]]
    # One float32 rounding is 6e-8 of a squared speed; shares, window and sum are ten of them.
    low, high = v["speed_flight_min"] ** 2, top**2
    return Craft(rotors, v["thrust_constant"], v["torque_constant"], low, high, 1e-6)


def lopsided() -> Craft:
    """No two arms alike, a load off the centre. Thrust and yaw ask for nearly the same of some
    rotors, so that rounding weighs a hundred times as much.
    """
    rotors: list[Place] = [(0.1, -0.12, 1), (0.14, 0.09, -1), (-0.11, 0.13, 1), (-0.07, -0.08, -1)]
    return Craft(rotors, 6.583e-5, 7.51e-7, 3600.0, 107000.0, 5e-5)


CRAFTS = {"Quad5in": flown("Quad5in"), "UgglanQ450": flown("UgglanQ450"), "lopsided": lopsided()}


@dataclass(frozen=True)
class Solved:
    """What the program found: squared speeds in parts of the highest, and the parts given."""

    squares: Array
    tilting: Array  # of the roll and pitch torque
    turning: Array  # of the yaw torque


def programs(effect: Array, low: float, wrenches: Array) -> Solved:
    """Solve the lexicographic program: roll and pitch, then thrust, then yaw.

    The unknowns are four squared speeds, the part of the roll and pitch torque and that of the yaw
    torque. First come limits and equations, which hold; then one goal at a time, each a least
    square that the later ones may not worsen (daqp: prioritised constraints).
    """
    sense = np.array([0] * 6 + [5] * 3 + [0] * 3, dtype=np.int32)  # 5: an equation
    priorities = np.array([9, 10, 11, 12], dtype=np.int32)
    lower = np.array([low] * 4 + [0.0, 0.0] + [0.0] * 3 + [1.0, 0.0, 1.0])
    upper = np.array([1.0] * 4 + [1.0, 1.0] + [0.0] * 3 + [1.0, 0.0, 1.0])
    rows = np.zeros((6, 6))
    rows[0, :4], rows[1, :4], rows[2, :4] = effect[1], effect[2], effect[3]
    rows[3, 4] = 1.0  # goals: all of roll and pitch
    rows[4, :4] = effect[0]  # the thrust
    rows[5, 5] = 1.0  # all of yaw
    found = np.empty((len(wrenches), 6))
    for i, (thrust, roll, pitch, yaw) in enumerate(wrenches):
        rows[0, 4], rows[1, 4], rows[2, 5] = -roll, -pitch, -yaw
        lower[10] = upper[10] = thrust
        # Many of these programs are degenerate, several limits at one corner: with one tolerance
        # and its usual patience daqp gives up on one in ten thousand, with two on none.
        flag = 0
        for within in (1e-9, 1e-7):
            found[i], _, flag, _ = daqp.solve(
                np.eye(6),
                np.zeros(6),
                rows,
                upper,
                lower,
                sense,
                break_points=priorities,
                primal_tol=within,
                cycle_tol=100,
                progress_tol=1e-16,
            )
            if flag in (1, 2):
                break
        assert flag in (1, 2), (flag, wrenches[i])  # 2: some goal is not met
    return Solved(found[:, :4], found[:, 4], found[:, 5])


@pytest.mark.parametrize("name", CRAFTS)
def test_allocation_is_the_optimum_of_a_quadratic_program(name: str) -> None:
    craft = CRAFTS[name]
    most = 0.5 * craft.high * np.abs(craft.effect).sum(axis=1)
    grid = np.array(list(itertools.product(THRUST, ROLL, PITCH, YAW)))
    wrenches = (grid * most).astype(np.float32).astype(np.float64)
    squares = craft.allocate(wrenches)
    wanted, given = wrenches / most, squares @ craft.effect.T / most
    scaled = craft.effect * craft.high / most[:, None]
    best = programs(scaled, craft.low / craft.high, wanted)
    optimum = best.squares @ scaled.T
    tolerance = craft.tolerance

    # Never a command outside limits; the limits themselves are rounded to float32.
    assert squares.min() >= np.float32(craft.low)
    assert squares.max() <= np.float32(craft.high)
    # Roll and pitch: in their direction, and all of them where any squared speeds give them.
    error = np.abs(given[:, 1:3] - best.tilting[:, None] * wanted[:, 1:3])
    feasible = best.tilting > 1.0 - 1e-9
    assert 0.3 * len(grid) < feasible.sum() < 0.9 * len(grid)
    assert np.abs(given - wanted)[feasible, 1:3].max() < tolerance
    # No torque with the other sign.
    assert np.all((given * np.sign(wanted))[:, 1:] > -tolerance)
    # Thrust and yaw: no worse than the program, and no better, as it is the best.
    thrust = np.abs(given - wanted)[:, 0] - np.abs(optimum - wanted)[:, 0]
    yaw = np.abs(given - wanted)[:, 3] - np.abs(optimum - wanted)[:, 3]
    apart = np.abs(squares / craft.high - best.squares)
    print(
        f"{name}: {len(grid)} wrenches, {(~feasible).sum()} too much for roll and pitch, "
        f"{(best.turning < 1.0 - 1e-9).sum()} for yaw; worst, of what the axis has: "
        f"roll and pitch {error.max():.1e}, thrust {np.abs(thrust).max():.1e}, "
        f"yaw {np.abs(yaw).max():.1e}; squared speeds {apart.max():.1e} of the highest"
    )
    assert error.max() < tolerance
    assert np.abs(thrust).max() < tolerance
    assert np.abs(yaw).max() < tolerance
    assert apart.max() < tolerance


def test_the_grid_has_a_hundred_thousand_wrenches() -> None:
    assert len(CRAFTS) * len(THRUST) * len(ROLL) * len(PITCH) * len(YAW) >= 100_000


@pytest.mark.parametrize(
    "rotors",
    [
        [(x, y, 1) for x, y, _ in X_LAYOUT],
        [(x, 0.0, spin) for x, _, spin in X_LAYOUT],
        [(x + 0.3, y, spin) for x, y, spin in X_LAYOUT],
    ],
    ids=["all spin alike", "in a row", "centre of mass outside"],
)
def test_a_layout_that_cannot_fly_is_refused(rotors: list[Place]) -> None:
    with pytest.raises(ValueError, match="cannot fly"):
        _core.allocate(rotors, 1e-5, 1e-7, 1.0, 100.0, np.zeros((1, 4), dtype=np.float32))


def test_another_number_of_rotors_or_of_columns_is_refused() -> None:
    wrenches = np.zeros((1, 4), dtype=np.float32)
    with pytest.raises(ValueError, match="4, 6 or 8 rotors"):
        _core.allocate(X_LAYOUT[:3], 1e-5, 1e-7, 1.0, 100.0, wrenches)
    with pytest.raises(ValueError, match="4 numbers"):
        _core.allocate(X_LAYOUT, 1e-5, 1e-7, 1.0, 100.0, wrenches[:, :3])
