"""The regulator: weights by Bryson's rule, one discrete Riccati equation a channel, four designs.

The model of a channel is [integral of the output, chain, wrench of the lagging motors]. A design
without integral action or without the motors' lag leaves that state out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_are

from strix.gains.model import (
    CHANNELS,
    CONTROL_COUNT,
    ERROR_COUNT,
    RATE_HZ,
    Channel,
    Matrix,
    Numbers,
    chain_model,
    discretise,
    hover_model,
)


@dataclass(frozen=True)
class Kind:
    """What a design knows."""

    suffix: str  # of its name in the header
    integral: bool
    lag: bool

    @property
    def title(self) -> str:
        """For people."""
        if self.lag and self.integral:
            return "lag and integral"
        return "lag only" if self.lag else "integral only" if self.integral else "plain"

    @property
    def weights(self) -> str:
        """Its member of Vehicle."""
        return "bryson" if self.lag else "brysonNoLag"


KINDS = (
    Kind("", integral=True, lag=True),  # flown
    Kind("NoIntegral", integral=False, lag=True),
    Kind("NoLag", integral=True, lag=False),
    Kind("Plain", integral=False, lag=False),  # as published
)


@dataclass(frozen=True)
class Design:
    """u = u_nom - k e - lag (w_hat - u_nom) - integral (time integral of e), rounded as it stands
    in the header. Rows thrust, tau_x, tau_y, tau_z.
    """

    numbers: Numbers
    kind: Kind
    k: Matrix
    lag: Matrix
    integral: Matrix

    @property
    def vehicle(self) -> str:
        """Its name."""
        return str(self.numbers["name"])

    @property
    def title(self) -> str:
        """For the log."""
        return f"{self.vehicle} LQR {RATE_HZ} Hz, {self.kind.title}"


def weights_of(numbers: Numbers, kind: Kind) -> Numbers:
    """Largest acceptable values for this design."""
    weights: Numbers = numbers["bryson" if kind.lag else "bryson_no_lag"]
    return weights


def design_model(numbers: Numbers, channel: Channel, kind: Kind) -> tuple[Matrix, Matrix]:
    """The sampled model the design is made for: [integral, chain, wrench] as far as it has them."""
    if kind.lag:
        A, B = chain_model(numbers, channel)
    else:
        A12, B12 = hover_model(numbers)
        A = A12[np.ix_(channel.states, channel.states)]
        B = B12[np.ix_(channel.states, [channel.control])]
    if kind.integral and channel.integral:
        n = len(A)
        A = np.block([[np.zeros((1, 1)), np.eye(1, n)], [np.zeros((n, 1)), A]])
        B = np.vstack([np.zeros((1, 1)), B])
    return discretise(A, B)


def bryson_weights(numbers: Numbers, channel: Channel, kind: Kind) -> tuple[Matrix, Matrix]:
    """Q and R: one over the square of the largest acceptable value (Bryson's rule). The wrench that
    the motors give costs nothing by itself: the one that is asked for does.
    """
    w = weights_of(numbers, kind)
    horizontal = [w["position_horizontal"], w["velocity_horizontal"], w["tilt"], w["rate"]]
    integral, chain, control = {
        "forward": (w["integral_horizontal"], horizontal, w["torque"]),
        "right": (w["integral_horizontal"], horizontal, w["torque"]),
        "down": (
            w["integral_vertical"],
            [w["position_vertical"], w["velocity_vertical"]],
            w["thrust"],
        ),
        "yaw": (w["integral_yaw"], [w["yaw"], w["yaw_rate"]], w["yaw_torque"]),
    }[channel.name]
    errors = [integral, *chain] if kind.integral else chain
    q = [1.0 / e**2 for e in errors] + ([0.0] if kind.lag else [])
    return np.diag(q), np.array([[1.0 / control**2]])


def regulator(Ad: Matrix, Bd: Matrix, Q: Matrix, R: Matrix) -> Matrix:
    """The gain of u = -K x that makes the sum of x'Qx + u'Ru least."""
    P = solve_discrete_are(Ad, Bd, Q, R)
    gain: Matrix = np.linalg.solve(R + Bd.T @ P @ Bd, Bd.T @ P @ Ad)
    return gain


def design_gains(numbers: Numbers, kind: Kind) -> Design:
    """One design of one vehicle."""
    k = np.zeros((CONTROL_COUNT, ERROR_COUNT))
    lag, integral = np.zeros(CONTROL_COUNT), np.zeros(CONTROL_COUNT)
    for channel in CHANNELS:
        Ad, Bd = design_model(numbers, channel, kind)
        Q, R = bryson_weights(numbers, channel, kind)
        row = [rounded(gain) for gain in regulator(Ad, Bd, Q, R)[0]]
        if kind.integral:
            integral[channel.control] = row.pop(0)
        if kind.lag:
            lag[channel.control] = row.pop()
        k[channel.control, list(channel.states)] = row
    return Design(numbers, kind, k, lag, integral)


def rounded(gain: float) -> float:
    """Six digits: plenty for a gain, and the same with every BLAS, which differ in the eleventh."""
    return float(f"{gain:.6g}")
