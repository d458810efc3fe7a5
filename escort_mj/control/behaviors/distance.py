"""The task that chords and surface share: keep a distance to a point (paper eqs. 4, 5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.kernels import inlined

Array = NDArray[np.float64]


@inlined
def keep_distance(
    position: Array, anchor: Array, distance: float, gain: float, direction: Array
) -> tuple[float, float]:
    """Velocity of the task sigma~ = (d^2 - |x|^2) / 2 with x = position - anchor.

    Args:
        position: Measured position of the robot, shape (p,) [m].
        anchor: What it keeps its distance to: a neighbor, or the target, shape (p,) [m].
        distance: d [m].
        gain: Lambda [1/s].
        direction: Result, shape (p,): the task's Jacobian x [m].

    Returns:
        1 / |x|^2 [1/m^2], and the task's velocity in terms of x [1/s]; both 0 where x is 0.
    """
    square = 0.0
    for k in range(position.shape[0]):
        direction[k] = position[k] - anchor[k]
        square += direction[k] * direction[k]
    if square == 0.0:
        return 0.0, 0.0
    inverse = 1.0 / square
    return inverse, gain * 0.5 * (distance * distance - square) * inverse
