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


# The same in plain NumPy.


def possible_directions(axes: int) -> Array:
    """Return all directions, shape (directions, axes)."""
    if axes == 2:
        angles = 2.0 * np.pi * np.arange(IN_PLANE) / IN_PLANE
        return np.stack([np.cos(angles), np.sin(angles)], axis=1)
    k = np.arange(IN_SPACE, dtype=float)
    height, angles = 1.0 - (2.0 * k + 1.0) / IN_SPACE, _TURN * k
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(angles), across * np.sin(angles), height], axis=1)


def freest(here: Array, others: Array, power: int) -> Array:
    """Return the direction u with the least max_i u . d_i / |d_i|^power, d_i the way to another, shape (p,).

    With the power 1 it is the middle of the largest gap between the others as seen from here. With 2, half
    the reciprocal of the largest is how far u stays within the points that are nearer to here than to any
    of the others: the longest way within the Voronoi cell.

    Args:
        here: Shape (p,) [m].
        others: Shape (n, p) [m].
        power: 1 or 2.
    """
    ways: Array = others - here
    square: Array = np.sum(ways**2, axis=1)
    ways, square = ways[square > 0.0], square[square > 0.0]
    choice: Array = possible_directions(len(here))
    if not len(ways):
        return choice[0]
    most = (choice @ (ways / (square if power == 2 else np.sqrt(square))[:, None]).T).max(axis=1)
    return choice[int(most.argmin())]
