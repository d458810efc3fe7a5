"""Measurement noise from a counter-based generator: the same bits in any order, on any number of threads.

Philox4x64-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011), keyed by the seed
and counted by (block, channel, robot, step). Points are drawn uniformly from a ball by rejection, which
needs no transcendental function and so gives the same bits on every machine.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from escort_mj.kernels import inlined

Array = NDArray[np.float64]

POSITION_CHANNEL = 0
VELOCITY_CHANNEL = 1
TAG = np.uint64(0x6573636F72745F6D)  # second word of the key: "escort_m" in ASCII

_M0, _M1 = np.uint64(0xD2E7470EE14C6C93), np.uint64(0xCA5A826395121157)
_W0, _W1 = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBB67AE8584CAA73B)
_SHIFT = np.uint64(11)
_ROUNDS = 10


@intrinsic
def _high_product(context: Any, a: Any, b: Any) -> Any:
    """Upper 64 bits of the 128-bit product of two unsigned words."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        wide = ir.IntType(128)
        product = builder.mul(builder.zext(arguments[0], wide), builder.zext(arguments[1], wide))
        return builder.trunc(builder.lshr(product, wide(64)), ir.IntType(64))

    return types.uint64(types.uint64, types.uint64), generate


@inlined
def philox(seed: int, block: int, channel: int, robot: int, step: int) -> tuple[Any, Any, Any, Any]:
    """The four words of one block of the stream (channel, robot, step)."""
    c0, c1, c2, c3 = np.uint64(block), np.uint64(channel), np.uint64(robot), np.uint64(step)
    k0, k1 = np.uint64(seed), TAG
    for _ in range(_ROUNDS):
        high0, low0 = _high_product(_M0, c0), _M0 * c0
        high1, low1 = _high_product(_M1, c2), _M1 * c2
        c0, c1, c2, c3 = high1 ^ c1 ^ k0, low1, high0 ^ c3 ^ k1, low0
        k0 += _W0
        k1 += _W1
    return c0, c1, c2, c3


@inlined
def add_ball_noise(
    true: Array, measured: Array, robot: int, radius: float, seed: int, channel: int, step: int
) -> None:
    """Sets one robot's row of `measured` to the true row plus a point drawn uniformly from a ball.

    Args:
        true: True values, shape (n, p).
        measured: Result, shape (n, p).
        robot: Row.
        radius: Radius of the ball.
        seed: Key of the stream.
        channel: Which quantity is measured.
        step: Physics step.
    """
    axes = true.shape[1]
    w0: Any = np.uint64(0)
    w1: Any = np.uint64(0)
    w2: Any = np.uint64(0)
    w3: Any = np.uint64(0)
    block, used = 0, 4
    square = 2.0
    while square > 1.0:
        square = 0.0
        for k in range(axes):
            if used == 4:
                block, used = block + 1, 0
                w0, w1, w2, w3 = philox(seed, block, channel, robot, step)
            x = 2.0 * (float(w0 >> _SHIFT) * 2.0**-53) - 1.0
            w0, w1, w2 = w1, w2, w3
            used += 1
            measured[robot, k] = x
            square += x * x
    for k in range(axes):
        measured[robot, k] = true[robot, k] + radius * measured[robot, k]
