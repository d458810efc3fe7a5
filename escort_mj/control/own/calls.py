"""The steps of the native loop that belong to plugins: compiled when a mission first has one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.nsb import INACTIVE
from escort_mj.control.own.native import NO_NUMBER, NONE, note_failure, table_address
from escort_mj.control.plan import REMEMBERED, Plan, State
from escort_mj.kernels import (
    DOUBLE,
    call_function,
    data_address,
    double_at,
    merged,
    pointer_at,
    view_addresses,
)
from escort_mj.on_demand import on_demand

Array = NDArray[np.float64]


@merged
def _function(block: int) -> int:
    """Address of the function whose parameters stand at an address; 0 where nobody knows it."""
    table, number = table_address(), int(double_at(block))
    for k in range(pointer_at(table)):
        if pointer_at(table + DOUBLE * (1 + 2 * k)) == number:
            return pointer_at(table + DOUBLE * (2 + 2 * k))
    return 0


@merged
def own_law(plan: Plan, state: State) -> None:
    """Has a plugin's law write forces and rates; where it fails, no force is a number any more."""
    n, p = state.q.shape
    memory, rate = state.law_memory, state.law_memory_rate
    for c in range(memory.shape[0]):
        for i in range(n):
            for k in range(p):
                if state.time[0] > state.clock[REMEMBERED]:
                    memory[c, i, k] += plan.timestep * rate[c, i, k]
                rate[c, i, k] = 0.0
    state.clock[REMEMBERED] = state.time[0]
    for i in range(n):
        for k in range(p):
            state.tau[i, k] = 0.0
            state.rho_hat_rate[i, k] = 0.0
    block = data_address(plan.own)
    plan_at, state_at = view_addresses(state)
    function, status = _function(block), 1
    if function != 0:
        status, _ = call_function(function, (block, block, plan_at, state_at))
    if status != 0 and status != NONE:
        note_failure(block, plan_at, state_at, -1)
        for i in range(n):
            for k in range(p):
                state.tau[i, k] = math.nan
        return
    for i in range(n):
        for k in range(p):
            if not math.isfinite(state.tau[i, k]):
                note_failure(block, plan_at, state_at, NO_NUMBER - i)


@merged
def _finite(state: State, p: int) -> bool:
    """Whether all that a behavior wrote are finite numbers."""
    total = state.wish_error[0]
    for k in range(p):
        total += state.wish_direction[k] + state.wish_velocity[k]
    return math.isfinite(total)


@on_demand
def own_wish(
    i: int,
    offset: int,
    plan: Plan,
    state: State,
    direction: Array,
    weights: Array,
    speeds: Array,
    part: Array,
) -> int:
    """What a plugin's behavior wants of one robot: as `outer.wish`, which calls it.

    Args:
        i: Which robot, from 0.
        offset: Where its parameters begin among those of all plugins.
        plan: What the controller is told.
        state: Its state.
        direction: Result: the task's direction, shape (p,).
        weights: Result: 1 / |direction|^2 comes first.
        speeds: Result: how far the task is from done comes second [m].
        part: Result: the wanted velocity, shape (p,) [m/s].

    Returns:
        The task's rank, as `outer.wish`.
    """
    p = part.shape[0]
    for k in range(p):
        state.wish_direction[k] = 0.0
        state.wish_velocity[k] = 0.0
    state.wish_error[0] = 0.0
    block = data_address(plan.own) + DOUBLE * offset
    plan_at, state_at = view_addresses(state)
    function, status, rank = _function(block), 1, 0
    if function != 0:
        status, rank = call_function(function, (block, block, plan_at, state_at, i))
    failed = status != 0 and status != NONE
    if failed:
        note_failure(block, plan_at, state_at, i)
    square = 0.0
    if not (failed or rank == INACTIVE or _finite(state, p)):
        note_failure(block, plan_at, state_at, NO_NUMBER - i)
    for k in range(p):
        direction[k] = state.wish_direction[k]
        part[k] = math.nan if failed else state.wish_velocity[k] if rank != INACTIVE else 0.0
        square += direction[k] * direction[k]
    weights[0] = 1.0 / square if square > 0.0 else 0.0
    speeds[1] = state.wish_error[0]
    return 1 if failed else rank
