"""The aircraft at hover and yaw 0, as the controller's gains are designed for it.

x = [position, velocity, alpha, body rate] in the heading frame (forward, right, down) and body
axes, u = [thrust, tau_x, tau_y, tau_z]. There the four inputs do not touch: each drives its own
chain of integrators, and each chain is designed and checked by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete

GRAVITY_M_S2 = 9.80665
RATE_HZ = 500
PERIOD_S = 1.0 / RATE_HZ
ERROR_COUNT, CONTROL_COUNT = 12, 4

Numbers = Mapping[str, Any]  # of one vehicle, as _core.vehicle() gives them
Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """One input and the chain of integrators it drives, or the end of one."""

    name: str
    control: int  # row of u
    states: tuple[int, ...]  # of x; the first is the output
    integral: bool  # of the output: only where position and yaw are held

    @property
    def output_unit(self) -> str:
        """Of what is held."""
        return "m" if self.states[0] < 3 else "rad"

    @property
    def control_unit(self) -> str:
        """Of the input."""
        return "N" if self.control == 0 else "N m"


# Position and yaw are held: the whole gain.
CHANNELS = (
    Channel("forward", 2, (0, 3, 7, 10), True),
    Channel("right", 1, (1, 4, 6, 9), True),
    Channel("down", 0, (2, 5), True),
    Channel("yaw", 3, (8, 11), True),
)
# Attitude is held: the same gain without position, velocity and integrals (Reference::mode).
ATTITUDE_CHANNELS = (
    Channel("pitch attitude", 2, (7, 10), False),
    Channel("roll attitude", 1, (6, 9), False),
    Channel("yaw attitude", 3, (8, 11), False),
)


@dataclass(frozen=True)
class Truth:
    """How the aircraft that flies differs from the vehicle file; factors, and the motors' lag."""

    mass: float = 1.0
    inertia: float = 1.0
    thrust: float = 1.0  # and the torques with it: a constant of the rotors that is wrong
    motor_time_constant_s: float | None = None  # None: that of the vehicle file


def hover_model(numbers: Numbers, truth: Truth | None = None) -> tuple[Matrix, Matrix]:
    """A and B. Nose up (alpha_y > 0) drives it backwards, right side down (alpha_x > 0) to the
    right; more thrust lifts it, which is -down.
    """
    truth = truth or Truth()
    A = np.zeros((ERROR_COUNT, ERROR_COUNT))
    A[0:3, 3:6] = np.eye(3)
    A[3, 7] = -GRAVITY_M_S2  # of the thrust that carries it, whatever the rotors' constant
    A[4, 6] = GRAVITY_M_S2
    A[6:9, 9:12] = np.eye(3)
    B = np.zeros((ERROR_COUNT, CONTROL_COUNT))
    B[5, 0] = -truth.thrust / (truth.mass * numbers["mass"])
    for axis, inertia in enumerate(numbers["inertia"]):
        B[9 + axis, 1 + axis] = truth.thrust / (truth.inertia * inertia)
    return A, B


def chain_model(
    numbers: Numbers, channel: Channel, truth: Truth | None = None
) -> tuple[Matrix, Matrix]:
    """A and B of one channel with the motors: x = [chain, wrench], T' = (u - T) / tau."""
    truth = truth or Truth()
    tau = truth.motor_time_constant_s or numbers["motor_time_constant"]
    A12, B12 = hover_model(numbers, truth)
    n = len(channel.states)
    A = np.zeros((n + 1, n + 1))
    A[:n, :n] = A12[np.ix_(channel.states, channel.states)]
    A[:n, n] = B12[list(channel.states), channel.control]
    A[n, n] = -1.0 / tau
    B = np.zeros((n + 1, 1))
    B[n, 0] = 1.0 / tau
    return A, B


def discretise(A: Matrix, B: Matrix) -> tuple[Matrix, Matrix]:
    """Zero-order hold over one control period."""
    n, m = B.shape
    Ad, Bd, *_ = cont2discrete((A, B, np.eye(n), np.zeros((n, m))), PERIOD_S, method="zoh")
    return Ad, Bd
