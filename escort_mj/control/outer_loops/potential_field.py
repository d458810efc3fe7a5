"""Artificial potential fields (Khatib 1986): everything that a robot wants, added up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.behaviors import AvoidObstacles
from escort_mj.components.parameters import Parameters
from escort_mj.control.outer_loops.nearby import bearing, bodies_nearby, reach_of
from escort_mj.native.kernels import inlined

if TYPE_CHECKING:
    from escort_mj.control.setup import Setup

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class PotentialField(Parameters):
    """Behaviors without priorities: v_d is the sum of what each of them wants by itself.

    In place of the avoidance task every obstacle and teammate nearer than the safe distance d_0 of
    avoid_obstacles repels with gain * (1/d - 1/d_0) / d^2, d measured as that behavior says. What pulls and
    what pushes may cancel: such fields have local minima, and nothing guarantees a distance.
    """

    loop: Literal["potential_field"] = "potential_field"
    gain: PositiveFloat = 0.3
    """Gain of the repulsion [m^4/s]."""
    least_distance: PositiveFloat = 0.2
    """Distance below which the repulsion grows no further [m]."""


@inlined
def repulsion(
    robot: int,
    q: Array,
    lost: Array,
    obstacle_position: Array,
    obstacle_radius: Array,
    robot_radius: Array,
    avoid: Any,
    gain: float,
    least_distance: float,
    direction: Array,
    total: Array,
) -> bool:
    """Adds to a velocity what obstacles and teammates add to it (Khatib 1986, eq. 16).

    Args:
        robot: Which robot, from 0.
        q: Measured positions, shape (n, p) [m].
        lost: 1 for robots that have failed, shape (n,).
        obstacle_position: Centers, shape (m, p) [m].
        obstacle_radius: Shape (m,) [m].
        robot_radius: Shape (n,) [m].
        avoid: Parameters of avoid_obstacles.
        gain: Of the repulsion [m^4/s].
        least_distance: Below which it grows no further [m].
        direction: Scratch, shape (p,).
        total: The velocity, shape (p,) [m/s]; changed in place.

    Returns:
        Whether anything repels.
    """
    repelled = False
    for other in range(obstacle_radius.shape[0] + robot_radius.shape[0]):
        reach, bodies = reach_of(robot, other, lost, obstacle_radius, robot_radius, avoid)
        if reach == 0.0:
            continue
        apart = bearing(robot, other, q, obstacle_position, direction)
        if apart >= reach:
            continue
        repelled = True
        distance, safe = max(apart - bodies, least_distance), reach - bodies
        speed = gain * max(1.0 / distance - 1.0 / safe, 0.0) / (distance * distance)
        for k in range(total.shape[0]):
            total[k] += speed * direction[k]
    return repelled


# The same in plain NumPy.


def repulsions(
    field: PotentialField, avoid: AvoidObstacles, q: Array, setup: Setup, lost: Mask
) -> tuple[Array, Mask]:
    """What obstacles and teammates add to each robot's velocity, shape (n, p) [m/s], and to whose, (n,)."""
    away, distance, safe = bodies_nearby(avoid, q, setup, lost)
    near = (distance < safe) & (safe > 0.0)
    d = np.maximum(distance, field.least_distance)
    with np.errstate(divide="ignore"):
        speed = np.where(near, field.gain * np.maximum(1.0 / d - 1.0 / safe, 0.0) / d**2, 0.0)
    return np.einsum("ij,ijk->ik", speed, away), np.asarray(near.any(axis=1))
