"""Null-space-based composition of behaviors (paper eq. 2), robot by robot, and the speed limit.

Every task of a robot has a Jacobian of one row x, so its pseudoinverse is x / |x|^2 and its null-space
projector I - x x^T / |x|^2: the composition needs dot products only. Chords in space has several
such rows (cycles) and sums over them: w' = sum_c [v_c + N_c w].

The part of each behavior is kept apart (`parts`, one row per level of the ladder), already projected by
everything of higher priority, so that the speed limit can be spent by priority.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.kernels import inlined

Array = NDArray[np.float64]

ROUNDING = 1e-12
UNLIMITED = 1e300  # stands for an infinite limit, which XML cannot hold
INACTIVE, TANGENT = 0, -1  # ranks of a task that asks for nothing, and of one that takes all directions but x


@inlined
def combine(cycles: int, directions: Array, speeds: Array, part: Array) -> None:
    """Velocity of a task: part <- sum_c speed_c x_c.

    Args:
        cycles: Number of the task's directions.
        directions: Jacobians x, shape (>= cycles, p).
        speeds: Task velocities in terms of x, shape (>= cycles,).
        part: Result, shape (p,) [m/s].
    """
    for k in range(part.shape[0]):
        total = 0.0
        for c in range(cycles):
            total += speeds[c] * directions[c, k]
        part[k] = total


@inlined
def leave(rank: int, directions: Array, weights: Array, part: Array) -> None:
    """Projects a lower part into the null space of a task, in place.

    Args:
        rank: Number of the task's directions, or `TANGENT`.
        directions: Jacobians x, shape (>= cycles, p).
        weights: 1 / |x|^2, shape (>= cycles,).
        part: Part of a lower priority, shape (p,) [m/s].
    """
    if rank == TANGENT:
        keep_along(directions[0], weights[0], part)
    else:
        project(rank, directions, weights, part)


@inlined
def project(cycles: int, directions: Array, weights: Array, part: Array) -> None:
    """Does part <- sum_c (I - x_c x_c^T / |x_c|^2) part, in place; shape (p,)."""
    axes = part.shape[0]
    removed0 = removed1 = 0.0
    for k in range(axes):
        removed0 += directions[0, k] * part[k]
    removed0 *= weights[0]
    if cycles == 2:
        for k in range(axes):
            removed1 += directions[1, k] * part[k]
        removed1 *= weights[1]
        for k in range(axes):
            part[k] = 2.0 * part[k] - directions[0, k] * removed0 - directions[1, k] * removed1
    else:
        for k in range(axes):
            part[k] -= directions[0, k] * removed0


@inlined
def keep_along(direction: Array, weight: float, part: Array) -> None:
    """Does part <- (x x^T / |x|^2) part, in place: what a task that fills the tangent space leaves."""
    axes = part.shape[0]
    along = 0.0
    for k in range(axes):
        along += direction[k] * part[k]
    along *= weight
    for k in range(axes):
        part[k] = along * direction[k]


@inlined
def add_within_limit(total: Array, part: Array, max_speed: float) -> None:
    """Adds as much of a part as the speed limit leaves: total + alpha part, alpha in [0, 1] at its largest.

    Args:
        total: Velocity spent by higher priorities, shape (p,) [m/s]; changed in place.
        part: Velocity wanted by this priority, shape (p,) [m/s].
        max_speed: Limit [m/s]; `UNLIMITED` for none.
    """
    axes = total.shape[0]
    alpha = 1.0
    if max_speed < UNLIMITED:
        a = b = c = 0.0
        for k in range(axes):
            a += part[k] * part[k]
            b += part[k] * total[k]
            c += total[k] * total[k]
        room = max_speed * max_speed - c
        if room < ROUNDING * max_speed * max_speed:  # all is spent: what is left is rounding
            room = 0.0
        if a + 2.0 * b > room:
            root = math.sqrt(b * b + a * room)
            alpha = min(room / (root + b) if b > 0.0 else (root - b) / a, 1.0)
    for k in range(axes):
        total[k] += alpha * part[k]
