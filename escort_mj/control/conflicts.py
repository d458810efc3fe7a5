"""How the tasks of each robot get on with each other (paper eq. 19, remark 5): recorded, never acted upon."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

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
from escort_mj.kernels import DOUBLE, inlined, matrix_at, merged, stack_memory, vector_at
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
