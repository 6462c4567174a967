"""A motor's lag, fitted to its answers to steps of the command.

A step at t0 lets the speed go from w0 to w1 as a first-order lag behind a dead time d:

    w(t) = w0 + (w1 - w0) y(t - t0 - d),   y(s) = 1 - exp(-s / tau) for s > 0, else 0

An ESC that counts turns tells the mean of that over the time T since its last reading:

    Y(s) = [F(s) - F(s - T)] / T,   F(s) = s - tau (1 - exp(-s / tau)) for s > 0, else 0

tau (and d, where readings are dense enough to tell it) is common to all steps of a motor, w0 and
w1 belong to each: least squares over them all. Used are the readings before the step, those in
which the step is between 15 and 95 % done, and those behind 5 tau. Below 15 % the ESC's own delay
and current limit show, above 95 % what remains is the size of the battery's sag.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from strix.calibrate.outcome import Incomplete
from strix.flightlog import Array

Flags = NDArray[np.bool_]

LOW, HIGH = 0.15, 0.95  # of a step: the range
HOLD_S = 0.5  # command constant before and after; ours: six time constants of the slower airframe
STEADY = 0.01  # of the command's range: what counts as constant (ours)
LEAST_STEP = 0.05  # of the command's range (ours: smaller ones drown in a count of the ESC)
SETTLED = 5.0  # time constants: 0.7 % left
LEAST_RISING = 5  # readings between LOW and HIGH, over all steps; ours
WORST_SIGMA = 0.3  # of the time constant: beyond that it is a guess
TAU_RANGE_S = (0.002, 2.0)


@dataclass(frozen=True)
class Record:
    """One motor's commands and speeds. `window_s`: each speed is the mean of so long before it."""

    where: str
    motor: int
    command_time_s: Array
    command: Array
    speed_time_s: Array
    speed: Array
    window_s: float
    speed_unit: str
    curve_speed: Array | None = None  # of each command by the vehicle's curve, where it is known


@dataclass(frozen=True)
class Step:
    index: int  # of its first command
    time_s: float
    begin_s: float  # the command is constant from here to the step
    end_s: float  # and from the step to here
    change: float  # of the command


@dataclass(frozen=True)
class MotorLag:
    """What one motor's steps tell."""

    motor: int
    tau_s: float
    sigma_s: float
    dead_time_s: float | None  # None where the readings are too sparse: it is part of tau
    steps: int
    rising: int  # readings between LOW and HIGH
    residual: float  # RMS, speed unit
    speed_unit: str
    of_curve: float | None  # settled speed over the command curve's, median; None: no curve
    points: Array = field(repr=False)  # (N, 2): time behind the step, share of it; all readings


def share_done(since_s: Array, tau_s: float, window_s: float) -> Array:
    """Share of a step that a reading shows, so long behind it: y, or Y over a window."""
    s = np.maximum(since_s, 0.0)
    if window_s == 0.0:
        return np.asarray(-np.expm1(-s / tau_s))
    before = np.maximum(since_s - window_s, 0.0)
    area = s - before + tau_s * (np.expm1(-s / tau_s) - np.expm1(-before / tau_s))
    return np.asarray(area / window_s)


def find_steps(record: Record) -> list[Step]:
    """Jumps of the command that stand alone for HOLD_S on either side."""
    time_s, command = record.command_time_s, record.command
    span = float(np.ptp(command))
    if span == 0.0:
        return []
    # Moments at which the command leaves what it was: the ends of the constant stretches.
    changes = np.flatnonzero(np.abs(np.diff(command)) > STEADY * span) + 1
    edges = np.concatenate([[0], changes, [len(command) - 1]])
    steps = []
    for i in range(1, len(edges) - 1):
        k = int(edges[i])
        begin_s = float(time_s[edges[i - 1]])
        end_s = float(time_s[edges[i + 1]])
        change = float(command[k] - command[k - 1])
        drift = max(
            float(np.ptp(command[edges[i - 1] : k])),
            float(np.ptp(command[k : max(int(edges[i + 1]), k + 1)])),
        )
        held = time_s[k] - begin_s >= HOLD_S and end_s - time_s[k] >= HOLD_S
        if held and abs(change) >= LEAST_STEP * span and drift <= 2.0 * STEADY * span:
            steps.append(Step(k, float(time_s[k]), begin_s, end_s, change))
    return steps


