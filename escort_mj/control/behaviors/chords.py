"""Scatter on chords (paper eq. 4): each robot keeps the formation's edge length to its predecessors."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.control.parameters import Parameters
from escort_mj.kernels import inlined

Array = NDArray[np.float64]


class Chords(Parameters):
    """Spreads the robots evenly: a ring in the plane, an octahedron of six robots in space."""

    behavior: Literal["chords"] = "chords"
    gain: PositiveFloat = 0.8
    """Gain of the task's error [1/s] (paper: Lambda_2)."""
    order: tuple[int, ...] | None = None
    """Robots (from 1) in their order along the formation; null: from their initial positions."""


@inlined
def chord(
    robot: int, predecessor: int, q: Array, length: float, gain: float, direction: Array
) -> tuple[float, float]:
    """Velocity of one chord task (paper eq. 4): sigma~ = (l^2 - |x|^2) / 2, x = q_i - q_predecessor.

    Args:
        robot: Which robot, from 0.
        predecessor: The robot to keep the distance to.
        q: Measured positions, shape (n, p) [m].
        length: Edge length l to keep [m].
        gain: Lambda_2 [1/s].
        direction: Result, shape (p,): the task's Jacobian x [m].

    Returns:
        1 / |x|^2 [1/m^2], and the task's velocity in terms of x [1/s]; both 0 where x is 0.
    """
    axes = q.shape[1]
    square = 0.0
    for k in range(axes):
        direction[k] = q[robot, k] - q[predecessor, k]
        square += direction[k] * direction[k]
    if square == 0.0:
        return 0.0, 0.0
    inverse = 1.0 / square
    return inverse, gain * 0.5 * (length * length - square) * inverse
