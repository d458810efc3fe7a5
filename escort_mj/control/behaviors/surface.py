"""Stay on the circle or sphere around the target (paper eq. 5)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.control.parameters import Parameters
from escort_mj.kernels import inlined

Array = NDArray[np.float64]


class Surface(Parameters):
    """Brings each robot to the mission's radius from the target."""

    behavior: Literal["surface"] = "surface"
    gain: PositiveFloat = 0.8
    """Gain of the task's error [1/s] (paper: Lambda_3)."""


@inlined
def surface(
    robot: int, q: Array, center: Array, radius: float, gain: float, direction: Array
) -> tuple[float, float]:
    """Velocity of the surface task (paper eq. 5): sigma~ = (R^2 - |x|^2) / 2, x = q_i - c.

    Args:
        robot: Which robot, from 0.
        q: Measured positions, shape (n, p) [m].
        center: Position c of the target, shape (p,) [m].
        radius: Distance R to keep [m].
        gain: Lambda_3 [1/s].
        direction: Result, shape (p,): the task's Jacobian x [m].

    Returns:
        1 / |x|^2 [1/m^2], and the task's velocity in terms of x [1/s]; both 0 where x is 0.
    """
    axes = q.shape[1]
    square = 0.0
    for k in range(axes):
        direction[k] = q[robot, k] - center[k]
        square += direction[k] * direction[k]
    if square == 0.0:
        return 0.0, 0.0
    inverse = 1.0 / square
    return inverse, gain * 0.5 * (radius * radius - square) * inverse