def fit_lag(record: Record) -> MotorLag:
    """One motor's time constant; Incomplete, with what is missing, when it cannot be told."""
    name = f"M{record.motor}"
    known = np.isfinite(record.speed)
    if not known.any():
        raise Incomplete(f"{name}: expected speeds, found none: its ESC tells no revolutions")
    steps = find_steps(record)
    if not steps:
        raise Incomplete(
            f"{name}: expected steps of the command with {HOLD_S} s constant on either side, "
            f"found none (command {record.command.min():.6g} to {record.command.max():.6g})"
        )
    fit = _Fit(record, steps)
    return fit.solve(name)


class _Fit:
    """Readings of one motor around its steps, and the least-squares problem of them."""

    def __init__(self, record: Record, steps: list[Step]) -> None:
        self.window_s = record.window_s
        self.unit = record.speed_unit
        self.motor = record.motor
        self.command_period_s = float(np.median(np.diff(record.command_time_s)))
        since, speed, owner = [], [], []
        for number, step in enumerate(steps):
            # A mean that reaches back behind the step before, or a motor not yet settled from it,
            # says nothing about this one.
            first = step.begin_s + 0.5 * HOLD_S + record.window_s
            inside = (record.speed_time_s >= min(first, step.time_s)) & (
                record.speed_time_s <= step.end_s
            )
            inside &= np.isfinite(record.speed)
            since.append(record.speed_time_s[inside] - step.time_s)
            speed.append(record.speed[inside])
            owner.append(np.full(int(inside.sum()), number))
        self.since = np.concatenate(since)
        self.speed = np.concatenate(speed)
        self.owner = np.concatenate(owner)
        self.steps = len(steps)
        self.curve_speed: Array | None = None
        if record.curve_speed is not None:
            self.curve_speed = record.curve_speed[[step.index for step in steps]]

    def solve(self, name: str) -> MotorLag:
        tau_s, dead_s = 0.05, 0.0
        tells_dead_time = self.window_s == 0.0
        for _ in range(5):  # the readings in the range depend on tau: settled after two or three
            guess_s = tau_s
            used, rising = self._choose(tau_s, dead_s)
            used, whole = self._complete(used)
            count = int((rising & used).sum())
            if count < LEAST_RISING:
                raise Incomplete(
                    f"{name}: expected {LEAST_RISING} readings between {LOW:.0%} and {HIGH:.0%} of "
                    f"a step with readings before and after it, found {count} of {whole} steps: "
                    "more steps, or faster readings"
                )
            tau_s, dead_s, sigma_s, residual, change = self._fit(
                used, tau_s, dead_s, tells_dead_time
            )
            if abs(tau_s - guess_s) < 0.01 * sigma_s:
                break
        if not tells_dead_time:  # the step came somewhere between two commands: no d takes it up
            sigma_s = float(np.hypot(sigma_s, self.command_period_s / 12.0**0.5))
        if residual > 0.0 and abs(change) < 5.0 * residual:
            raise Incomplete(
                f"{name}: expected the speed to follow the command, found a change of "
                f"{change:.3g} {self.unit} with a scatter of {residual:.3g}"
            )
        if not sigma_s < WORST_SIGMA * tau_s or not TAU_RANGE_S[0] * 1.01 < tau_s < TAU_RANGE_S[1]:
            raise Incomplete(
                f"{name}: expected a time constant known to {WORST_SIGMA:.0%}, found "
                f"{1e3 * tau_s:.1f} +- {1e3 * sigma_s:.1f} ms: more or larger steps"
            )
        return MotorLag(
            self.motor,
            tau_s,
            sigma_s,
            dead_s if tells_dead_time else None,
            whole,
            count,
            residual,
            self.unit,
            self._of_curve(used, tau_s, dead_s),
            self._points(used, tau_s, dead_s),
        )

    def _choose(self, tau_s: float, dead_s: float) -> tuple[Flags, Flags]:
        share = share_done(self.since - dead_s, tau_s, self.window_s)
        rising = (share >= LOW) & (share <= HIGH)
        settled = self.since - dead_s - self.window_s >= SETTLED * tau_s
        return (self.since <= 0.0) | rising | settled, rising

    def _complete(self, used: Flags) -> tuple[Flags, int]:
        """Without the steps that lack a level: w0 and w1 need a reading each."""
        whole = 0
        for number in range(self.steps):
            mine = (self.owner == number) & used
            before = (mine & (self.since <= 0.0)).any()
            if before and (mine & (self.since > self.window_s + HOLD_S / 2.0)).any():
                whole += 1
            else:
                used = used & (self.owner != number)
        return used, whole

    def _levels(self, share: Array, used: Flags) -> tuple[Array, Array]:
        """w0 and w1 of each step by linear least squares for this shape, and the residuals."""
        owner, after, speed = self.owner[used], share[used], self.speed[used]
        before = 1.0 - after

        def total(x: Array) -> Array:
            return np.asarray(np.bincount(owner, x, self.steps), dtype=np.float64)

        # Normal equations of each step's two unknowns, all steps at once.
        aa, ab, bb = total(before * before), total(before * after), total(after * after)
        ay, by = total(before * speed), total(after * speed)
        determinant = aa * bb - ab * ab
        known = determinant > 0.0
        levels = np.full((self.steps, 2), np.nan)
        levels[known, 0] = (bb * ay - ab * by)[known] / determinant[known]
        levels[known, 1] = (aa * by - ab * ay)[known] / determinant[known]
        return levels, speed - levels[owner, 0] * before - levels[owner, 1] * after

    def _fit(
        self, used: Flags, tau_s: float, dead_s: float, tells_dead_time: bool
    ) -> tuple[float, float, float, float, float]:
        """Variable projection (Golub and Pereyra 1973): the levels are solved for inside."""

        def residuals(x: Array) -> Array:
            dead = x[1] if tells_dead_time else 0.0
            share = share_done(self.since - dead, float(np.exp(x[0])), self.window_s)
            return self._levels(share, used)[1]

        start = np.array([np.log(tau_s), dead_s] if tells_dead_time else [np.log(tau_s)])
        low, high = np.log(TAU_RANGE_S[0]), np.log(TAU_RANGE_S[1])
        bounds = ([low, -0.05], [high, 0.5]) if tells_dead_time else ([low], [high])
        found = least_squares(residuals, start, bounds=bounds, x_scale=0.1)
        tau_s = float(np.exp(found.x[0]))
        dead_s = float(found.x[1]) if tells_dead_time else 0.0
        levels = self._levels(share_done(self.since - dead_s, tau_s, self.window_s), used)[0]
        told = len(np.unique(self.owner[used]))
        freedom = max(int(used.sum()) - 2 * told - len(start), 1)
        variance = float((found.fun**2).sum()) / freedom
        covariance = variance * np.linalg.pinv(found.jac.T @ found.jac)
        sigma_s = tau_s * float(np.sqrt(covariance[0, 0]))  # of log tau, hence the factor
        change = float(np.nanmedian(np.abs(levels[:, 1] - levels[:, 0])))
        return tau_s, dead_s, sigma_s, float(np.sqrt(variance)), change

    def _of_curve(self, used: Flags, tau_s: float, dead_s: float) -> float | None:
        if self.curve_speed is None:
            return None
        after = self._levels(share_done(self.since - dead_s, tau_s, self.window_s), used)[0][:, 1]
        known = np.isfinite(after) & (self.curve_speed > 0.0)
        return float(np.median(after[known] / self.curve_speed[known])) if known.any() else None

    def _points(self, used: Flags, tau_s: float, dead_s: float) -> Array:
        """Each reading as time behind the step and share of it, for the figure."""
        share = share_done(self.since - dead_s, tau_s, self.window_s)
        levels = self._levels(share, used)[0]
        change = levels[:, 1] - levels[:, 0]
        y = (self.speed - levels[self.owner, 0]) / change[self.owner]
        return np.asarray(np.column_stack([self.since, y])[np.isfinite(y)])
