"""Directions to choose from, spread evenly: on the circle, or on the sphere by Fibonacci's spiral."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import inlined, merged, stack_memory, vector_at

Array = NDArray[np.float64]

IN_PLANE, IN_SPACE = 360, 1000
"""Directions that policies choose from: one degree apart, and about four."""
_TURN = math.pi * (3.0 - math.sqrt(5.0))  # the golden angle [rad]
_AXES = 3


@inlined
def count_of(axes: int) -> int:
    """Return the number of directions."""
    return IN_PLANE if axes == 2 else IN_SPACE


@inlined
def write_direction(k: int, direction: Array) -> None:
    """Write direction k, of unit length, shape (p,); p is 2 or 3."""
    if direction.shape[0] == 2:
        angle = 2.0 * math.pi * k / IN_PLANE
        direction[0], direction[1] = math.cos(angle), math.sin(angle)
    else:
        height, angle = 1.0 - (2.0 * k + 1.0) / IN_SPACE, _TURN * k
        across = math.sqrt(1.0 - height * height)
        direction[0], direction[1], direction[2] = across * math.cos(angle), across * math.sin(angle), height


@merged
def write_freest(here: Array, others: Array, power: float, result: Array) -> None:
    """Write the direction u with the least max_i u . d_i / |d_i|^power, see `freest`.

    Args:
        here: Shape (p,) [m].
        others: Shape (n, p) [m].
        power: 1 or 2.
        result: The direction, shape (p,).
    """
    p, least = here.shape[0], math.inf
    direction = vector_at(stack_memory(), _AXES)[:p]
    for k in range(count_of(p)):
        write_direction(k, direction)
        most = -math.inf
        for i in range(others.shape[0]):
            along = square = 0.0
            for axis in range(p):
                way = others[i, axis] - here[axis]
                along += direction[axis] * way
                square += way * way
            if square > 0.0:
                most = max(most, along / (square if power == 2.0 else math.sqrt(square)))
        if most < least:
            least = most
            for axis in range(p):
                result[axis] = direction[axis]
