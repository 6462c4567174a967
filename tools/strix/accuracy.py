"""How well the navigation does on recordings of real sensors, beside VQF.

Every filter has one set of defaults for all recordings; only a place's declination and the ages of
an autopilot's readings are told.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from strix import vqf_baseline
from strix._core import NavigationConfig, TiltFusion
from strix.estimate import Estimate, estimate, local_ned
from strix.recording import (
    FIX,
    FIX_3D,
    PLACE,
    Array,
    Recording,
    find_table,
    read_recording,
)
from strix.score import Score, read_reference, score

# Makes the tuning of one way to run the navigation.
Policy = Callable[[], NavigationConfig]
# A filter of others: recording and declination in rad to t_s, qw, qx, qy, qz.
Baseline = Callable[[Recording, float], Array]

BROAD = "broad_"  # how the names of the benchmark's trials begin
PUBLIC_TRIALS = ("02", "04", "07", "09", "11", "15", "21", "24", "29", "34")

OUTAGE_S = 10.0
OUTAGE_EVERY_S = 30.0  # in one run: 20 s of GPS in between bring the filter back


@dataclass(frozen=True)
class Source:
    """A recording and what has to be known of it."""

    name: str
    declination_deg: float = 0.0
    delays_s: Mapping[str, float] = field(default_factory=dict)
    after_s: float = 0.0  # scored from here on

    @property
    def declination_rad(self) -> float:
        """Magnetic north from true north, positive east."""
        return math.radians(self.declination_deg)


# Flown near Melbourne. Their autopilot stamped readings when it logged them; its own attitude, the
# reference, needs half a minute to settle.
_QUAD_DELAYS_S = {"gps": 0.22, "baro": 0.35, "mag": 0.03}
KNOWN = (
    *(Source(BROAD + trial) for trial in PUBLIC_TRIALS),
    Source("px4_hover"),
    Source("quad123", 11.7, _QUAD_DELAYS_S, after_s=30.0),
    Source("quad_optflow", 11.7, _QUAD_DELAYS_S, after_s=30.0),
)


@dataclass(frozen=True)
class GpsResult:
    """Against GPS, each number over all its scalars."""

    position_rms_m: float  # innovations, north and east
    velocity_rms_m_s: float
    outage_median_m: float | None  # horizontal error at the end of OUTAGE_S without fixes
    outages: int


@dataclass(frozen=True)
class Result:
    """One filter on one recording."""

    recording: str
    filter: str
    score: Score
    gps: GpsResult | None  # None: no GPS, or a filter that takes none


@dataclass(frozen=True)
class Target:
    """What issue 3 asks of the defaults, and what they reach."""

    what: str
    limit: float
    unit: str
    found: float

    @property
    def met(self) -> bool:
        """False for NaN too."""
        return self.found <= self.limit


@dataclass(frozen=True)
class Accuracy:
    """All results, and which known recordings were not there."""

    results: list[Result]
    skipped: list[str]

    def of(self, recording: str, filter_: str) -> Result | None:
        """One result; None when the recording was not there."""
        found = (r for r in self.results if (r.recording, r.filter) == (recording, filter_))
        return next(found, None)

    def filters(self) -> list[str]:
        """In the order they ran."""
        return list(dict.fromkeys(result.filter for result in self.results))

    def broad_mean(self, filter_: str) -> tuple[float, float] | None:
        """Total and inclination in deg, mean over the trials; None without any."""
        scores = [
            r.score for r in self.results if r.recording.startswith(BROAD) and r.filter == filter_
        ]
        if not scores:
            return None
        return (
            float(np.mean([s.total_deg for s in scores])),
            float(np.mean([s.inclination_deg for s in scores])),
        )

    def targets(self) -> list[Target]:
        """Those of issue 3 for the recordings that were there."""
        return list(_targets(self))

    def to_dict(self) -> dict[str, object]:
        """As in accuracy.json."""
        means = [(name, self.broad_mean(name)) for name in self.filters()]
        return {
            "results": [asdict(result) for result in self.results],
            "broad_mean": [
                {"filter": name, "total_deg": mean[0], "inclination_deg": mean[1]}
                for name, mean in means
                if mean is not None
            ],
            "targets": [{**asdict(target), "met": target.met} for target in self.targets()],
            "skipped": self.skipped,
        }


def defaults() -> NavigationConfig:
    """What flies."""
    return NavigationConfig()


def published_tilt() -> NavigationConfig:
    """The published design: gravity's direction while the specific force is nearly g long, and
    nothing assumed of the motion.
    """
    config = NavigationConfig()
    config.tiltFusion = TiltFusion.Gated
    config.boundedMotion = False
    return config


DEFAULTS = "bounded motion"
POLICIES: dict[str, Policy] = {
    DEFAULTS: defaults,
    "tilt gate": published_tilt,
}
BASELINES: dict[str, Baseline] = {
    "VQF": vqf_baseline.real_time,
    "VQF offline": vqf_baseline.offline,
}


def sources(data: Path) -> list[Source]:
    """The known recordings, then any other in the folder, for which nothing is told."""
    known = {source.name for source in KNOWN}
    others = sorted(
        path.name
        for path in (data.iterdir() if data.is_dir() else ())
        if path.name not in known and path.is_dir() and find_table(path, "ref_att") is not None
    )
    return [*KNOWN, *(Source(name) for name in others)]


def measure(
    data: Path,
    wanted: Sequence[Source],
    policies: Mapping[str, Policy] = POLICIES,
    baselines: Mapping[str, Baseline] = BASELINES,
    progress: Callable[[str], None] = lambda _: None,
) -> Accuracy:
    """Run every filter on every recording that is there.

    @param progress: called with the name of each recording before it is run
    """
    results: list[Result] = []
    skipped: list[str] = []
    for source in wanted:
        progress(source.name)
        folder = data / source.name
        if not folder.is_dir():
            skipped.append(source.name)
            continue
        recording = read_recording(folder)
        reference = read_reference(find_table(folder, "ref_att") or folder / "ref_att.csv")
        for name, policy in policies.items():
            table = _estimate(recording, source, policy()).table
            gps = against_gps(recording, source, policy) if len(recording.gps) else None
            results.append(Result(source.name, name, score(table, reference, source.after_s), gps))
        for name, baseline in baselines.items():
            table = baseline(recording, source.declination_rad)
            found = score(table, reference, source.after_s)
            results.append(Result(source.name, name, found, None))
    return Accuracy(results, skipped)


def write_json(path: Path, accuracy: Accuracy) -> None:
    """Write accuracy.json."""
    path.write_text(json.dumps(accuracy.to_dict(), indent=2) + "\n", encoding="utf-8")


def _estimate(recording: Recording, source: Source, config: NavigationConfig) -> Estimate:
    return estimate(recording, source.declination_rad, source.delays_s, config)


def against_gps(recording: Recording, source: Source, policy: Policy) -> GpsResult | None:
    """Compare with GPS from source.after_s on; None without fixes."""
    result = _estimate(recording, source, policy())
    innovations = result.gps_innovations
    innovations = innovations[innovations[:, 0] >= result.table[0, 0] + source.after_s, 1:]
    if not len(innovations):
        return None
    errors = outage_errors(recording, source, policy)
    return GpsResult(
        position_rms_m=float(np.sqrt(np.mean(innovations[:, :2] ** 2))),
        velocity_rms_m_s=float(np.sqrt(np.mean(innovations[:, 2:] ** 2))),
        outage_median_m=float(np.median(errors)) if len(errors) else None,
        outages=len(errors),
    )


def outage_errors(recording: Recording, source: Source, policy: Policy = defaults) -> Array:
    """Horizontal distance, m, between estimate and GPS at the end of each outage. Over the runs
    every moment of the flight lies in one outage.
    """
    errors: list[float] = []
    fixes = recording.gps[recording.gps[:, FIX] >= FIX_3D]
    delay_s = source.delays_s.get("gps", 0.0)
    for offset_s in np.arange(0.0, OUTAGE_EVERY_S, OUTAGE_S):
        begin_s = recording.imu[0, 0] + source.after_s + offset_s
        phase_s = np.mod(fixes[:, 0] - begin_s, OUTAGE_EVERY_S)
        lost = (fixes[:, 0] >= begin_s) & (phase_s < OUTAGE_S)
        end = ~lost & np.append(False, lost[:-1])  # compared with, so not used either
        result = _estimate(replace(recording, gps=fixes[~lost & ~end]), source, policy())
        there = local_ned(fixes[end][:, PLACE], result.start.place)
        t_s, north, east = (result.table[:, column] for column in (0, 5, 6))
        at_s = fixes[end, 0] - delay_s  # when it was there
        errors += np.hypot(
            np.interp(at_s, t_s, north) - there[:, 0], np.interp(at_s, t_s, east) - there[:, 1]
        ).tolist()
    return np.array(errors)


def _targets(accuracy: Accuracy) -> Iterator[Target]:
    mean = accuracy.broad_mean(DEFAULTS)
    if mean is not None:
        yield Target("BROAD, mean total", 2.0, "deg", mean[0])
        yield Target("BROAD, mean inclination", 0.8, "deg", mean[1])
    hover = accuracy.of("px4_hover", DEFAULTS)
    if hover is not None:
        yield Target("px4_hover, roll", 1.5, "deg", hover.score.roll_deg)
        yield Target("px4_hover, pitch", 1.5, "deg", hover.score.pitch_deg)
    for name in ("quad123", "quad_optflow"):
        flight = accuracy.of(name, DEFAULTS)
        if flight is None:
            continue
        yield Target(f"{name}, roll", 1.0, "deg", flight.score.roll_deg)
        yield Target(f"{name}, pitch", 1.0, "deg", flight.score.pitch_deg)
        yield Target(f"{name}, heading", 3.0, "deg", flight.score.heading_deg)
        if flight.gps is not None:
            yield Target(f"{name}, GPS position", 0.65, "m", flight.gps.position_rms_m)
            yield Target(f"{name}, GPS velocity", 0.13, "m/s", flight.gps.velocity_rms_m_s)
            if flight.gps.outage_median_m is not None:
                yield Target(f"{name}, 10 s without GPS", 3.0, "m", flight.gps.outage_median_m)
