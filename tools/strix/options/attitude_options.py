"""What the options about gravity and the magnetometer buy."""

from __future__ import annotations

import numpy as np

from strix._core import MagFusion, MotorState, TiltFusion, WithMotors
from strix.options.comparison import Comparison, Numbers, Panel, compare, curves
from strix.options.flights import (
    MAG_HZ,
    Array,
    Readings,
    Track,
    Truth,
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

TILT = "tilt error (deg)"
HEADING = "heading error (deg)"
# What a start-up calibration leaves in the gyro.
GYRO_BIAS_RAD_S = np.array([0.002, -0.001, 0.002])


def _tilt(track: Track) -> Array:
    return track.tilt_deg


def _heading(track: Track) -> Array:
    return track.heading_deg


def vibration(seeds: range = range(4)) -> Comparison:
    """Motors shake the accelerometer by 4 m/s^2 RMS an axis, and what the sensor rectifies of it
    stays: 1 m/s^2 to the side. The tilt update alone, without GPS, altimeter or bounded motion.
    """
    begin_s, end_s = 20.0, 80.0
    unaided = {"boundedMotion": False, "standstillAid": False}
    configs = {
        "gate": tuned(tiltFusion=TiltFusion.Gated, **unaided),
        "gate, off with motors": tuned(
            tiltFusion=TiltFusion.Gated, tiltWithMotors=WithMotors.Off, **unaided
        ),
        "gate, inflated with motors": tuned(
            tiltFusion=TiltFusion.Gated, tiltWithMotors=WithMotors.Inflated, **unaided
        ),
        "noise from vibration": tuned(tiltFusion=TiltFusion.Vibration, **unaided),
    }

    def run(variant: str, seed: int) -> Track:
        rng = np.random.default_rng(seed)
        truth = at_rest(end_s)
        readings = measure(truth, rng, gyro_bias=0.2 * GYRO_BIAS_RAD_S)
        time_s = clock(end_s)[1:]
        running = (time_s > begin_s)[:, None]
        readings.accel_m_s2 += running * rng.normal([0.0, 1.0, 0.0], 4.0, (len(time_s), 3))
        readings.use_gps = readings.use_alt = False
        return navigate(truth, readings, configs[variant], motors={begin_s: MotorState.Disturbed})

    def judge(track: Track) -> Numbers:
        return {
            "tilt before (deg)": rms(track.tilt_deg[~track.after(begin_s)]),
            "tilt (deg)": rms(track.tilt_deg[track.after(begin_s)]),
        }

    tracks, result = compare(configs, seeds, run, judge)
    return Comparison(
        title="Tilt update with shaking motors",
        time_s=tracks["gate"].time_s,
        panels=(Panel(TILT, curves(tracks, _tilt)),),
        result=result,
        marked={"motors shake": (begin_s, end_s)},
    )


HOVER_IRON_UT = np.array([6.0, -8.0, 3.0])  # 10 uT of current-dependent hard iron


def motor_iron(seeds: range = range(4)) -> Comparison:
    """The motors' current adds 10 uT while hovering and 0 to 30 uT in an agile part. The field
    tracker, which would notice much of it by itself, is off.
    """
    start_s, agile_s, calm_s, end_s = 10.0, 40.0, 60.0, 90.0
    calibrated = {"magHoverOffset": HOVER_IRON_UT.astype(np.float32), "trackField": False}
    configs = {
        "on": tuned(trackField=False),
        "inflated": tuned(magWithMotors=WithMotors.Inflated, **calibrated),
        "hover only": tuned(magWithMotors=WithMotors.HoverOnly, **calibrated),
        "off": tuned(magWithMotors=WithMotors.Off, **calibrated),
    }
    motors = {
        start_s: MotorState.Hover,
        agile_s: MotorState.Disturbed,
        calm_s: MotorState.Hover,
    }

    def run(variant: str, seed: int) -> Track:
        rng = np.random.default_rng(seed)
        time_s = clock(end_s)
        flying = begun(time_s, start_s)
        truth = fly(
            flying * waves(time_s, rng, 1.0, 0.05, 0.2),
            flying[1:] * waves(time_s[1:], rng, 0.3, 0.05, 0.5),
        )
        readings = measure(truth, rng, gyro_bias=0.5 * GYRO_BIAS_RAD_S)
        mag_s = truth.times(MAG_HZ)
        agile = (mag_s >= agile_s) & (mag_s < calm_s)
        current = np.where(agile, 1.5 * (1.0 + np.sin(2.0 * mag_s)), 1.0) * (mag_s >= start_s)
        readings.mag_ut += current[:, None] * HOVER_IRON_UT
        return navigate(truth, readings, configs[variant], motors=motors)

    def judge(track: Track) -> Numbers:
        return {
            "heading (deg)": rms(track.heading_deg[track.after(start_s)]),
            "heading at the end (deg)": rms(track.heading_deg[track.after(end_s - 5.0)]),
        }

    tracks, result = compare(configs, seeds, run, judge)
    return Comparison(
        title="Magnetometer beside running motors: magWithMotors",
        time_s=tracks["on"].time_s,
        panels=(Panel(HEADING, curves(tracks, _heading)),),
        result=result,
        marked={"hover": (start_s, agile_s), "agile": (agile_s, calm_s)},
    )


def bent_field(seeds: range = range(4)) -> Comparison:
    """Iron in the ground adds 15 uT downwards for 20 s: no heading is wrong in it, but three axes
    take it for a tilt. The field tracker is off.
    """
    begin_s, end_s, last_s = 20.0, 40.0, 60.0
    configs = {
        "three axes": tuned(magFusion=MagFusion.ThreeAxis, trackField=False),
        "heading only": tuned(magFusion=MagFusion.HeadingOnly, trackField=False),
    }

    def run(variant: str, seed: int) -> Track:
        rng = np.random.default_rng(seed)
        time_s = clock(last_s)
        flying = begun(time_s, 2.0)
        rate = 0.2 * waves(time_s[1:], rng, 1.0, 0.05, 0.5) * [0.0, 0.0, 1.0]
        truth = fly(flying * waves(time_s, rng, 1.0, 0.05, 0.3), flying[1:] * rate)
        readings = measure(truth, rng, gyro_bias=0.2 * GYRO_BIAS_RAD_S)
        mag_s = truth.times(MAG_HZ)
        bent = (mag_s >= begin_s) & (mag_s < end_s)
        readings.mag_ut[bent] += [0.0, 0.0, 15.0]  # level flight: down is down
        return navigate(truth, readings, configs[variant])

    def judge(track: Track) -> Numbers:
        bent = track.after(begin_s) & ~track.after(end_s)
        return {
            "tilt before (deg)": rms(track.tilt_deg[~track.after(begin_s)]),
            "tilt (deg)": rms(track.tilt_deg[bent]),
            "heading (deg)": rms(track.heading_deg[bent]),
        }

    tracks, result = compare(configs, seeds, run, judge)
    return Comparison(
        title="A magnetic field bent downwards: magFusion",
        time_s=tracks["three axes"].time_s,
        panels=(Panel(TILT, curves(tracks, _tilt)), Panel(HEADING, curves(tracks, _heading))),
        result=result,
        marked={"bent field": (begin_s, end_s)},
    )


def bounded_motion(seeds: range = range(4)) -> Comparison:
    """A hand carries the aircraft about, 1 m/s and 1 rad/s RMS an axis; no GPS, no altimeter."""
    duration_s = 120.0
    configs = {
        "published tilt gate": tuned(tiltFusion=TiltFusion.Gated, boundedMotion=False),
        "bounded motion": tuned(),
    }

    def run(variant: str, seed: int) -> Track:
        rng = np.random.default_rng(seed)
        time_s = clock(duration_s)
        moving = begun(time_s, 5.0)
        truth = fly(
            moving * waves(time_s, rng, 1.0, 0.15, 0.8),
            moving[1:] * waves(time_s[1:], rng, 1.0, 0.05, 1.0),
        )
        readings = measure(truth, rng, gyro_bias=GYRO_BIAS_RAD_S)
        readings.use_gps = readings.use_alt = False
        return navigate(truth, readings, configs[variant])

    def judge(track: Track) -> Numbers:
        lively = track.after(10.0)
        return {
            "tilt (deg)": rms(track.tilt_deg[lively]),
            "heading (deg)": rms(track.heading_deg[lively]),
        }

    tracks, result = compare(configs, seeds, run, judge)
    return Comparison(
        title="Lively motion in the hand, no GPS: boundedMotion",
        time_s=tracks["bounded motion"].time_s,
        panels=(Panel(TILT, curves(tracks, _tilt)), Panel(HEADING, curves(tracks, _heading))),
        result=result,
        marked={"moving": (5.0, duration_s)},
    )


TURNS = 3
TURN_RATE_RAD_S = 2.0 * np.pi


def _turns(end_s: float, begin_s: float, rng: np.random.Generator) -> tuple[Truth, Readings]:
    """Three full turns in yaw at 360 deg/s in hover, with a gyro that shows 0.5 % too much."""
    time_s = clock(end_s)
    turning = (time_s[1:] > begin_s) & (time_s[1:] <= begin_s + TURNS)
    rate = np.zeros((len(turning), 3))
    rate[turning, 2] = TURN_RATE_RAD_S
    flying = begun(time_s, 2.0)
    truth = fly(flying * waves(time_s, rng, 0.5, 0.05, 0.3), rate)
    return truth, measure(truth, rng, gyro_bias=0.2 * GYRO_BIAS_RAD_S, gyro_scale=0.005)


def yaw_turns(seeds: range = range(4)) -> Comparison:
    """What is not to be seen must stay put: three rapid turns, then 20 s more of hovering."""
    begin_s = 20.0
    end_s = begin_s + TURNS + 20.0
    configs = {
        "three axes": tuned(magFusion=MagFusion.ThreeAxis, magBiasSigma0=2.0),
        "heading only": tuned(magFusion=MagFusion.HeadingOnly),  # estimates no magnetometer bias
    }

    def run(variant: str, seed: int) -> Track:
        truth, readings = _turns(end_s, begin_s, np.random.default_rng(seed))
        return navigate(truth, readings, configs[variant])

    def bias(track: Track) -> Array:
        return np.asarray(np.linalg.norm(track.mag_bias_ut, axis=1))

    def judge(track: Track) -> Numbers:
        before = np.flatnonzero(track.after(begin_s - 0.05))[0]
        stopped = np.flatnonzero(track.after(begin_s + TURNS + 0.05))[0]
        wrong = bias(track)[before:]  # there is none
        gyro = np.linalg.norm(
            track.gyro_bias_rad_s[before:] - track.gyro_bias_rad_s[before], axis=1
        )
        return {
            "magnetometer bias moves off by (uT)": float(wrong.max() - wrong[0]),
            "magnetometer bias at the end (uT)": float(wrong[-1]),
            "gyro bias moves by (rad/s)": float(gyro.max()),
            "yaw when stopped (deg)": float(abs(track.heading_deg[stopped])),
            "yaw at the end (deg)": float(abs(track.heading_deg[-1])),
        }

    tracks, result = compare(configs, seeds, run, judge)
    return Comparison(
        title="Three rapid turns in yaw, gyro 0.5 % wrong",
        time_s=tracks["heading only"].time_s,
        panels=(
            Panel(HEADING, curves(tracks, _heading)),
            Panel("estimated magnetometer bias (uT)", curves(tracks, bias)),
        ),
        result=result,
        marked={"turning": (begin_s, begin_s + TURNS)},
    )
