"""Spread by repulsion (Coulomb, as in the Thomson problem of remark 1), seen from the target."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.control.nsb import UNLIMITED
from escort_mj.control.parameters import Parameters
from escort_mj.kernels import inlined, stack_memory, vector_at

Array = NDArray[np.float64]

SAME = 1e-24  # squared distance of two directions that differ by rounding only: neither way leads apart


class Repulsion(Parameters):
    """Spreads the robots evenly without a plan: the others' directions from the target repel each one."""

    behavior: Literal["repulsion"] = "repulsion"
    gain: PositiveFloat = 0.8
    """Gain of the repulsion [1/s]; no robot is pushed faster than gain times radius."""


@inlined
def repel(
    robot: int,
    q: Array,
    center: Array,
    lost: Array,
    robot_radius: Array,
    sensing_radius: float,
    radius: float,
    gain: float,
    direction: Array,
    part: Array,
) -> float:
    """Velocity down the Coulomb energy of the directions from the target, along the sphere.

    Args:
        robot: Which robot, from 0.
        q: Measured positions, shape (n, p) [m].
        center: Position of the target, shape (p,) [m].
        lost: 1 for robots that do not count, shape (n,).
        robot_radius: Shape (n,) [m].
        sensing_radius: How far the robot sees the others, surface to surface [m]; beyond they do not count.
        radius: Distance to keep from the target [m].
        gain: Gain [1/s].
        direction: Result, shape (p,): x = q_i - c, which the task leaves to lower priorities.
        part: Result, shape (p,): the tangential velocity [m/s].

    Returns:
        1 / |x|^2 [1/m^2]; 0 where x is 0.
    """
    n, p = q.shape
    other = vector_at(stack_memory(), p)
    square = 0.0
    for k in range(p):
        direction[k] = q[robot, k] - center[k]
        square += direction[k] * direction[k]
        part[k] = 0.0
    if square == 0.0:
        return 0.0
    weight = 1.0 / square
    inverse, team = math.sqrt(weight), 0.0
    for j in range(n):
        if lost[j] != 0.0:
            continue
        if sensing_radius < UNLIMITED and j != robot:
            apart = 0.0
            for k in range(p):
                apart += (q[robot, k] - q[j, k]) ** 2
            if math.sqrt(apart) - robot_radius[robot] - robot_radius[j] > sensing_radius:
                continue
        team += 1.0
        away = 0.0
        for k in range(p):
            other[k] = q[j, k] - center[k]
            away += other[k] * other[k]
        if j == robot or away == 0.0:
            continue
        scale = 1.0 / math.sqrt(away)
        apart = 0.0
        for k in range(p):
            other[k] = direction[k] * inverse - other[k] * scale
            apart += other[k] * other[k]
        if apart > SAME:
            push = 1.0 / (apart * math.sqrt(apart))
            for k in range(p):
                part[k] += push * other[k]
    along = 0.0
    for k in range(p):
        along += part[k] * direction[k]
    along *= weight
    speed = 0.0
    for k in range(p):
        part[k] = (part[k] - along * direction[k]) / team
        speed += part[k] * part[k]
    scale = gain * radius / max(math.sqrt(speed), 1.0)
    for k in range(p):
        part[k] *= scale
    return weight
