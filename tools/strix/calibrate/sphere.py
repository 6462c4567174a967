"""The sphere of directions in equal parts: which were seen, and each counting the same."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strix.calibrate.outcome import unit
from strix.flightlog import Array

CELLS = 80  # 25 deg across each


def cell_of(vectors: Array) -> NDArray[np.int_]:
    """Which of CELLS equal parts of the sphere each vector points into."""
    return np.asarray(np.argmax(unit(vectors) @ cell_centres().T, axis=1))


def cell_centres() -> Array:
    """Fibonacci's lattice: each stands for an equal part of the sphere."""
    i = np.arange(CELLS) + 0.5
    z = 1.0 - 2.0 * i / CELLS
    angle = np.pi * (1.0 + np.sqrt(5.0)) * i
    r = np.sqrt(1.0 - z**2)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])


def coverage(cells: NDArray[np.int_]) -> float:
    """Part of the sphere that was seen."""
    return len(np.unique(cells)) / CELLS


def unseen(cells: NDArray[np.int_]) -> list[Array]:
    """Directions of the parts that were not."""
    seen = set(cells.tolist())
    return [way for number, way in enumerate(cell_centres()) if number not in seen]


def even_weights(cells: NDArray[np.int_]) -> Array:
    """Each direction counts the same, however long the aircraft lay in it."""
    return 1.0 / np.bincount(cells, minlength=CELLS)[cells]


def weighted_median(values: Array, weight: Array) -> float:
    """With half of the weight on either side."""
    order = np.argsort(values)
    sums = np.cumsum(weight[order])
    return float(values[order[np.searchsorted(sums, 0.5 * sums[-1])]])


def advice(holes: list[Array]) -> str:
    """Where the hole is, in words: the largest sum of directions that were not seen."""
    if not holes:
        return "turn it every way, slowly"
    hole = np.sum(holes, axis=0)
    size = float(np.linalg.norm(hole))
    if size < 0.3 * len(holes):  # holes on opposite sides
        hole = max(holes, key=lambda one: sum(float(one @ other) > 0.7 for other in holes))
        size = 1.0
    parts = [
        f"{'+' if hole[i] > 0.0 else '-'}{'xyz'[i]}"
        for i in np.argsort(-np.abs(hole))
        if abs(hole[i]) > 0.4 * size
    ]
    return (
        f"the field never came from the sensor's {' '.join(parts)} side: point that side along "
        "the field (north and, in the northern hemisphere, steeply down) and turn slowly about it"
    )
