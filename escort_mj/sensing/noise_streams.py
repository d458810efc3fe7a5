"""Measurement noise, from NumPy's own Philox generator."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NOISE_KEY = 0x6573636F72745F6D  # "escort_m": the second word of the generator's key


def ball_noise(seed: int, robot: int, step: int, axes: int, balls: int = 2, use: int = 0) -> Array:
    """Draws points from the unit ball, uniformly, by rejection; shape (balls, axes).

    Each (use, robot from 0, physics step) has a stream of its own: Philox4x64-10, counted from block 1, each
    of its words giving two coordinates, the lower half first. The points follow each other in the stream.
    """
    generator = np.random.Philox(
        key=np.array([seed, NOISE_KEY], dtype=np.uint64),
        counter=np.array([0, use, robot, step], dtype=np.uint64),
    )
    points: list[Array] = []
    waiting = np.zeros(0)
    while len(points) < balls:
        while len(waiting) < axes:
            words = generator.random_raw(4)
            halves = np.stack([words & np.uint64(2**32 - 1), words >> np.uint64(32)], axis=1).ravel()
            waiting = np.concatenate([waiting, (halves.astype(np.float64) + 0.5) * 2.0**-31 - 1.0])
        point, waiting = waiting[:axes], waiting[axes:]
        if point @ point <= 1.0:
            points.append(point)
    return np.array(points)
