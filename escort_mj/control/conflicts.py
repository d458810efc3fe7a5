"""How the tasks of each robot get on with each other (paper eq. 19, remark 5): recorded, never acted upon."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import Behavior
from escort_mj.behaviors.task import Situation, row_spaces
from escort_mj.behaviors.wish import MAX_DIRECTIONS, MAX_LEVELS, Wish, square_of
from escort_mj.control.nsb import leave, wish
from escort_mj.native.kernels import inlined, merged, stack_memory, vector_at
from escort_mj.native.lanes import (
    Lanes,
    any_of,
    everywhere,
    gather,
    greatest,
    load,
    root,
    row_of,
    scatter,
    set_row,
    stack_rows,
    store,
    there,
    where,
)
from escort_mj.native.lanes import least as smaller
from escort_mj.native.on_demand import on_demand
from escort_mj.numerics.elementary import arc_cosine

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State

Array = NDArray[np.float64]

NO_CONFLICT = math.pi / 2
NOBODY = -1.0  # ruling behavior of a robot whose behaviors are all inactive


@on_demand
def weigh_tasks(i: int, plan: Plan, state: State) -> None:
    """Writes the task signals of robots i to i + 7: errors, wishes, what is removed, angles, who rules.

    Args:
        i: First robot, from 0.
        plan: What the controller knows.
        state: Its state; signals `task_...` and `ruling` are written.
    """
    behaviors = state.task_error.shape[1]
    every = plan.alike and int(plan.phase_levels[0]) == behaviors
    if not every:
        store(state.ruling, i, NOBODY)
        for column in range(i * behaviors, (i + 1) * behaviors):
            scatter(state.task_error, column, behaviors, 0.0)
            scatter(state.task_wish, column, behaviors, 0.0)
            scatter(state.task_removed, column, behaviors, 0.0)
            scatter(state.task_angle, column, behaviors, NO_CONFLICT)
    for phase in range(plan.phase_first.shape[0]):
        mine = there(state.q.shape[0] - i) & (load(state.lost, i) < 0.5)
        mine = mine & (abs(load(state.phase, i) - float(phase)) < 0.5)
        if any_of(mine):
            _weigh_phase(i, phase, every, plan, state)


@merged
def _weigh_phase(i: int, phase: int, every: bool, plan: Plan, state: State) -> None:
    """The task signals of those of robots i to i + 7 that a phase rules; `every`: all robots, all columns."""
    p, behaviors = state.q.shape[1], state.task_error.shape[1]
    first, levels = int(plan.phase_first[phase]), int(plan.phase_levels[phase])
    wanted, parts = stack_rows(MAX_LEVELS * p), stack_rows(MAX_LEVELS * p)
    directions, weights = stack_rows(MAX_LEVELS * MAX_DIRECTIONS * p), stack_rows(MAX_LEVELS * MAX_DIRECTIONS)
    actives, crosswise, angles = stack_rows(MAX_LEVELS), stack_rows(MAX_LEVELS), stack_rows(MAX_LEVELS)
    counts, ruling = vector_at(stack_memory(), MAX_LEVELS), everywhere(NOBODY)
    mine = there(state.q.shape[0] - i) & (load(state.lost, i) < 0.5)
    mine = mine & (abs(load(state.phase, i) - float(phase)) < 0.5)
    for level in range(levels - 1, -1, -1):
        x, place = directions[MAX_DIRECTIONS * p * level :], plan.level_column[first + level]
        column = i * behaviors + int(place)
        task = wish(i, first + level, plan, state, x, wanted, p * level)
        active = task.active > 0.5
        length = root(square_of(wanted, p * level, p))
        _write(state.task_wish, column, behaviors, mine & active, length, 0.0, every)
        _write(state.task_error, column, behaviors, mine & active, task.error, 0.0, every)
        ruling = where(active, place, ruling)
        set_row(weights, MAX_DIRECTIONS * level, task.weight)
        set_row(weights, MAX_DIRECTIONS * level + 1, task.second)
        set_row(actives, level, task.active)
        set_row(crosswise, level, task.across)
        set_row(angles, level, everywhere(NO_CONFLICT))
        counts[level] = task.directions
        for k in range(p):
            set_row(parts, p * level + k, row_of(wanted, p * level + k))
        for lower in range(level + 1, levels if any_of(active) else 0):
            below, others = directions[MAX_DIRECTIONS * p * lower :], weights[MAX_DIRECTIONS * lower :]
            angle = _angle(p, task, x, int(counts[lower]), row_of(crosswise, lower), below, others)
            both = active & (row_of(actives, lower) > 0.5)
            set_row(angles, lower, where(both, smaller(angle, row_of(angles, lower)), row_of(angles, lower)))
            leave(p, task, x, parts, p * lower)
    store(state.ruling, i, ruling if every else where(mine, ruling, load(state.ruling, i)))
    for level in range(levels):
        column = i * behaviors + int(plan.level_column[first + level])
        for k in range(p * level, p * level + p):
            set_row(wanted, k, row_of(wanted, k) - row_of(parts, k))
        length = root(square_of(wanted, p * level, p))
        _write(state.task_removed, column, behaviors, mine, length, 0.0, every)
        _write(state.task_angle, column, behaviors, mine, row_of(angles, level), NO_CONFLICT, every)


@inlined
def _write(
    signal: Array, column: int, behaviors: int, where_to: Any, value: Lanes, others: float, every: bool
) -> None:
    """Writes a signal of those robots that are meant; the others' is kept, or becomes what every one has."""
    left = everywhere(others) if every else gather(signal, column, behaviors)
    scatter(signal, column, behaviors, where(where_to, value, left))


