"""How the tasks of each robot get on with each other, by singular values (eq. 19, remark 5)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import Behavior
from tests.oracle.behaviors import asked, is_active, resolved, task_error
from tests.oracle.task import Situation, row_spaces

Array = NDArray[np.float64]

SAME = 1e-9  # singular values below this share of the largest are rounding


class Tasks(NamedTuple):
    """Task signals of the team; see `escort_mj.signals`."""

    ruling: Array  # (n,)
    task_error: Array  # (n, behaviors)
    task_wish: Array  # (n, behaviors)
    task_removed: Array  # (n, behaviors)
    task_angle: Array  # (n, behaviors)


def weigh(stack: tuple[Behavior, ...], now: Situation) -> Tasks:
    """Task signals of all robots under one priority stack; arguments as of `nsb.outer_loop`."""
    n, columns, lost = len(now.q), len(now.setup.kinds), now.team.lost
    ruling, angle = np.full(n, -1.0), np.full((n, columns), np.pi / 2)
    error, wish, removed = np.zeros((n, columns)), np.zeros((n, columns)), np.zeros((n, columns))
    above: list[Array] = []  # projectors of higher tasks
    spaces: list[list[list[Array]]] = []  # of higher tasks, robot by robot, their row spaces
    for behavior in stack:
        column = now.setup.kinds.index(behavior.behavior)
        active = is_active(behavior, now)
        velocity, projector = resolved(behavior, now)
        rows: list[list[Array]] = [[] for _ in range(n)]
        for task in asked(behavior, now) if len(stack) > 1 else ():
            for i, basis in enumerate(_bases(row_spaces(task, now.setup.axes))):
                if active[i] and basis.size:
                    rows[i].append(basis)
        left = velocity
        for higher in reversed(above):
            left = higher @ left
        wish[:, column] = np.linalg.norm(velocity.reshape(now.q.shape), axis=1)
        removed[:, column] = np.linalg.norm((velocity - left).reshape(now.q.shape), axis=1)
        error[:, column] = np.where(active, task_error(behavior, now), 0.0)
        for i in range(n):
            if active[i] and ruling[i] < 0.0:
                ruling[i] = column
            for higher_rows in spaces:
                for a in rows[i]:
                    for b in higher_rows[i]:
                        angle[i, column] = min(angle[i, column], _least_angle(a, b))
        above.append(projector)
        spaces.append(rows)
    ruling[lost], angle[lost] = -1.0, np.pi / 2
    for signal in (error, wish, removed):
        signal[lost] = 0.0
    return Tasks(ruling, error, wish, removed, angle)


def _bases(rows: Array) -> list[Array]:
    """Orthonormal columns that span the same space as each robot's rows, shape (n, rows, p)."""
    u, sizes, _ = np.linalg.svd(rows.swapaxes(1, 2), full_matrices=False)
    return [each[:, size > SAME * size.max()] for each, size in zip(u, sizes, strict=True)]


def _least_angle(a: Array, b: Array) -> float:
    """The least angle between two spaces, of orthonormal columns: by its sine where it is small [rad]."""
    if a.shape[1] < b.shape[1]:
        a, b = b, a
    shared = a.T @ b
    cosine = _sizes(shared)[0]
    if cosine * cosine < 0.5:
        return math.acos(cosine)
    return math.asin(min(1.0, _sizes(b - a @ shared)[-1]))


def _sizes(matrix: Array) -> Sequence[float]:
    """Singular values, the largest first; of a single column its length."""
    if matrix.shape[1] == 1:
        return (math.sqrt(matrix[:, 0] @ matrix[:, 0]),)
    return tuple(np.linalg.svd(matrix, compute_uv=False))
