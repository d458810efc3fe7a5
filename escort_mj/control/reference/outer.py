"""The outer loop: behaviors composed by priority, and the speed limit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.behaviors import AvoidObstacles, BehaviorParameters, Repulsion, Vertices
from escort_mj.control.reference.behaviors import avoidance, escort, sidestep, spread
from escort_mj.control.reference.failure import Team
from escort_mj.control.setup import Setup

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def outer_loop(
    setup: Setup,
    team: Team,
    behaviors: tuple[BehaviorParameters, ...],
    rotation: Array,
    q: Array,
    v: Array,
    e: Array,
    c: Array,
    c_dot: Array,
) -> tuple[Array, Mask]:
    """Composes the behaviors from the lowest priority to the highest (eq. 2); v_d and who avoids.

    Avoidance works in the world's frame: w -> v1 + N1 w. Escort behaviors work in the target's,
    where the behaviors below move at w - c_dot: w -> c_dot + sum_c [v2_c + N2_c (w - c_dot)].

    Args:
        setup: What the controller is told.
        team: Who is left, and in which formation.
        behaviors: By priority, the most important first.
        rotation: Of the even figure, shape (p, p).
        q: Measured positions.
        v: Measured velocities.
        e: Tracking errors.
        c: Position of the target, shape (p,) [m].
        c_dot: Velocity of the target, shape (p,) [m/s].

    Returns:
        v_d, shape (n, p) [m/s], and who avoids, shape (n,).
    """
    c_dot = np.tile(c_dot, len(q)) * setup.target_feedforward
    carried = c_dot  # what the projections leave of c_dot
    parts: list[Array] = []
    place = 0  # of c_dot among the parts: right before the highest escort behavior
    avoiding = np.zeros(len(q), dtype=bool)
    for behavior in reversed(behaviors):
        if isinstance(behavior, AvoidObstacles):
            velocity, projector, active = avoidance(behavior, q, v, e, setup, team.lost)
            below = (carried + np.sum(parts, axis=0)).reshape(q.shape)
            velocity = velocity + sidestep(behavior, q, below, setup, team.lost).ravel()
            carried, place, avoiding = projector @ carried, place + 1, avoiding | active
        else:
            if isinstance(behavior, Vertices | Repulsion):
                velocity, projector = spread(behavior, q, c, team, rotation, setup)
            else:
                velocity, projector = escort(behavior, q, c, team, setup)
            carried, place = c_dot + projector @ (carried - c_dot), 0
        parts = [velocity, *(projector @ part for part in parts)]
    parts.insert(place, carried)
    if not np.isfinite(setup.max_speed):
        return np.sum(parts, axis=0).reshape(q.shape), avoiding
    by_robot = np.array(parts).reshape(len(parts), *q.shape).swapaxes(0, 1)
    return np.array([spend(robot, setup.max_speed) for robot in by_robot]), avoiding


def spend(contributions: Array, max_speed: float) -> Array:
    """Adds one robot's contributions by priority, each as far as the speed limit leaves room for it.

    Args:
        contributions: Velocities, the most important first, shape (k, p) [m/s].
        max_speed: Largest speed [m/s].
    """
    total: Array = np.zeros(contributions.shape[1])
    for part in contributions:
        square, along = float(part @ part), float(total @ part)
        room = max_speed**2 - float(total @ total)
        room *= room > 1e-12 * max_speed**2  # the root below would make 1e-8 of what is only rounding
        if square + 2.0 * along <= room:
            total = total + part
        else:  # cut where |total + alpha part| = max_speed
            root = math.sqrt(along**2 + square * room)
            total = total + (room / (root + along) if along > 0.0 else (root - along) / square) * part
    return total
