"""One option off and on, in the same simulated flights: numbers to test, curves to draw."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from strix.options.flights import Array, Track

Numbers = dict[str, float]


@dataclass(frozen=True)
class Panel:
    """One quantity over time, a curve a variant."""

    quantity: str  # with its unit
    curves: dict[str, Array]
    logarithmic: bool = False
    dashed: bool = False  # the second half of the curves: bounds of the first
    ticks: Mapping[float, str] = field(default_factory=dict)  # instead of numbers


@dataclass(frozen=True)
class Result:
    """Numbers of each variant: their mean over the seeds, and the largest."""

    mean: dict[str, Numbers]
    worst: dict[str, Numbers]


@dataclass(frozen=True)
class Comparison:
    """One figure and the numbers beside it; the curves are those of the first seed."""

    title: str
    time_s: Array
    panels: tuple[Panel, ...]
    result: Result
    marked: Mapping[str, tuple[float, float]]  # what happens: from, to (s)
    drawn_from_s: float = 0.0

    def table(self) -> str:
        """A line a variant and number."""
        lines = [self.title]
        for variant, numbers in self.result.mean.items():
            for name, mean in numbers.items():
                worst = self.result.worst[variant][name]
                lines.append(f"  {variant:<28}{name:<34}{mean:11.4g}{worst:11.4g}")
        return "\n".join(lines)


def compare(
    variants: Iterable[str],
    seeds: range,
    run: Callable[[str, int], Track],
    judge: Callable[[Track], Numbers],
) -> tuple[dict[str, Track], Result]:
    """Tracks of the first seed, and the numbers of all."""
    first: dict[str, Track] = {}
    judged: dict[str, list[Numbers]] = {}
    for variant in variants:
        tracks = [run(variant, seed) for seed in seeds]
        first[variant] = tracks[0]
        judged[variant] = [judge(track) for track in tracks]
    return first, summed_up(judged)


def summed_up(judged: Mapping[str, list[Numbers]]) -> Result:
    """Mean and largest of each number; a list entry a seed."""

    def over(function: Callable[[list[float]], np.floating[Any]]) -> dict[str, Numbers]:
        return {
            variant: {name: float(function([one[name] for one in runs])) for name in runs[0]}
            for variant, runs in judged.items()
        }

    return Result(mean=over(np.mean), worst=over(np.max))


def curves(tracks: Mapping[str, Track], quantity: Callable[[Track], Array]) -> dict[str, Array]:
    """One quantity of each track."""
    return {variant: quantity(track) for variant, track in tracks.items()}
