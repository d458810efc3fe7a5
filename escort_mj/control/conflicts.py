"""How the tasks of each robot get on with each other (paper eq. 19, remark 5): recorded, never acted upon."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.elementary import arc_cosine, root
from escort_mj.control.nsb import INACTIVE, TANGENT, leave
from escort_mj.control.outer import wish
from escort_mj.control.plan import (
    AVOID_OBSTACLES,
    CHORDS,
    COLUMN,
    MAX_CYCLES,
    MAX_LEVELS,
    OWN,
    Plan,
    State,
)
from escort_mj.control.side_by_side import leave as leave_side_by_side
from escort_mj.control.side_by_side import wishes
from escort_mj.kernels import DOUBLE, inlined, matrix_at, merged, stack_memory, vector_at
from escort_mj.lanes import Lanes, everywhere, greatest, row_of, scatter, set_row, stack_rows, store, where
from escort_mj.lanes import least as smaller
from escort_mj.on_demand import on_demand

Array = NDArray[np.float64]

NO_CONFLICT = math.pi / 2
NOBODY = -1.0  # ruling behavior of a robot whose behaviors are all inactive


@on_demand
def weigh_tasks(i: int, first: int, levels: int, plan: Plan, state: State) -> None:
    """Writes the task signals of one robot: errors, wishes, what projections removed, angles, who rules.

    Args:
        i: Which robot, from 0.
        first: Row of the ladder where its behaviors begin.
        levels: How many they are.
        plan: What the controller is told.
        state: Its state; signals `task_...` and `ruling` are written.
    """
    p, memory = state.q.shape[1], stack_memory()
    weights = matrix_at(memory, MAX_LEVELS, MAX_CYCLES)
    speeds = vector_at(memory + DOUBLE * MAX_LEVELS * MAX_CYCLES, MAX_CYCLES)
    ranks = vector_at(memory + DOUBLE * (MAX_LEVELS + 1) * MAX_CYCLES, MAX_LEVELS)
    wishes, parts = state.tasks[:MAX_LEVELS], state.tasks[MAX_LEVELS : 2 * MAX_LEVELS]
    kept = state.tasks[2 * MAX_LEVELS :]  # directions of all levels
    for column in range(state.task_error.shape[1]):
        state.task_error[i, column] = 0.0
        state.task_wish[i, column] = 0.0
        state.task_removed[i, column] = 0.0
        state.task_angle[i, column] = NO_CONFLICT
    state.ruling[i] = NOBODY
    if state.lost[i] != 0.0:
        return
    for level in range(levels - 1, -1, -1):
        row = plan.ladder[first + level]
        directions = kept[MAX_CYCLES * level : MAX_CYCLES * (level + 1)]
        rank = wish(i, row, plan, state, directions, weights[level], speeds, wishes[level])
        ranks[level] = rank
        for k in range(p):
            parts[level, k] = wishes[level, k]
        if rank == INACTIVE:
            continue
        column = int(row[COLUMN])
        state.ruling[i] = column
        state.task_wish[i, column] = _norm(wishes[level])
        state.task_error[i, column] = _error(row, rank, weights[level], speeds, wishes[level], plan, state)
        for lower in range(level + 1, levels):
            if ranks[lower] == INACTIVE:
                continue
            below = kept[MAX_CYCLES * lower : MAX_CYCLES * (lower + 1)]
            angle = _angle(rank, directions, weights[level], int(ranks[lower]), below, weights[lower])
            other = int(plan.ladder[first + lower, COLUMN])
            state.task_angle[i, other] = min(state.task_angle[i, other], angle)
            leave(rank, directions, weights[level], parts[lower])
    for level in range(levels):
        column = int(plan.ladder[first + level, COLUMN])
        for k in range(p):
            wishes[level, k] -= parts[level, k]
        state.task_removed[i, column] = _norm(wishes[level])


@on_demand
def weigh_side_by_side(i: int, first: int, levels: int, plan: Plan, state: State) -> None:
    """As `weigh_tasks`, of robots i to i + 7 where `side_by_side` runs their outer loops."""
    p, behaviors = state.q.shape[1], state.task_error.shape[1]
    wanted, parts = stack_rows(MAX_LEVELS * p), stack_rows(MAX_LEVELS * p)
    directions, weights = stack_rows(MAX_LEVELS * MAX_CYCLES * p), stack_rows(MAX_LEVELS * MAX_CYCLES)
    actives, angles = stack_rows(MAX_LEVELS), stack_rows(MAX_LEVELS)
    ranks, ruling = vector_at(stack_memory(), MAX_LEVELS), everywhere(NOBODY)
    for level in range(levels - 1, -1, -1):
        row = plan.ladder[first + level]
        x, own = directions[MAX_CYCLES * p * level :], i * behaviors + int(row[COLUMN])
        rank, weight, second, depth = wishes(i, row, plan, state, x, wanted, p * level)
        avoiding = row[0] == AVOID_OBSTACLES
        active = where(depth > 0.0, 1.0, 0.0 * depth) if avoiding else everywhere(1.0)
        speed = _length(wanted, p * level, p)
        error = depth
        if rank == TANGENT:
            error = speed / row[1]
        elif not avoiding:
            length = state.chord_length[0] if row[0] == CHORDS else plan.radius
            error = _distance_error(rank, weight, second, length)
        scatter(state.task_wish, own, behaviors, speed)
        scatter(state.task_error, own, behaviors, error)
        ruling = where(active > 0.0, row[COLUMN], ruling)
        set_row(weights, MAX_CYCLES * level, weight)
        set_row(weights, MAX_CYCLES * level + 1, second)
        set_row(actives, level, active)
        set_row(angles, level, everywhere(NO_CONFLICT))
        ranks[level] = rank
        for k in range(p):
            set_row(parts, p * level + k, row_of(wanted, p * level + k))
        for lower in range(level + 1, levels):
            below, others = directions[MAX_CYCLES * p * lower :], weights[MAX_CYCLES * lower :]
            angle = _angles(p, rank, x, weights[MAX_CYCLES * level :], int(ranks[lower]), below, others)
            both = (active > 0.0) & (row_of(actives, lower) > 0.0)
            set_row(angles, lower, where(both, smaller(angle, row_of(angles, lower)), row_of(angles, lower)))
            leave_side_by_side(p, rank, x, weight, second, parts, p * lower)
    store(state.ruling, i, ruling)
    for level in range(levels):
        own = i * behaviors + int(plan.ladder[first + level, COLUMN])
        for k in range(p * level, p * level + p):
            set_row(wanted, k, row_of(wanted, k) - row_of(parts, k))
        scatter(state.task_removed, own, behaviors, _length(wanted, p * level, p))
        scatter(state.task_angle, own, behaviors, row_of(angles, level))


@inlined
def _length(rows: Array, at: int, p: int) -> Lanes:
    """Lengths of the vectors in p rows of lanes, from one on."""
    square = everywhere(0.0)
    for k in range(at, at + p):
        square = square + row_of(rows, k) * row_of(rows, k)
    return root(square)


@inlined
def _distance_error(rank: int, first: Lanes, second: Lanes, length: float) -> Lanes:
    """As `_error`, of a task that keeps a distance in one or two directions of so many weights."""
    away = where(first > 0.0, 1.0 / math.sqrt(first), 0.0) - length
    if rank == 1:
        return abs(away)
    other = where(second > 0.0, 1.0 / math.sqrt(second), 0.0) - length
    return root(0.5 * (away * away + other * other))


@inlined
def _angles(p: int, rank: int, x: Array, u: Array, lower: int, y: Array, v: Array) -> Lanes:
    """As `_angle`, with directions x and y and their weights u and v in rows of lanes."""
    found = everywhere(0.0)
    if rank == TANGENT and lower == TANGENT:
        found = everywhere(1.0)
    elif rank == TANGENT:
        for c in range(lower):
            found = greatest(_shares_across(p, x, 0, row_of(u, 0), y, p * c, row_of(v, c)), found)
    elif lower == TANGENT:
        for c in range(rank):
            found = greatest(_shares_across(p, y, 0, row_of(v, 0), x, p * c, row_of(u, c)), found)
    else:
        for a in range(rank):
            for b in range(lower):
                share = abs(_dot(p, x, p * a, y, p * b)) * math.sqrt(row_of(u, a) * row_of(v, b))
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
def _shares_across(p: int, x: Array, a: int, u: Lanes, y: Array, b: int, v: Lanes) -> Lanes:
    """As `_across`, of vectors in rows of lanes from a and b on, with weights u and v."""
    along, square = _dot(p, x, a, y, b) * u, everywhere(0.0)
    for k in range(p):
        rest = row_of(y, b + k) - along * row_of(x, a + k)
        square = square + rest * rest
    return root(square * v)


@inlined
def _norm(x: Array) -> float:
    """Length of a vector."""
    square = 0.0
    for k in range(x.shape[0]):
        square += x[k] * x[k]
    return math.sqrt(square)


@merged
def _error(
    row: Array, rank: int, weights: Array, speeds: Array, wished: Array, plan: Plan, state: State
) -> float:
    """How far an active task is from done, as a length [m]; root mean square over a task's directions."""
    if row[0] == AVOID_OBSTACLES or row[0] == OWN:
        return float(speeds[1])
    if rank == TANGENT:
        return _norm(wished) / row[1]
    length = state.chord_length[0] if row[0] == CHORDS else plan.radius
    square = 0.0
    for c in range(rank):
        distance = 1.0 / math.sqrt(weights[c]) if weights[c] > 0.0 else 0.0
        square += (distance - length) ** 2
    return math.sqrt(square / rank)


