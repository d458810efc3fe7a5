"""The reference velocity of a robot: the paper's outer loop, or one of the baselines in its place."""

from __future__ import annotations

import math

from escort_mj.control.movers import obstacles_seen
from escort_mj.control.nsb import UNLIMITED
from escort_mj.control.outer import outer_loop, wish
from escort_mj.control.outer_loops.barrier_filter import filter_velocity
from escort_mj.control.outer_loops.potential_field import repulsion
from escort_mj.control.plan import (
    AVOID_OBSTACLES,
    BARRIER_FILTER,
    MAX_CYCLES,
    OUTSIDE,
    POTENTIAL_FIELD,
    Plan,
    State,
)
from escort_mj.kernels import DOUBLE, matrix_at, merged, stack_memory, vector_at
from escort_mj.on_demand import on_demand


@merged
def reference_velocity(i: int, first: int, levels: int, plan: Plan, state: State) -> None:
    """Computes one robot's reference velocity in the way that the mission says.

    Args:
        i: Which robot, from 0.
        first: Row of the ladder where its behaviors begin.
        levels: How many they are.
        plan: What the controller is told.
        state: Its state; `v_d` and `avoidance_active` are written.
    """
    if plan.outer == OUTSIDE:
        return
    if plan.outer == POTENTIAL_FIELD:
        _add_up(i, first, levels, plan, state)
    else:
        outer_loop(i, first, levels, plan, state)  # without its avoidance task if a filter follows
    if plan.outer == BARRIER_FILTER:
        _filter(i, first, levels, plan, state)


@on_demand
def _add_up(i: int, first: int, levels: int, plan: Plan, state: State) -> None:
    """Potential fields: the sum of all wishes and repulsions, slowed down where it is too fast."""
    p = state.q.shape[1]
    state.avoidance_active[i] = 0.0
    for k in range(p):
        state.v_d[i, k] = 0.0
    if state.lost[i] != 0.0:
        return
    memory = stack_memory()
    directions = matrix_at(memory, MAX_CYCLES, p)
    weights = vector_at(memory + DOUBLE * MAX_CYCLES * p, MAX_CYCLES)
    speeds = vector_at(memory + DOUBLE * MAX_CYCLES * (p + 1), MAX_CYCLES)
    part = vector_at(memory + DOUBLE * MAX_CYCLES * (p + 2), p)
    total = state.v_d[i]
    for k in range(p):
        total[k] = state.target_velocity_measured[k] if plan.target_feedforward else 0.0
    for level in range(first, first + levels):
        row = plan.ladder[level]
        if row[0] == AVOID_OBSTACLES:
            repelled = repulsion(
                i, state.q_measured, state.lost, obstacles_seen(i, plan, state), plan.obstacle_radius,
                plan.robot_radius, row, plan.outer_gain, plan.outer_distance, directions[0], total,
            )  # fmt: skip
            state.avoidance_active[i] = 1.0 if repelled else 0.0
        else:
            wish(i, row, plan, state, directions, weights, speeds, part)
            for k in range(p):
                total[k] += part[k]
    _slow_down(i, plan, state)


@on_demand
def _filter(i: int, first: int, levels: int, plan: Plan, state: State) -> None:
    """Barrier filter: changes the velocity of the escort behaviors by as little as safety takes.

    Slowing down the result breaks no constraint unless a distance is too small already: rest keeps them.
    """
    moved = False
    for level in range(first, first + levels):
        row = plan.ladder[level]
        if row[0] == AVOID_OBSTACLES and state.lost[i] == 0.0:
            moved = filter_velocity(
                i, state.q_measured, state.lost, obstacles_seen(i, plan, state), plan.obstacle_radius,
                plan.robot_radius, row, plan.sensing_robots, plan.sensing_obstacles, plan.outer_gain,
                state.v_d[i],
            )  # fmt: skip
    state.avoidance_active[i] = 1.0 if moved else 0.0
    _slow_down(i, plan, state)


@merged
def _slow_down(i: int, plan: Plan, state: State) -> None:
    """Keeps the speed limit, along the same direction."""
    square = 0.0
    for k in range(state.q.shape[1]):
        square += state.v_d[i, k] * state.v_d[i, k]
    if plan.max_speed < UNLIMITED and square > plan.max_speed * plan.max_speed:
        share = plan.max_speed / math.sqrt(square)
        for k in range(state.q.shape[1]):
            state.v_d[i, k] *= share
