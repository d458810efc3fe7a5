"""How the tasks get on with each other (eq. 19), by their row spaces and projectors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orth, subspace_angles

from escort_mj.behaviors import Behavior
from escort_mj.behaviors.task import Situation, resolve_all, row_spaces

Array = NDArray[np.float64]

SAME = 1e-9  # singular values below this share of the largest are rounding


class Tasks(NamedTuple):
    """Task signals of the team; see `escort_mj.signals`."""

    ruling: Array  # (n,)
    task_error: Array  # (n, behaviors)
    task_wish: Array  # (n, behaviors)
    task_removed: Array  # (n, behaviors)
    task_angle: Array  # (n, behaviors)


def weigh(ladder: tuple[Behavior, ...], now: Situation) -> Tasks:
    """Task signals of all robots under one ladder; arguments as of `outer.outer_loop`."""
    n, columns, lost = len(now.q), len(now.setup.kinds), now.team.lost
    ruling, angle = np.full(n, -1.0), np.full((n, columns), np.pi / 2)
    error, wish, removed = np.zeros((n, columns)), np.zeros((n, columns)), np.zeros((n, columns))
    above: list[Array] = []  # projectors of higher tasks
    spaces: list[list[list[Array]]] = []  # of higher tasks, robot by robot, their row spaces
    for behavior in ladder:
        column = now.setup.kinds.index(behavior.behavior)
        tasks, active = behavior.team_tasks(now), behavior.active(now)
        velocity, projector = resolve_all(tasks)
        axes = now.setup.axes
        rows = [
            [orth(row_spaces(task, i, axes).T, rcond=SAME) for task in tasks] if active[i] else []
            for i in range(n)
        ]
        left = velocity
        for higher in reversed(above):
            left = higher @ left
        wish[:, column] = np.linalg.norm(velocity.reshape(now.q.shape), axis=1)
        removed[:, column] = np.linalg.norm((velocity - left).reshape(now.q.shape), axis=1)
        error[:, column] = np.where(active, behavior.error(now), 0.0)
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
    ruling[lost], angle[lost] = -1.0, np.pi / 2
    for signal in (error, wish, removed):
        signal[lost] = 0.0
    return Tasks(ruling, error, wish, removed, angle)
