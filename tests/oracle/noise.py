"""Noise of sensors, drawn from Philox streams."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from escort_mj.numerics.gaussian import _UNUSED, _WORDS
from escort_mj.numerics.noise import PER_BLOCK, TAG

Array = NDArray[np.float64]


def uniforms(count: int, seed: int, use: int, robot: int, step: int, block: int = 1) -> Array:
    """Return so many numbers uniform in [0, 1) of a stream, from a block on, shape (count,)."""
    generator = np.random.Philox(
        key=np.array([seed, TAG], dtype=np.uint64),
        counter=np.array([block - 1, use, robot, step], dtype=np.uint64),  # it counts before it gives
    )
    return np.asarray((generator.random_raw(count) >> _UNUSED) * 2.0**-53)


def normal(count: int, seed: int, use: int, robot: int, step: int, block: int = 1) -> Array:
    """Return so many normal numbers of a stream, from a block on, shape (count,)."""
    pairs = uniforms(-(-count // _WORDS) * _WORDS, seed, use, robot, step, block).reshape(-1, 2)
    length, angle = np.sqrt(-2.0 * np.log(pairs[:, 0] + 2.0**-54)), 2.0 * np.pi * pairs[:, 1]
    return np.stack([length * np.cos(angle), length * np.sin(angle)], axis=1).ravel()[:count]


@lru_cache(maxsize=256)  # a step may be evaluated several times
def ball_noise(seed: int, robot: int, step: int, axes: int, balls: int = 2, use: int = 0) -> Array:
    """Draws points from the unit ball, uniformly, by rejection; shape (balls, axes).

    Each (use, robot from 0, physics step) has a stream of its own: Philox4x64-10, counted from block 1, each
    of its words giving two coordinates, the lower half first. The points follow each other in the stream.
    """
    generator = np.random.Philox(
        key=np.array([seed, TAG], dtype=np.uint64),
        counter=np.array([0, use, robot, step], dtype=np.uint64),
    )
    coordinates = np.zeros(0)
    while True:
        words = generator.random_raw(PER_BLOCK // 2 << axes)  # at once: of many axes few points are inside
        halves = words.astype("<u8").view("<u4")
        coordinates = np.append(coordinates, (halves.astype(np.float64) + 0.5) * 2.0**-31 - 1.0)
        points = coordinates[: len(coordinates) // axes * axes].reshape(-1, axes)
        inside = points[(points * points).sum(axis=1) <= 1.0]
        if len(inside) >= balls:
            return inside[:balls]
