"""How the tasks get on with each other (eq. 19), by their row spaces and projectors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space, orth, subspace_angles

from escort_mj.control.behaviors import (
    AvoidObstacles,
    BehaviorParameters,
    Chords,
    Repulsion,
    Surface,
    Vertices,
)
from escort_mj.control.reference.behaviors import avoidance, escort, intrusion, spread
from escort_mj.control.reference.failure import Team
from escort_mj.control.setup import Setup

Array = NDArray[np.float64]


class Tasks(NamedTuple):
    """Task signals of the team; see `escort_mj.signals`."""

    ruling: Array  # (n,)
    task_error: Array  # (n, behaviors)
    task_wish: Array  # (n, behaviors)
    task_removed: Array  # (n, behaviors)
    task_angle: Array  # (n, behaviors)


def weigh(
    setup: Setup,
    team: Team,
    ladder: tuple[BehaviorParameters, ...],
    rotation: Array,
    q: Array,
    v: Array,
    e: Array,
    c: Array,
) -> Tasks:
    """Task signals of all robots under one ladder; arguments as of `outer_loop`."""
    n, columns = len(q), len(setup.kinds)
    ruling, angle = np.full(n, -1.0), np.full((n, columns), np.pi / 2)
    error, wish, removed = np.zeros((n, columns)), np.zeros((n, columns)), np.zeros((n, columns))
    above: list[Array] = []  # projectors of higher tasks
    spaces: list[list[list[Array]]] = []  # of higher tasks, robot by robot, their row spaces
    for behavior in ladder:
        column = setup.kinds.index(behavior.behavior)
        velocity, projector, active = _task(behavior, setup, team, rotation, q, v, e, c)
        rows = [_row_spaces(behavior, setup, team, i, q, c) if active[i] else [] for i in range(n)]
        left = velocity
        for higher in reversed(above):
            left = higher @ left
        wanted = velocity.reshape(q.shape)
        wish[:, column] = np.linalg.norm(wanted, axis=1)
        removed[:, column] = np.linalg.norm((velocity - left).reshape(q.shape), axis=1)
        error[:, column] = np.where(active, _error(behavior, setup, team, wanted, q, c), 0.0)
        for i in range(n):
            if active[i] and ruling[i] < 0.0:
                ruling[i] = column
            for higher_rows in spaces:
                for a in rows[i]:
                    for b in higher_rows[i]:
                        if a.size and b.size:
                            angle[i, column] = min(angle[i, column], subspace_angles(a, b).min())
        above.append(projector)
        spaces.append(rows)
    ruling[team.lost], angle[team.lost] = -1.0, np.pi / 2
    for signal in (error, wish, removed):
        signal[team.lost] = 0.0
    return Tasks(ruling, error, wish, removed, angle)


def _task(
    behavior: BehaviorParameters,
    setup: Setup,
    team: Team,
    rotation: Array,
    q: Array,
    v: Array,
    e: Array,
    c: Array,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Velocity, projector, and whose task is active."""
    if isinstance(behavior, AvoidObstacles):
        return avoidance(behavior, q, v, e, setup, team.lost)
    everybody = np.ones(len(q), dtype=bool)
    if isinstance(behavior, Vertices | Repulsion):
        return *spread(behavior, q, c, team, rotation, setup), everybody
    return *escort(behavior, q, c, team, setup), everybody


def _row_spaces(
    behavior: BehaviorParameters, setup: Setup, team: Team, i: int, q: Array, c: Array
) -> list[Array]:
    """Bases, shape (p, k), of what each row block of the task's Jacobian moves robot i along."""
    if isinstance(behavior, AvoidObstacles):
        _, intruder = intrusion(behavior, q, setup, team.lost)
        x = q[i] - intruder[i]
        return [orth((x if x.any() else np.eye(len(x))[0])[:, None])]
    if isinstance(behavior, Chords):
        return [orth((q[i] - q[row[i]])[:, None]) for row in team.predecessors]
    radial = orth((q[i] - c)[:, None])
    return [radial] if isinstance(behavior, Surface) else [null_space(radial.T)]


def _error(
    behavior: BehaviorParameters, setup: Setup, team: Team, velocity: Array, q: Array, c: Array
) -> Array:
    """Distance of each robot from the task's wish, shape (n,) [m]."""
    if isinstance(behavior, AvoidObstacles):
        return intrusion(behavior, q, setup, team.lost)[0]
    if isinstance(behavior, Vertices | Repulsion):
        return np.asarray(np.linalg.norm(velocity, axis=1) / behavior.gain)
    if isinstance(behavior, Surface):
        return np.abs(np.linalg.norm(q - c, axis=1) - setup.radius)
    chords = [np.linalg.norm(q - q[row], axis=1) for row in team.predecessors]
    return np.asarray(np.sqrt(np.mean((np.array(chords) - team.chord_length) ** 2, axis=0)))
