"""The outer loop: behaviors composed by priority, and the speed limit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import Behavior
from escort_mj.behaviors.task import Situation, resolve_all

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def outer_loop(behaviors: tuple[Behavior, ...], now: Situation) -> tuple[Array, Mask]:
    """Composes the behaviors from the lowest priority to the highest (eq. 2); v_d and who avoids.

    Avoidance works in the world's frame: w -> v1 + N1 w. Escort behaviors work in the target's,
    where the behaviors below move at w - c_dot: w -> c_dot + sum_c [v2_c + N2_c (w - c_dot)].

    Args:
        behaviors: By priority, the most important first.
        now: The situation.

    Returns:
        v_d, shape (n, p) [m/s], and who avoids, shape (n,).
    """
    q, setup = now.q, now.setup
    c_dot = np.tile(now.c_dot, len(q)) * setup.target_feedforward
    carried = c_dot  # what the projections leave of c_dot
    parts: list[Array] = []
    place = 0  # of c_dot among the parts: right before the highest escort behavior
    avoiding = np.zeros(len(q), dtype=bool)
    for behavior in reversed(behaviors):
        velocity, projector = resolve_all(behavior.team_tasks(now))
        if behavior.frame == "world":
            below = (carried + np.sum(parts, axis=0)).reshape(q.shape)
            velocity = velocity + behavior.beside(now, below).ravel()
            carried, place, avoiding = projector @ carried, place + 1, avoiding | behavior.active(now)
        else:
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
