"""One channel as it runs at 500 Hz: aircraft, lagging motors, a sample of delay, controller.

z = [chain, wrench, control on its way to the ESC, estimated wrench, integral]. The controller's
estimate of the wrench follows what it asks for, through the lag of the vehicle file; the true
wrench comes a sample later, through the true lag.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strix.gains.design import Design
from strix.gains.model import PERIOD_S, Channel, Matrix, Truth, chain_model, discretise


@dataclass(frozen=True)
class Loop:
    """z[k+1] = A z + B_aircraft u + B_controller u + E d - S r,   u = -K z + K_r r + N u_nom.

    u reaches the aircraft and the controller's own estimate by two ways: the loop is opened in the
    first. d is a force or torque on the aircraft, r the reference of the chain.
    """

    A: Matrix
    B_aircraft: Matrix
    B_controller: Matrix
    E: Matrix
    S: Matrix
    K: Matrix
    K_r: Matrix
    N: float

    @property
    def closed(self) -> Matrix:
        """z[k+1] = closed z without reference and disturbance."""
        return self.A - (self.B_aircraft + self.B_controller) @ self.K

    def run(
        self, reference: Matrix, nominal: Matrix | None = None, disturbance: float = 0.0
    ) -> tuple[Matrix, Matrix]:
        """Output and control at every sample, from rest; a row of `reference` a sample."""
        B = self.B_aircraft + self.B_controller
        u_nom = np.zeros(len(reference)) if nominal is None else nominal
        forced = reference @ (B @ self.K_r - self.S).T + np.outer(u_nom * self.N, B[:, 0])
        forced += disturbance * self.E[:, 0]
        z = self._states(forced)
        control = -z @ self.K[0] + reference @ self.K_r[0] + self.N * u_nom
        return z[:, 0], control

    def _states(self, forced: Matrix) -> Matrix:
        """The states at every sample, from rest, with these pushes."""
        closed, n = self.closed, len(self.A)
        if np.all(forced == forced[0]):  # of a step: M holds as many of its steps as there are z
            M = np.block([[closed, forced[:1].T], [np.zeros((1, n)), np.ones((1, 1))]])
            z = np.eye(n + 1)[-1:]
            while len(z) < len(forced):
                z = np.vstack([z, z @ M.T])
                M = M @ M
            return z[: len(forced), :n]
        z = np.zeros((len(forced), n))
        for step in range(len(forced) - 1):
            np.dot(closed, z[step], out=z[step + 1])
            z[step + 1] += forced[step]
        return z

    def opened(self, w: Matrix) -> NDArray[np.complex128]:
        """The loop at the plant input, at these frequencies, rad/s: what comes back of u, as -u."""
        A = self.A - self.B_controller @ self.K
        z = np.exp(1j * w * PERIOD_S)[:, None, None]
        x = np.linalg.solve(z * np.eye(len(A)) - A, self.B_aircraft.astype(complex))
        loop: NDArray[np.complex128] = (x[:, :, 0] @ self.K[0]).astype(np.complex128)
        return loop


def sampled_loop(design: Design, channel: Channel, truth: Truth | None = None) -> Loop:
    """The loop of a design around an aircraft that may differ from what it was designed for."""
    numbers = design.numbers
    n = len(channel.states)
    A_chain, B_chain = chain_model(numbers, channel, truth)
    # What disturbs position is a force, yaw and attitude a torque: at the unit of its derivative.
    pushed = np.zeros((n + 1, 1))
    if channel.states[0] < 3:
        pushed[1] = 1.0 / numbers["mass"]
    else:
        pushed[1] = 1.0 / numbers["inertia"][channel.states[0] - 6]
    Ad, Bd = discretise(A_chain, np.hstack([B_chain, pushed]))
    wrench, on_way, estimate, integral = n, n + 1, n + 2, n + 3
    size = n + 4
    A = np.zeros((size, size))
    A[: wrench + 1, : wrench + 1] = Ad
    A[: wrench + 1, on_way] = Bd[:, 0]
    keeps = np.exp(-PERIOD_S / numbers["motor_time_constant"])
    A[estimate, estimate] = keeps
    A[integral, integral] = 1.0
    A[integral, 0] = PERIOD_S
    B_aircraft, B_controller = np.zeros((size, 1)), np.zeros((size, 1))
    B_aircraft[on_way] = 1.0
    B_controller[estimate] = 1.0 - keeps
    E, S, K = np.zeros((size, 1)), np.zeros((size, n)), np.zeros((1, size))
    E[: wrench + 1, 0] = Bd[:, 1]
    S[integral, 0] = PERIOD_S
    k = design.k[channel.control, list(channel.states)]
    K[0, :n] = k
    K[0, estimate] = design.lag[channel.control]
    K[0, integral] = design.integral[channel.control] if channel.integral else 0.0
    if not K[0, integral]:  # an integral that nobody uses is no part of the loop
        keep = np.arange(size) != integral
        A, B_aircraft, B_controller = A[np.ix_(keep, keep)], B_aircraft[keep], B_controller[keep]
        E, S, K = E[keep], S[keep], K[:, keep]
    return Loop(A, B_aircraft, B_controller, E, S, K, k[None, :], 1.0 + design.lag[channel.control])