@inlined
def _angle(p: int, task: Wish, x: Array, lower: int, crosswise: Lanes, y: Array, v: Array) -> Lanes:
    """Smallest angle between what two tasks move along [rad]; a right angle is no conflict (eq. 19).

    Args:
        p: Number of axes.
        task: The task above.
        x: Its directions.
        lower: How many directions the task below has.
        crosswise: Where that takes all directions but y.
        y: Its directions.
        v: Their weights.
    """
    found = everywhere(0.0)
    for a in range(task.directions):
        weight = task.weight if a == 0 else task.second
        for b in range(lower):
            share = abs(_dot(p, x, p * a, y, p * b)) * root(weight * row_of(v, b))
            if any_of(greatest(task.across, crosswise) > 0.5):
                beside_x = _share_across(p, x, p * a, weight, y, p * b, row_of(v, b))
                beside_y = _share_across(p, y, p * b, row_of(v, b), x, p * a, weight)
                share = where(task.across > 0.5, beside_x, where(crosswise > 0.5, beside_y, share))
                share = where((task.across > 0.5) & (crosswise > 0.5), 1.0, share)
            found = greatest(share, found)
    return arc_cosine(smaller(found, 1.0))


@inlined
def _dot(p: int, x: Array, a: int, y: Array, b: int) -> Lanes:
    """Dot products of the vectors in p rows of lanes, from a and from b on."""
    found = everywhere(0.0)
    for k in range(p):
        found = found + row_of(x, a + k) * row_of(y, b + k)
    return found


@inlined
def _share_across(p: int, x: Array, a: int, u: Lanes, y: Array, b: int, v: Lanes) -> Lanes:
    """Share of y that is across x: sine of the angle between them, 0 where y is 0.

    Args:
        p: Number of axes.
        x: A vector, in p rows of lanes.
        a: The first of them.
        u: 1 / |x|^2.
        y: Likewise.
        b: Likewise.
        v: 1 / |y|^2.
    """
    along, square = _dot(p, x, a, y, b) * u, everywhere(0.0)
    for k in range(p):
        rest = row_of(y, b + k) - along * row_of(x, a + k)
        square = square + rest * rest
    return root(square * v)


# The same in plain NumPy.


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
        active = behavior.active(now)
        velocity, projector = behavior.resolved(now)
        rows: list[list[Array]] = [[] for _ in range(n)]
        for task in behavior.asked(now) if len(stack) > 1 else ():
            for i, basis in enumerate(_bases(row_spaces(task, now.setup.axes))):
                if active[i] and basis.size:
                    rows[i].append(basis)
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
