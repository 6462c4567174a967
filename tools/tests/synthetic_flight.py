"""A made-up flight for the tests of log, summary and report: its log, and the truth beside it.

The mission: stand still until 15 s, take off to 2 m, go 5 m north and 3 m east, turn 90 deg to the
right, come back, land. The estimate is the truth with a slow error that an estimator of the logged
standard deviations would make.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from ulog_writer import ULogWriter

from strix.score import multiply
from strix.track import TruthTrack

Array = NDArray[np.float64]

BOOT, IDLE, ARMED, TAKEOFF, HOLD, WAYPOINT, LAND, SAFE = range(8)

# From when, state, then where the reference is going from there: north, east, height m, yaw deg.
LEGS = (
    (0.0, BOOT, (0.0, 0.0, 0.0, 0.0)),
    (5.0, IDLE, (0.0, 0.0, 0.0, 0.0)),
    (15.0, ARMED, (0.0, 0.0, 0.0, 0.0)),
    (16.0, TAKEOFF, (0.0, 0.0, 2.0, 0.0)),
    (21.5, HOLD, (0.0, 0.0, 2.0, 0.0)),
    (24.5, WAYPOINT, (5.0, 3.0, 2.0, 0.0)),
    (33.0, HOLD, (5.0, 3.0, 2.0, 0.0)),
    (36.0, WAYPOINT, (5.0, 3.0, 2.0, 90.0)),
    (39.0, HOLD, (5.0, 3.0, 2.0, 90.0)),
    (42.0, WAYPOINT, (0.0, 0.0, 2.0, 90.0)),
    (50.5, HOLD, (0.0, 0.0, 2.0, 90.0)),
    (52.0, LAND, (0.0, 0.0, 0.0, 90.0)),
    (58.0, IDLE, (0.0, 0.0, 0.0, 90.0)),
)
END_S = 60.0
LIFT_OFF_S, TOUCH_DOWN_S = 16.3, 57.0

SAID = {
    IDLE: "calibrated",
    ARMED: "armed",
    TAKEOFF: "take-off",
    HOLD: "at the waypoint",
    WAYPOINT: "next leg",
    LAND: "mission done: landing",
}


@dataclass(frozen=True)
class SyntheticFlight:
    """The log's path and what really happened."""

    log: Path
    truth: TruthTrack


def quaternion(roll_rad: Array, pitch_rad: Array, yaw_rad: Array) -> Array:
    """Attitudes [w x y z] from yaw, then pitch, then roll."""
    zero = np.zeros_like(yaw_rad)

    def about(axis: int, angle: Array) -> Array:
        columns = [np.cos(angle / 2.0), zero, zero, zero]
        columns[axis] = np.sin(angle / 2.0)
        return np.column_stack(columns)

    return multiply(multiply(about(3, yaw_rad), about(2, pitch_rad)), about(1, roll_rad))


def times(rate_hz: float) -> Array:
    return np.arange(round(END_S * rate_hz)) / rate_hz


def reference(time_s: Array) -> Array:
    """Columns north, east, height m, yaw rad: smooth from each leg to the next."""
    places = np.array([place for _, _, place in LEGS])
    values = np.repeat(places[:1], len(time_s), axis=0)
    for (begin, _, _), (end, _, _), step in zip(
        LEGS[1:-1], LEGS[2:], np.diff(places[:-1], axis=0), strict=True
    ):
        values += step * _smooth((time_s - begin) / max(end - begin - 1.5, 0.5))[:, None]
    values[:, 3] = np.radians(values[:, 3])
    return values


def _smooth(part: Array) -> Array:
    """From 0 to 1 without a jump of the acceleration."""
    p = np.clip(part, 0.0, 1.0)
    return np.asarray(p**3 * (10.0 - 15.0 * p + 6.0 * p**2))


def truth_track(rate_hz: float = 200.0) -> TruthTrack:
    """What flew: the reference, 0.25 s late, with a little sway, on the ground until lift-off."""
    t = times(rate_hz)
    flying = (t > LIFT_OFF_S) & (t < TOUCH_DOWN_S)
    sway = _smooth((t - LIFT_OFF_S) / 4.0) * _smooth((TOUCH_DOWN_S - t) / 4.0)
    place = reference(t - 0.25)
    ned = place[:, :3] * [1.0, 1.0, -1.0]
    ned[:, 0] += 0.10 * sway * np.sin(1.1 * t)
    ned[:, 1] += 0.10 * sway * np.cos(0.9 * t)
    ned[:, 2] += 0.03 * sway * np.sin(2.0 * t)
    velocity = np.gradient(ned, 1.0 / rate_hz, axis=0)
    acceleration = np.gradient(velocity, 1.0 / rate_hz, axis=0)
    forward = np.cos(place[:, 3]) * acceleration[:, 0] + np.sin(place[:, 3]) * acceleration[:, 1]
    right = np.cos(place[:, 3]) * acceleration[:, 1] - np.sin(place[:, 3]) * acceleration[:, 0]
    still = np.where(flying, 1.0, 0.0)
    return TruthTrack(
        time_s=t,
        position_ned_m=ned,
        velocity_ned_m_s=velocity,
        attitude=quaternion(still * right / 9.81, -still * forward / 9.81, place[:, 3]),
        rate_body_rad_s=np.zeros((len(t), 3)),
        rotor_speed=np.zeros((len(t), 4)),
        on_ground=~flying,
    )


