"""Normal random numbers from the counter-based streams of `noise`: the method of Box and Muller (1958)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import inlined
from escort_mj.numerics.noise import philox

Array = NDArray[np.float64]

SIGHT, RADIO, START, POLICY, LIDAR, DISTURBANCE, SENSOR = range(4, 11)
"""Uses of streams, after those of `noise`."""
_UNUSED = np.uint64(11)  # bits of a word beyond what a double holds
_WORDS = 4  # of a block


@inlined
def fraction(word: np.uint64) -> float:
    """Return a number uniform in [0, 1) from a word."""
    return float(np.int64(word >> _UNUSED)) * 2.0**-53


@inlined
def fractions(seed: int, block: int, use: int, robot: int, step: int) -> tuple[float, float, float, float]:
    """Return the four numbers uniform in [0, 1) of a block of a stream.

    Args:
        seed: Key of the streams.
        block: From 1.
        use: What the stream is for.
        robot: Whose stream it is, from 0.
        step: Physics step, or number of a draw.
    """
    w0, w1, w2, w3 = philox(seed, block, use, robot, step)
    return fraction(w0), fraction(w1), fraction(w2), fraction(w3)


@inlined
def normals(count: int, seed: int, block: int, use: int, robot: int, step: int, result: Array) -> None:
    """Write so many normal numbers of mean 0 and variance 1 from a block of a stream on, see `fractions`."""
    second = third = fourth = 0.0
    for k in range(count):
        if k % _WORDS == 0:
            a, b, c, d = fractions(seed, block + k // _WORDS, use, robot, step)
            first, second = _pair(a, b)
            third, fourth = _pair(c, d)
            result[k] = first
        elif k % _WORDS == 1:
            result[k] = second
        else:
            result[k] = third if k % _WORDS == 2 else fourth


@inlined
def _pair(a: float, b: float) -> tuple[float, float]:
    """Return two normal numbers from two uniform ones; half a step keeps the logarithm finite."""
    length, angle = math.sqrt(-2.0 * math.log(a + 2.0**-54)), 2.0 * math.pi * b
    return length * math.cos(angle), length * math.sin(angle)
