"""Random numbers: independent, reproducible streams of standard normal values."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

_CHUNK = 4096  # one NumPy call a value would cost more than the whole sensor model


def normal_stream(seed: int, stream: int) -> Callable[[], float]:
    """A function that returns the next standard normal value.

    Streams of one seed are independent, so drawing more often from one changes no other.
    """
    generator = np.random.default_rng([seed, stream])

    def values() -> Iterator[float]:
        while True:
            yield from generator.standard_normal(_CHUNK).tolist()

    return values().__next__