def write_flight(path: Path) -> SyntheticFlight:
    """The whole flight, every topic of estimate and control at its rate on the aircraft."""
    rng = np.random.default_rng(1)
    truth = truth_track()
    log = ULogWriter()
    log.info("sys_name", "Strix")
    log.info("vehicle", "Quad5in")
    log.info("ver_hw", "simulator")

    t = times(500.0)
    starts = np.array([begin for begin, _, _ in LEGS])
    states = np.array([state for _, state, _ in LEGS])

    def state_at(time_s: Array) -> NDArray[np.int_]:
        return np.asarray(states[np.searchsorted(starts, time_s, side="right") - 1])

    motors_on = (state_at(t) >= ARMED) & (state_at(t) <= LAND)
    controlled = (state_at(t) >= TAKEOFF) & (state_at(t) <= LAND)

    def error(time_s: Array, sigma: float) -> Array:
        """A slow wander of about one sigma, three columns."""
        phase = rng.uniform(0.0, 6.0, (3, 3))
        waves = [
            np.sin(np.outer(time_s, [0.31, 0.47, 0.71]) * (1 + k) + phase[k]) / (1 + k)
            for k in range(3)
        ]
        return np.asarray(sigma * np.sum(waves, axis=0))

    tilt_error = error(t, 0.006)
    small = np.column_stack([np.ones(len(t)), tilt_error / 2.0])
    attitude = multiply(truth.at(t, truth.attitude), small)
    log.topic("vehicle_attitude", t, {"q": attitude / np.linalg.norm(attitude, axis=1)[:, None]})
    log.topic("vehicle_angular_velocity", t, {"xyz": rng.normal(0.0, 0.003, (len(t), 3))})

    t100 = times(100.0)
    position = truth.at(t100, truth.position_ned_m) + error(t100, 0.3)
    velocity = truth.at(t100, truth.velocity_ned_m_s) + error(t100, 0.06)
    fields = dict(zip(("x", "y", "z", "vx", "vy", "vz"), np.c_[position, velocity].T, strict=True))
    log.topic("vehicle_local_position", t100, fields)
    wanted = reference(t100)
    ned = wanted[:, :3] * [1.0, 1.0, -1.0]
    log.topic(
        "trajectory_setpoint",
        t100,
        {
            "position": ned,
            "velocity": np.gradient(ned, 0.01, axis=0),
            "yaw": (wanted[:, 3] + np.pi) % (2.0 * np.pi) - np.pi,
        },
    )
    log.topic(
        "vehicle_attitude_setpoint",
        t100,
        {"q_d": truth.at(t100 + 0.05, truth.attitude)},
    )

    t50 = times(50.0)
    settle = np.exp(-t50 / 3.0)[:, None]
    # Position, velocity, attitude; biases of accelerometer, gyro and magnetometer.
    levels = np.repeat([0.35, 0.07, 0.008, 0.02, 0.001, 0.0], 3)
    sigma = levels * (1.0 + 2.0 * settle)
    log.topic("estimator_std", t50, {"std_dev": sigma})
    log.topic("estimator_start", [5.0], {"gravity": 9.807})

    for instance, (rate, count) in enumerate([(100.0, 3), (100.0, 3), (50.0, 1), (10.0, 4)]):
        ti = times(rate)
        nis = np.zeros((len(ti), 4))
        nis[:, :count] = rng.normal(0.0, 0.9, (len(ti), count)) ** 2
        rejected = np.sum((nis > 6.635) << np.arange(4), axis=1)
        log.topic(
            "estimator_aid_source",
            ti,
            {
                "innovation": np.sqrt(nis),
                "innovation_variance": 1.0,
                "nis": nis,
                "count": np.where(ti < 5.0, 0, count),
                "rejected": rejected,
            },
            instance,
        )

    thrust = np.where(controlled, 8.14, 0.0)
    torque = np.where(controlled[:, None], rng.normal(0.0, 0.01, (len(t), 3)), 0.0)
    log.topic("wrench_setpoint", t, {"thrust": thrust, "torque": torque})
    given = torque.copy()
    jump = (t > 36.0) & (t < 36.3)
    given[jump, 2] = 0.0
    log.topic("wrench_achieved", t, {"thrust": thrust, "torque": given})
    pulse = np.where(motors_on, 1250.0, 1150.0)[:, None] + np.where(controlled, 80.0, 0.0)[:, None]
    pulse = pulse + np.where(controlled[:, None], rng.normal(0.0, 12.0, (len(t), 4)), 0.0)
    pulse[jump] = 1700.0
    log.topic("actuator_outputs", t, {"noutputs": 4, "output": pulse})

    ts = np.unique(np.r_[times(10.0), starts])
    on, flying = state_at(ts), (state_at(ts) >= TAKEOFF) & (state_at(ts) <= LAND)
    log.topic(
        "flight_state",
        ts,
        {
            "state": on,
            "controller_on": flying,
            "motors_on": flying | (on == ARMED),
        },
    )
    pass_us = rng.gamma(8.0, 25.0, len(t))
    log.topic("control_tick", t, {"pass_us": pass_us, "overruns": np.where(t > 40.0, 1, 0)})
    t2 = times(2.0)
    log.topic("log_status", t2, {"bytes": 250e3 * t2, "longest_stall_us": 7000})

    for begin, state, _ in LEGS[1:]:
        log.text(begin, 6, SAID[state] if begin < 58.0 else "landed: disarmed")
    return SyntheticFlight(log.write(path), truth)