@inlined
def _angle(rank: int, x: Array, x_weights: Array, lower_rank: int, y: Array, y_weights: Array) -> float:
    """Smallest angle between what two tasks move along [rad]; a right angle is no conflict (eq. 19)."""
    largest = 0.0
    if rank == TANGENT and lower_rank == TANGENT:
        largest = 1.0
    elif rank == TANGENT or lower_rank == TANGENT:
        for c in range(max(rank, lower_rank)):
            if rank == TANGENT:
                largest = max(largest, _across(x[0], x_weights[0], y[c], y_weights[c]))
            else:
                largest = max(largest, _across(y[0], y_weights[0], x[c], x_weights[c]))
    else:
        for a in range(rank):
            for b in range(lower_rank):
                largest = max(largest, abs(_along(x[a], y[b])) * math.sqrt(x_weights[a] * y_weights[b]))
    return math.acos(min(largest, 1.0))


@inlined
def _along(x: Array, y: Array) -> float:
    """Dot product."""
    total = 0.0
    for k in range(x.shape[0]):
        total += x[k] * y[k]
    return total


@inlined
def _across(x: Array, x_weight: float, y: Array, y_weight: float) -> float:
    """Share of y that is tangential to x: sine of the angle between them; 0 where y is 0."""
    along = _along(x, y) * x_weight
    square = 0.0
    for k in range(x.shape[0]):
        square += (y[k] - along * x[k]) ** 2
    return math.sqrt(square * y_weight)
