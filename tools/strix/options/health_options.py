"""What the health checks say and do: named flags, a new start from the complementary filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strix._core import NavigationConfig
from strix.ideal_flight import exponential
from strix.options.comparison import Comparison, Numbers, Panel, summed_up
from strix.options.flights import (
    HZ,
    LEVEL_NORTH,
    RECORD_HZ,
    Array,
    Track,
    aligned,
    begun,
    clock,
    fly,
    measure,
    navigate,
    tuned,
    waves,
)
from strix.score import multiply

# NavigationHealth.h
NOT_FINITE, NOT_POSITIVE_DEFINITE, RESTARTED, DISAGREE, NO_GPS, NO_ALT, NO_MAG = (
    1 << bit for bit in range(7)
)
LOST = NOT_FINITE | NOT_POSITIVE_DEFINITE


def _flight(
    seed: int,
    duration_s: float,
    config: NavigationConfig,
    silent: dict[str, tuple[float, float]] | None = None,
    poison: dict[float, Array] | None = None,
    wrong_rad: Array | None = None,
    use_gps: bool = True,
) -> Track:
    """A gentle flight, turned by `wrong_rad` (body, from level and north) at its alignment."""
    rng = np.random.default_rng(seed)
    time_s = clock(duration_s)
    flying = begun(time_s, 3.0)
    truth = fly(
        flying * waves(time_s, rng, 0.5, 0.05, 0.3),
        flying[1:] * waves(time_s[1:], rng, 0.2, 0.05, 0.5),
    )
    readings = measure(truth, rng, gps_delay_s=1e-6 * config.gpsDelay)
    readings.silent.update(silent or {})
    readings.use_gps = use_gps
    wrong = np.zeros(3) if wrong_rad is None else wrong_rad
    start = aligned(multiply(LEVEL_NORTH, exponential(wrong[None, :])))
    return navigate(truth, readings, config, start=start, poison=poison)


def silent_sensors() -> Comparison:
    """GPS, altimeter and magnetometer fall silent at 20, 25 and 30 s and speak again at 70 s."""
    cut = {"gps": (20.0, 70.0), "alt": (25.0, 70.0), "mag": (30.0, 70.0)}
    track = _flight(0, 80.0, tuned(), silent=cut)
    flags = {"no GPS": NO_GPS, "no altimeter": NO_ALT, "no magnetometer": NO_MAG}
    judged: dict[str, list[Numbers]] = {}
    for (name, bit), (begin_s, end_s) in zip(flags.items(), cut.values(), strict=True):
        times = track.time_s[(track.health & bit) != 0]
        judged[name] = [
            {
                "raised (s after)": float(times[0] - begin_s),
                "cleared (s after)": float(times[-1] + 1.0 / RECORD_HZ - end_s),
            }
        ]
    return Comparison(
        title="Silent sensors raise their flags",
        time_s=track.time_s,
        panels=(
            Panel(
                "flag",
                {
                    name: 1.5 * i + np.sign(track.health & bit)
                    for i, (name, bit) in enumerate(flags.items())
                },
                ticks={1.5 * i + up: ("down", "up")[up] for i in range(3) for up in range(2)},
            ),
        ),
        result=summed_up(judged),
        marked={"all silent": (30.0, 70.0)},
    )


@dataclass(frozen=True)
class Loss:
    """A filter that is lost in flight, and what came of it."""

    track: Track
    lost_s: float  # when
    record: int  # the first record after it: of the same pass


def lost(accel_m_s2: float, gps_delay_s: float = 0.2) -> Loss:
    """One accelerometer reading in flight is this, on each axis: NaN, or wild enough to end the
    covariance.
    """
    row = 6 * HZ * 5 - 1  # the last before 30 s; it is also recorded
    poison = {row / HZ: np.full(3, accel_m_s2)}
    config = tuned(gpsDelay=round(1e6 * gps_delay_s))
    track = _flight(0, 60.0, config, poison=poison)
    record = int(np.flatnonzero(track.time_s >= (row + 1) / HZ - 1e-9)[0])
    return Loss(track, (row + 1) / HZ, record)


def lost_filter() -> Comparison:
    """NaN from the accelerometer at 30 s."""
    loss = lost(np.nan)
    track = loss.track
    horizontal = np.linalg.norm(track.position_m[:, :2], axis=1)
    numbers = {
        "restarts": float(track.navigation.restarts()),
        "tilt in the same pass (deg)": float(track.tilt_deg[loss.record]),
        "tilt after (deg)": float(track.tilt_deg[loss.record + 1 :].max()),
        "position at the end (m)": float(horizontal[-1]),
    }
    return Comparison(
        title="NaN at 30 s: the filter starts anew from the complementary filter",
        time_s=track.time_s,
        panels=(
            Panel("tilt error (deg)", {"estimate": track.tilt_deg}),
            Panel("horizontal position error (m)", {"estimate": horizontal}),
        ),
        result=summed_up({"NaN": [numbers]}),
        marked={"lost": (loss.lost_s, loss.lost_s + 0.2)},
    )


def disagreement() -> Comparison:
    """Aligned wrong in roll, and nothing that corrects the filter: the complementary filter finds
    gravity and says so. Upside down is as wrong as can be.
    """
    unaided = tuned(boundedMotion=False, standstillAid=False)
    wrong = {f"{angle} deg wrong": np.radians(angle) for angle in (0, 60, 170)}
    tracks = {
        name: _flight(0, 60.0, unaided, wrong_rad=np.array([roll, 0.0, 0.0]), use_gps=False)
        for name, roll in wrong.items()
    }

    def flagged(track: Track) -> NDArray[np.bool_]:
        return np.asarray((track.health & DISAGREE) != 0)

    judged: dict[str, list[Numbers]] = {
        name: [
            {
                "tilt at the end (deg)": float(track.tilt_deg[-1]),
                "flagged from (s)": float(np.append(track.time_s[flagged(track)], np.inf)[0]),
                # Of the records with more than 30 deg, from 15 s on: it takes 5 s to be sure, and
                # the complementary filter some to be right.
                "told when wrong": _part(flagged(track), track.after(15.0) & (track.tilt_deg > 30)),
                "told when right": _part(flagged(track), track.tilt_deg < 15),
            }
        ]
        for name, track in tracks.items()
    }
    first = tracks["0 deg wrong"]
    return Comparison(
        title="A filter that is wrong: the complementary filter disagrees",
        time_s=first.time_s,
        panels=(
            Panel("tilt error (deg)", {n: t.tilt_deg for n, t in tracks.items()}),
            Panel(
                "flag",
                {n: flagged(t).astype(np.float64) for n, t in tracks.items()},
                ticks={0.0: "down", 1.0: "up"},
            ),
        ),
        result=summed_up(judged),
        marked={},
    )


def _part(chosen: NDArray[np.bool_], of: NDArray[np.bool_]) -> float:
    """The part of the records `of` that are also chosen; 0 of none."""
    return float(np.mean(chosen[of])) if of.any() else 0.0
