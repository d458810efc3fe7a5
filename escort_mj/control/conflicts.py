"""How the tasks of each robot get on with each other (paper eq. 19, remark 5): recorded, never acted upon."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
from escort_mj.plan import Plan, State

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


SAME = 1e-9  # singular values below this share of the largest are rounding
