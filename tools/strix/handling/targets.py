"""The table of handling numbers: measured, target, met."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from strix.flightlog import Array
from strix.handling.flights import GRID_S, Job, Kind, Measured, grid
from strix.handling.measure import spread, step_numbers

HEADINGS_DEG = (0.0, 90.0, 180.0, 270.0)
REPEATS = 2  # flights of a kind at each heading, each with a seed of its own
ATTITUDES = ("roll", "pitch", "yaw")
PLACES = ("forward", "up")
ATTITUDE_BAND = 0.1  # of the step: 3 deg of 30
# 5 cm of 1 m, as much as a hover may stray from its reference: less is not seen as an overshoot.
PLACE_BAND = 0.05


@dataclass(frozen=True)
class Line:
    """One number. Below its target it is met; without a target it is told only."""

    vehicle: str
    name: str
    measured: float
    unit: str
    target: float | None
    of: str  # what the number is taken from

    @property
    def met(self) -> bool:
        return self.target is None or self.measured < self.target


def handling_jobs(vehicle: str, seed: int, repeats: int = REPEATS) -> list[Job]:
    """What is flown for the table. Every flight with GPS noise has its own seed."""
    quiet = [
        Job(kind, vehicle, heading_deg, seed, quiet_gps=True)
        for kind in (Kind.ATTITUDE, Kind.PLACE)
        for heading_deg in HEADINGS_DEG
    ]
    kinds = (Kind.ATTITUDE, Kind.PLACE, Kind.HOVER, Kind.WIND)
    return quiet + [
        Job(kind, vehicle, heading_deg, seed + repeat * len(HEADINGS_DEG) + i)
        for kind in kinds
        # GPS's errors in a hover of a minute are few and long: it takes more of them for a mean.
        for repeat in range(4 * repeats if kind is Kind.HOVER else repeats)
        for i, heading_deg in enumerate(HEADINGS_DEG)
    ]


def table(vehicle: str, flown: Iterable[Measured], targets: bool) -> list[Line]:
    """Of one vehicle's flights. Without targets the numbers alone."""
    mine = [m for m in flown if m.job.vehicle == vehicle and m.job.kind is not Kind.ROBUST]
    noisy = [m for m in mine if not m.job.quiet_gps]
    quiet = [m for m in mine if m.job.quiet_gps]
    rows: list[tuple[str, float, str, float, str]] = [
        *_attitude_rows(noisy),
        *_hover_rows(noisy),
        *_place_rows(noisy, quiet),
        *_heading_rows(quiet),
    ]
    lines = [
        Line(vehicle, name, measured, unit, target if targets else None, of)
        for name, measured, unit, target, of in rows
    ]
    bad = sum(m.cut or m.outcome != "lands" for m in mine)
    of = f"of {len(mine)} flights"
    not_landed = float(bad) if mine else math.nan
    return [Line(vehicle, "flights that did not land", not_landed, "", 1.0, of), *lines]


def responses(flown: Iterable[Measured], name: str) -> list[Array]:
    return [found for m in flown for found in m.responses.get(name, [])]


def _largest(values: Sequence[float]) -> float:
    """NaN where one is, or where there is none."""
    return float(np.max(values)) if values else math.nan


def _attitude_rows(noisy: list[Measured]) -> list[tuple[str, float, str, float, str]]:
    rows = []
    for name in ATTITUDES:
        steps = [
            step_numbers(grid(len(r) * GRID_S), r, ATTITUDE_BAND) for r in responses(noisy, name)
        ]
        of = f"worst of {len(steps)} steps"
        settled = _largest([s.settled_s for s in steps])
        if name == "yaw":
            rows.append(("yaw 30 deg, to within 10 %", settled, "s", 1.0, of))
            continue
        rise = _largest([s.rise_s for s in steps])
        rows.append((f"{name} 30 deg, rise", rise, "s", 0.20, of))
        overshoot = _largest([100.0 * s.overshoot for s in steps])
        rows.append((f"{name} 30 deg, overshoot", overshoot, "%", 10.0, of))
    return rows


def _hover_rows(noisy: list[Measured]) -> list[tuple[str, float, str, float, str]]:
    still = [m.hover for m in noisy if m.job.kind is Kind.HOVER and m.hover is not None]
    wind = [m.hover for m in noisy if m.job.kind is Kind.WIND and m.hover is not None]

    def rms(values: list[float]) -> float:
        return math.sqrt(sum(v * v for v in values) / len(values)) if values else math.nan

    of = f"RMS of {len(still)} hovers"
    return [
        ("hover, to the estimate", rms([h.rms_to_estimate_m for h in still]), "m", 0.05, of),
        (
            "hover, to the truth, level",
            rms([h.rms_to_truth_m[0] for h in still]),
            "m",
            0.5,
            of,
        ),
        ("hover, to the truth, vertical", rms([h.rms_to_truth_m[1] for h in still]), "m", 0.15, of),
        (
            "5 m/s wind, gusts: mean offset",
            _largest([math.hypot(*h.offset_ned_m) for h in wind]),
            "m",
            0.1,
            f"worst of {len(wind)} hovers",
        ),
    ]


def _place_rows(
    noisy: list[Measured], quiet: list[Measured]
) -> list[tuple[str, float, str, float, str]]:
    """Of the mean response, as the estimate wanders by as much as an overshoot would be."""
    rows = []
    most = 100.0 * PLACE_BAND
    for name in PLACES:
        found = responses(noisy, name)
        if len(found) < 2:
            continue
        time_s = grid(len(found[0]) * GRID_S)
        mean = np.mean(found, axis=0)
        step = step_numbers(time_s, mean, PLACE_BAND)
        of = f"mean of {len(found)} steps"
        rows.append((f"1 m {name}, overshoot", 100.0 * step.overshoot, "%", most, of))
        rows.append((f"1 m {name}, settled to 5 %", step.settled_s, "s", 10.0, of))
    if calm := responses(quiet, "forward"):
        step = step_numbers(grid(len(calm[0]) * GRID_S), np.mean(calm, axis=0), PLACE_BAND)
        name, of = "1 m forward, quiet GPS", f"mean of {len(calm)} steps"
        rows.append((f"{name}: over", 100.0 * step.overshoot, "%", most, of))
        rows.append((f"{name}: settled", step.settled_s, "s", 10.0, of))
    return rows


def _heading_rows(quiet: list[Measured]) -> list[tuple[str, float, str, float, str]]:
    rows = []
    for name in (*ATTITUDES, *PLACES):
        each = [np.mean(r, axis=0) for m in quiet if (r := m.responses.get(name))]
        if len(each) < 2:
            continue
        time_s = grid(len(each[0]) * GRID_S)
        rises = np.array([step_numbers(time_s, r, ATTITUDE_BAND).rise_s for r in each])
        apart = 100.0 * float(np.max(np.ptp(each, axis=0)))
        of = f"{len(each)} headings"
        rows.append((f"{name}, four headings: rise", 100.0 * spread(rises), "%", 5.0, of))
        rows.append((f"{name}, four headings: apart", apart, "%", 5.0, of))
    return rows
