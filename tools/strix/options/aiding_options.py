"""What the options about GPS, height and standing still buy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strix.ideal_flight import exponential
from strix.options.comparison import Comparison, Numbers, Panel, compare, curves
from strix.options.flights import (
    GPS_HZ,
    Array,
    Track,
    Truth,
    aligned,
    at_rest,
    begun,
    clock,
    fly,
    measure,
    navigate,
    rms,
    tuned,
    waves,
)
from strix.score import multiply

HORIZONTAL = "horizontal position error (m)"
VELOCITY = "horizontal velocity error (m/s)"
JUMP_M = 30.0


def _position(track: Track) -> Array:
    return np.asarray(np.linalg.norm(track.position_m[:, :2], axis=1))


def _velocity(track: Track) -> Array:
    return np.asarray(np.linalg.norm(track.velocity_m_s[:, :2], axis=1))


def _cruise(duration_s: float, rng: np.random.Generator, speed_m_s: float = 2.0) -> Truth:
    """From rest after 5 s into a slow wander, turning a little."""
    time_s = clock(duration_s)
    flying = begun(time_s, 5.0)
    return fly(
        flying * waves(time_s, rng, speed_m_s, 0.03, 0.2),
        flying[1:] * waves(time_s[1:], rng, 0.3, 0.05, 0.5),
    )


def gps_jump(seeds: range = range(4)) -> Comparison:
    """At 30 s the fixes jump by 30 m to the north and stay there: from now on they are right, and
    the filter is sure of where they were before.
    """
    jump_s, end_s = 30.0, 60.0
    configs = {"never": tuned(readmitAfter=0), "after 1 s": tuned(readmitAfter=1_000_000)}

    def run(variant: str, seed: int) -> Track:
        rng = np.random.default_rng(seed)
        truth = _cruise(end_s, rng)
        readings = measure(truth, rng)
        readings.fix[truth.times(GPS_HZ) > jump_s, 0] += JUMP_M
        return navigate(truth, readings, configs[variant])

    def to_the_fixes(track: Track) -> Array:
        error = track.position_m[:, :2] - track.after(jump_s)[:, None] * [JUMP_M, 0.0]
        return np.asarray(np.linalg.norm(error, axis=1))

    def judge(track: Track) -> Numbers:
        jumped = track.after(jump_s)
        return {
            "position 5 s after (m)": float(to_the_fixes(track)[track.after(jump_s + 5.0)][0]),
            "position at the end (m)": float(to_the_fixes(track)[-1]),
            "velocity (m/s)": float(_velocity(track)[jumped].max()),
            "tilt (deg)": float(track.tilt_deg[jumped].max()),
            "readmissions": float(track.navigation.gpsInnovation().readmissions),
        }

    tracks, result = compare(configs, seeds, run, judge)
    return Comparison(
        title="GPS jumps by 30 m and stays: readmitAfter",
        time_s=tracks["never"].time_s,
        panels=(Panel("distance from the fixes (m)", curves(tracks, to_the_fixes)),),
        result=result,
        marked={"jumped": (jump_s, end_s)},
    )


GPS_AGE_S, ALT_AGE_S = 0.2, 0.3


def delays(seeds: range = range(4)) -> Comparison:
    """To and fro over 20 m in 8 s, up and down over 6 m; fixes come 0.2 s late, heights 0.3 s."""
    end_s = 60.0
    configs = {
        "taken as new": tuned(),
        "age known": tuned(gpsDelay=round(1e6 * GPS_AGE_S), altDelay=round(1e6 * ALT_AGE_S)),
    }

    def run(variant: str, seed: int) -> Track:
        rng = np.random.default_rng(seed)
        time_s = clock(end_s)
        swing = 2.0 * np.pi / 8.0 * time_s
        speed = 10.0 * 2.0 * np.pi / 8.0
        velocity = np.column_stack(
            [speed * np.cos(swing), np.zeros(len(swing)), -0.3 * speed * np.sin(swing)]
        )
        flying = begun(time_s, 5.0)
        truth = fly(flying * velocity, flying[1:] * waves(time_s[1:], rng, 0.2, 0.05, 0.5))
        readings = measure(truth, rng, gps_delay_s=GPS_AGE_S, alt_delay_s=ALT_AGE_S)
        return navigate(truth, readings, configs[variant])

    def judge(track: Track) -> Numbers:
        late = track.after(15.0)
        return {
            "position (m)": rms(track.position_m[late, :2]),
            "velocity (m/s)": rms(track.velocity_m_s[late, :2]),
            "height (m)": rms(track.position_m[late, 2]),
            "tilt (deg)": rms(track.tilt_deg[late]),
        }

    tracks, result = compare(configs, seeds, run, judge)
    return Comparison(
        title="GPS 0.2 s and heights 0.3 s late: gpsDelay, altDelay",
        time_s=tracks["age known"].time_s,
        panels=(
            Panel(HORIZONTAL, curves(tracks, _position)),
            Panel(VELOCITY, curves(tracks, _velocity)),
        ),
        result=result,
        marked={},
    )


def standstill(states: int = 18, seeds: range = range(4)) -> Comparison:
    """60 s on the ground without GPS, aligned there with a biased accelerometer (0.03 m/s^2, 3 mg).
    The gyro's bias is what a start-up calibration leaves, 0.001 rad/s an axis. Bounded motion is
    off, so that nothing else helps.
    """
    duration_s = 60.0
    configs = {
        "off": tuned(standstillAid=False, boundedMotion=False),
        "on": tuned(boundedMotion=False),
    }

    def run(variant: str, seed: int) -> Track:
        rng = np.random.default_rng(seed)
        bias = rng.normal(0.0, 0.03, 3)
        truth = at_rest(duration_s)
        readings = measure(truth, rng, accel_bias=bias, gyro_bias=rng.normal(0.0, 0.001, 3))
        readings.use_gps = False
        start = aligned(truth.start, accel_bias=bias)
        return navigate(truth, readings, configs[variant], states, start=start)

    def judge(track: Track) -> Numbers:
        return {
            "drift (m)": float(_position(track).max()),
            "height drift (m)": float(abs(track.position_m[:, 2]).max()),
            "heading (deg)": float(abs(track.heading_deg).max()),
        }

    tracks, result = compare(configs, seeds, run, judge)
    return Comparison(
        title=f"60 s on the ground without GPS, {states} states: standstillAid",
        time_s=tracks["on"].time_s,
        panels=(Panel("horizontal drift (m)", curves(tracks, _position), logarithmic=True),),
        result=result,
        marked={},
    )


@dataclass(frozen=True)
class Outage:
    """What is known of dead reckoning after many outages of one length."""

    comparison: Comparison
    nees: dict[
        str, Array
    ]  # e^T P^-1 e of position and velocity, north and east: 4 dof, a seed each
    beyond: dict[str, float]  # part of all records in outages with a position beyond 3 sigma


def outage(seeds: range = range(30), duration_s: float = 15.0) -> Outage:
    """No fixes for some time in flight. First errors and noise are drawn as the filter expects
    them: then its covariance must be that of the error. With bounded motion it also believes that
    the aircraft goes on moving as it did.
    """
    begin_s = 40.0
    configs = {"dead reckoning": tuned(boundedMotion=False), "bounded motion": tuned()}
    nees: dict[str, list[float]] = {variant: [] for variant in configs}
    far: dict[str, list[float]] = {variant: [] for variant in configs}

    def run(variant: str, seed: int) -> Track:
        rng = np.random.default_rng(seed)
        config = configs[variant]
        truth = _cruise(begin_s + duration_s, rng)
        readings = measure(
            truth,
            rng,
            accel_bias=rng.normal(0.0, config.accelBiasSigma0, 3),
            gyro_bias=rng.normal(0.0, config.gyroBiasSigma0, 3),
            accel_density=config.accelNoise,
            gyro_density=config.gyroNoise,
        )
        readings.silent["gps"] = (begin_s, np.inf)
        alpha = rng.normal(0.0, [config.tiltSigma0, config.tiltSigma0, config.headingSigma0])
        start = multiply(truth.start, exponential(-alpha[None, :]))
        track = navigate(truth, readings, config, start=aligned(start))
        error = np.concatenate([track.position_m[-1, :2], track.velocity_m_s[-1, :2]])
        known = track.navigation.covariance()[np.ix_([0, 1, 3, 4], [0, 1, 3, 4])]
        nees[variant].append(float(error @ np.linalg.solve(known.astype(np.float64), error)))
        out = track.after(begin_s)
        far[variant].append(
            float(np.mean(abs(track.position_m[out, :2]) > 3.0 * track.sigma[out, :2]))
        )
        return track

    def judge(track: Track) -> Numbers:
        return {
            "position at the end (m)": float(_position(track)[-1]),
            "one sigma (m)": float(np.hypot(*track.sigma[-1, :2])),
        }

    tracks, result = compare(configs, seeds, run, judge)
    both = curves(tracks, _position)
    for variant, track in tracks.items():
        both[f"{variant}, 3 sigma"] = 3.0 * np.hypot(*track.sigma[:, :2].T)
    comparison = Comparison(
        title=f"{duration_s:.0f} s without GPS: boundedMotion",
        time_s=tracks["bounded motion"].time_s,
        panels=(Panel(HORIZONTAL, both, dashed=True),),
        result=result,
        marked={"no GPS": (begin_s, begin_s + duration_s)},
        drawn_from_s=begin_s - 10.0,
    )
    return Outage(
        comparison,
        {variant: np.array(values) for variant, values in nees.items()},
        {variant: float(np.mean(values)) for variant, values in far.items()},
    )
