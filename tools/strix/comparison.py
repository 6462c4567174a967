"""A flight log beside the truth, at common times: where the aircraft was and where it thought."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from strix.attitude import rotation_between
from strix.flightlog import Array, FlightLog
from strix.score import interpolate_attitude
from strix.track import TruthTrack

Flags = NDArray[np.bool_]
Kind = TypeVar("Kind", bound=np.generic)


@dataclass(frozen=True)
class Track:
    """Where the aircraft was."""

    time_s: Array
    position_ned_m: Array
    attitude: Array  # [w x y z], body to NED


@dataclass(frozen=True)
class Errors:
    """Estimate minus truth, columns as in the filter's error state."""

    time_s: Array
    position_ned_m: Array
    velocity_ned_m_s: Array
    attitude_rad: Array  # rotation vector from truth to estimate, about the body's axes


class Comparison:
    """One flight. `truth` is None for a real one: then what was flown is what was estimated."""

    def __init__(self, log: FlightLog, truth: TruthTrack | None) -> None:
        self.log = log
        self.truth = truth
        self.states = log.topic("flight_state")
        self.reference = log.topic("trajectory_setpoint")
        attitude = log.topic("vehicle_attitude")
        position = log.topic("vehicle_local_position")
        # The filter runs from start-up calibration on; what is logged before means nothing.
        started = log.topic("estimator_start").time_s if log.has("estimator_start") else [0.0]
        self.estimator_start_s = float(started[0])
        at = position.time_s >= self.estimator_start_s
        time_s = position.time_s[at]
        q = interpolate_attitude(np.column_stack([attitude.time_s, attitude["q"]]), time_s)
        self.estimate = Track(time_s, np.column_stack([position[f][at] for f in "xyz"]), q)
        self._velocity = np.column_stack([position[f][at] for f in ("vx", "vy", "vz")])
        self.flown = (
            Track(truth.time_s, truth.position_ned_m, truth.attitude) if truth else self.estimate
        )

    def flag(self, name: str, at_s: Array) -> Flags:
        """motors_on, controller_on or critical of flight_state, at the times."""
        return np.asarray(hold(at_s, self.states.time_s, self.states[name]) > 0.5)

    def in_flight(self, at_s: Array) -> Flags:
        """While the truth is off the ground, from when the motors were first on. Without truth:
        while the controller is on.
        """
        if self.truth is None:
            return self.flag("controller_on", at_s)
        armed_s = self.states.time_s[self.states["motors_on"] > 0.5]
        begun = at_s >= (armed_s[0] if len(armed_s) else np.inf)
        return np.asarray(begun & ~hold(at_s, self.truth.time_s, self.truth.on_ground))

    @cached_property
    def errors(self) -> Errors | None:
        """At the estimate's times for which there is truth; None for a real flight."""
        if self.truth is None:
            return None
        truth, estimate = self.truth, self.estimate
        at = (estimate.time_s >= truth.time_s[0]) & (estimate.time_s <= truth.time_s[-1])
        time_s = estimate.time_s[at]
        attitude = interpolate_attitude(np.column_stack([truth.time_s, truth.attitude]), time_s)
        return Errors(
            time_s,
            estimate.position_ned_m[at] - truth.at(time_s, truth.position_ned_m),
            self._velocity[at] - truth.at(time_s, truth.velocity_ned_m_s),
            rotation_between(attitude, estimate.attitude[at]),
        )

    def following(self, at_s: Array) -> Flags:
        """While the controller is on and the aircraft in flight: to land, the reference goes on
        below the ground.
        """
        return np.asarray(self.flag("controller_on", at_s) & self.in_flight(at_s))

    @cached_property
    def tracking_error_ned_m(self) -> Array:
        """Flown minus reference, at the reference's times while following it."""
        at = self.following(self.reference.time_s)
        time_s = self.reference.time_s[at]
        return (
            interpolate(time_s, self.flown.time_s, self.flown.position_ned_m)
            - (self.reference["position"][at])
        )


def hold(at_s: Array, time_s: Array, values: NDArray[Kind]) -> NDArray[Kind]:
    """The latest value at each of the times; the first one before there is any."""
    latest = np.searchsorted(time_s, at_s, side="right") - 1
    return np.asarray(values[np.maximum(latest, 0)])


def interpolate(at_s: Array, time_s: Array, values: Array) -> Array:
    """Linear, column by column."""
    return np.column_stack([np.interp(at_s, time_s, column) for column in values.T])
