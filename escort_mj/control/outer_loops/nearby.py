"""What the baselines avoid: obstacles and teammates, with the distances of the avoid_obstacles behavior."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors.avoid_obstacles import POLAR
from escort_mj.behaviors.behavior import Avoidance
from escort_mj.native.kernels import inlined
from escort_mj.numerics.vectors import make_unit

if TYPE_CHECKING:
    pass

Array = NDArray[np.float64]


@inlined
def reach_of(
    robot: int, other: int, lost: Array, obstacle_radius: Array, robot_radius: Array, avoid: Avoidance
) -> tuple[float, float]:
    """How near another body may come to a robot, and what part of it is bodies.

    Args:
        robot: Which robot, from 0.
        other: Which body: obstacles first, then robots.
        lost: 1 for robots that have failed, which are obstacles (remark 2), shape (n,).
        obstacle_radius: Shape (m,) [m].
        robot_radius: Shape (n,) [m].
        avoid: What distances are kept.

    Returns:
        Least distance of the centers, 0 for what is not avoided, and the part of it that does not count as
        distance between the two [m].
    """
    obstacles = obstacle_radius.shape[0]
    mate = other - obstacles
    safe, radius = avoid.safe_distance, 0.0
    if mate < 0:
        radius = obstacle_radius[other]
    else:
        radius = robot_radius[mate]
        safe = avoid.teammate_distance
        if lost[mate] != 0.0:
            safe = max(safe, avoid.safe_distance)
        if mate == robot:
            safe = 0.0
    bodies = avoid.to_surface * (robot_radius[robot] + radius)
    return (safe + bodies if safe > 0.0 else 0.0), bodies


@inlined
def in_sight(
    robot: int, other: int, apart: float, obstacle_radius: Array, robot_radius: Array,
    sensing_robots: float, sensing_obstacles: float,
) -> bool:  # fmt: skip
    """Whether a robot sees another body.

    Args:
        robot: Which robot, from 0.
        other: Which body: obstacles first, then robots.
        apart: Distance of their centers [m].
        obstacle_radius: Shape (m,) [m].
        robot_radius: Shape (n,) [m].
        sensing_robots: How far robots see each other, surface to surface [m].
        sensing_obstacles: How far robots see obstacles, likewise [m].
    """
    mate = other - obstacle_radius.shape[0]
    radius = obstacle_radius[other] if mate < 0 else robot_radius[mate]
    return apart - robot_radius[robot] - radius <= (sensing_obstacles if mate < 0 else sensing_robots)


@inlined
def bearing(robot: int, other: int, q: Array, obstacle_position: Array, direction: Array) -> float:
    """Distance of a robot from another body's center [m], and the unit vector that leads away from it.

    Args:
        robot: Which robot, from 0.
        other: Which body: obstacles first, then robots.
        q: Measured positions, shape (n, p) [m].
        obstacle_position: Centers, shape (m, p) [m].
        direction: Result, shape (p,); the first axis where both are in one place.
    """
    mate = other - obstacle_position.shape[0]
    for k in range(q.shape[1]):
        direction[k] = q[robot, k] - (obstacle_position[other, k] if mate < 0 else q[mate, k])
    return make_unit(direction)


@inlined
def turn(r: Array, tangent: Array) -> None:
    """Write the unit vector counterclockwise across another, in pairs of axes as `sidestep` turns them."""
    p, length = tangent.shape[0], 0.0
    for k in range(p):
        length += r[k] * r[k]
    first = 1 if p % 2 == 1 and abs(r[p - 1]) > POLAR * math.sqrt(length) else 0
    square = 0.0
    for k in range(p):
        tangent[k] = 0.0
    for k in range(first, first + p - p % 2, 2):
        tangent[k], tangent[k + 1] = -r[k + 1], r[k]
        square += tangent[k] * tangent[k] + tangent[k + 1] * tangent[k + 1]
    for k in range(p):
        tangent[k] /= math.sqrt(square)
