"""Obstacle avoidance (paper eqs. 3, 23-24): leave the safe sphere of the obstacle that intrudes most."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat

from escort_mj.control.neighbors import candidate, number_of_candidates
from escort_mj.control.parameters import Parameters
from escort_mj.kernels import inlined

Array = NDArray[np.float64]

POLAR = 0.9  # a unit vector with more than this along the last axis hardly turns in the others


class AvoidObstacles(Parameters):
    """Keeps each robot outside the safe sphere of obstacles and of its teammates."""

    behavior: Literal["avoid_obstacles"] = "avoid_obstacles"
    safe_distance: PositiveFloat = 2.0
    """Distance to an obstacle, or to a robot that is lost, below which the behavior rules the robot [m]."""
    measure: Literal["center", "surface"] = "surface"
    """Where distances are measured: `surface` to surface, or `center` to center (the paper's points)."""
    teammates: bool = True
    """Whether a teammate that comes too near counts as an obstacle (remark 2)."""
    teammate_distance: PositiveFloat | None = None
    """Safe distance to teammates [m]; null: `safe_distance`, but at most half the formation's spacing."""
    gain: Literal["consistent", "printed"] = "consistent"
    """State-dependent gain: as eq. 23 demands (`consistent`), or with the printed coefficient (`printed`)."""
    gain_margin: NonNegativeFloat = 0.1
    """Constant added to the state-dependent gain [1/s] (paper: rho_i)."""
    sidestep: Annotated[float, Field(ge=0.0, le=10.0)] = 0.1
    """Least share of the velocity blocked by the intruder that goes sideways, around it, so that head-on
    approaches do not end before it (remark 6); 0: none, only noise can break them (the paper)."""


@inlined
def avoidance(
    robot: int,
    q: Array,
    v: Array,
    e: Array,
    lost: Array,
    neighbors: Array,
    any_lost: bool,
    obstacle_position: Array,
    obstacle_radius: Array,
    robot_radius: Array,
    row: Array,
    slope: float,
    direction: Array,
) -> tuple[float, float]:
    """Velocity of the avoidance task of one robot (paper eq. 3; gain from eqs. 23, 24).

    Args:
        robot: Which robot, from 0.
        q: Measured positions, shape (n, p) [m].
        v: Measured velocities, shape (n, p) [m/s].
        e: Tracking errors, shape (n, p) [m].
        lost: 1 for robots that have failed, which are obstacles (remark 2), shape (n,).
        neighbors: Who may be nearest to whom, see `neighbors`.
        any_lost: Whether to look for them.
        obstacle_position: Centers, shape (m, p) [m].
        obstacle_radius: Shape (m,) [m].
        robot_radius: Shape (n,) [m].
        row: The behavior's row of the ladder: see `pack`.
        slope: gamma of the sliding surface [1/s].
        direction: Result, shape (p,): the unit vector r away from what intrudes most.

    Returns:
        The task's error sigma~, how deep the worst intruder is in the safe sphere [m], and the task's speed
        lambda sigma~ along `direction` [m/s]; both 0 where nothing intrudes and the task is inactive.
    """
    axes = q.shape[1]
    safe, teammate_safe, margin = row[1], row[2], row[3]
    to_surface, printed = row[4], row[5] != 0.0
    worst, distance = 0.0, 0.0
    intruder = -1  # obstacles first, then robots
    for j in range(obstacle_position.shape[0]):
        square = 0.0
        for k in range(axes):
            x = q[robot, k] - obstacle_position[j, k]
            square += x * x
        reach = safe + to_surface * (robot_radius[robot] + obstacle_radius[j])
        if square < reach * reach:
            length = math.sqrt(square)
            if reach - length > worst:
                worst, distance, intruder = reach - length, length, j
    if teammate_safe > 0.0:
        for c in range(number_of_candidates(robot, q.shape[0], neighbors)):
            j = candidate(robot, c, neighbors)
            square = 0.0
            for k in range(axes):
                x = q[robot, k] - q[j, k]
                square += x * x
            reach = teammate_safe + to_surface * (robot_radius[robot] + robot_radius[j])
            if square < reach * reach and j != robot:
                length = math.sqrt(square)
                if reach - length > worst:
                    worst, distance, intruder = reach - length, length, obstacle_position.shape[0] + j
    if any_lost:
        for j in range(q.shape[0]):
            if lost[j] == 0.0:
                continue
            square = 0.0
            for k in range(axes):
                x = q[robot, k] - q[j, k]
                square += x * x
            reach = safe + to_surface * (robot_radius[robot] + robot_radius[j])
            length = math.sqrt(square)
            if reach - length > worst and j != robot:
                worst, distance, intruder = reach - length, length, obstacle_position.shape[0] + j
    if intruder < 0:
        return 0.0, 0.0

    other = intruder - obstacle_position.shape[0]
    v_square = e_square = 0.0
    for k in range(axes):
        center = obstacle_position[intruder, k] if other < 0 else q[other, k]
        if distance > 0.0:
            direction[k] = (q[robot, k] - center) / distance
        else:  # no direction leads away from one's own place: take the first axis
            direction[k] = 1.0 if k == 0 else 0.0
        v_square += v[robot, k] * v[robot, k]
        e_square += e[robot, k] * e[robot, k]
    speed, error = math.sqrt(v_square), slope * math.sqrt(e_square)
    if printed:
        # (b + sqrt(b^2 + 4ac)) / 2a with the printed b, multiplied out so that nothing cancels
        pull = speed - 2.0 * error + math.sqrt(max(error * (5.0 * error - 2.0 * speed), 0.0))
    else:
        pull = speed + (math.sqrt(2.0) - 1.0) * error
    return worst, pull + margin * worst


@inlined
def sidestep(
    level: int, levels: int, share: float, direction: Array, feedforward: Array, parts: Array
) -> None:
    """Adds to avoidance a part along the safe sphere, where the wishes below it are blocked head-on.

    What they leave along the sphere, w, is filled up to a share of what avoidance blocks of them. All robots
    turn the same way around whatever they meet (counterclockwise in the plane), so that two that meet head-on
    pass each other. Along `direction` nothing changes: J1 v_d stays lambda sigma~.

    Args:
        level: Row of avoidance in `parts`.
        levels: Number of rows that hold parts.
        share: Share of the blocked speed.
        direction: Unit vector r away from the intruder, shape (p,).
        feedforward: The target's velocity, as far as it is left, shape (p,) [m/s].
        parts: Parts by level, shape (>= levels, p) [m/s]; the row of avoidance is changed.
    """
    p = direction.shape[0]
    outward = square = 0.0
    for k in range(p):
        wanted = feedforward[k]
        for lower in range(level + 1, levels):
            wanted += parts[lower, k]
        outward += wanted * direction[k]
        square += wanted * wanted
    speed = -share * outward - math.sqrt(max(square - outward * outward, 0.0))
    if speed <= 0.0:
        return
    # Axes are turned in pairs; where p is odd one axis has no partner: not the one that r points along.
    first = 1 if p % 2 == 1 and abs(direction[p - 1]) > POLAR else 0
    for k in range(first, first + p - p % 2, 2):
        parts[level, k] -= speed * direction[k + 1]
        parts[level, k + 1] += speed * direction[k]
