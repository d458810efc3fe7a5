"""The outer loop (null-space-based behavioral control): what velocity each robot is to have."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.behaviors.avoid_obstacles import avoidance, sidestep
from escort_mj.control.behaviors.distance import keep_distance
from escort_mj.control.behaviors.repulsion import repel
from escort_mj.control.behaviors.vertices import to_vertex
from escort_mj.control.movers import obstacles_seen
from escort_mj.control.neighbors import seen_neighbors
from escort_mj.control.nsb import INACTIVE, TANGENT, add_within_limit, combine, leave
from escort_mj.control.own.calls import own_wish
from escort_mj.control.plan import (
    AVOID_OBSTACLES,
    BARRIER_FILTER,
    CHORDS,
    MAX_CYCLES,
    MAX_LEVELS,
    OWN,
    REPULSION,
    SIDESTEP,
    VERTICES,
    Plan,
    State,
)
from escort_mj.kernels import DOUBLE, inlined, matrix_at, merged, stack_memory, vector_at

Array = NDArray[np.float64]


@inlined
def wish(
    i: int,
    row: Array,
    plan: Plan,
    state: State,
    directions: Array,
    weights: Array,
    speeds: Array,
    part: Array,
) -> int:
    """What one behavior, by itself, wants of one robot.

    Args:
        i: Which robot, from 0.
        row: The behavior's row of the ladder.
        plan: What the controller is told.
        state: Its state.
        directions: Result: the task's Jacobians x, shape (>= 2, p).
        weights: Result: 1 / |x|^2, shape (>= 2,).
        speeds: Result: task velocities in terms of x, shape (>= 2,); of avoidance the task's
            speed, and how deep the worst intruder is [m].
        part: Result: the wanted velocity, shape (p,) [m/s]; 0 while inactive.

    Returns:
        The task's rank: how many directions it takes, or `TANGENT` for all but one, or `INACTIVE`.
    """
    q, c = state.q_measured, state.target_position_measured
    if row[0] == AVOID_OBSTACLES:
        depth, speeds[0] = avoidance(
            i, q, state.v_measured, state.e, state.lost, seen_neighbors(state), plan.failures.shape[0] > 0,
            obstacles_seen(i, plan, state), plan.obstacle_radius, plan.robot_radius,
            row, plan.slope, directions[0],
        )  # fmt: skip
        weights[0], speeds[1] = 1.0, depth
        for k in range(part.shape[0]):
            part[k] = speeds[0] * directions[0, k] if depth > 0.0 else 0.0
        return 1 if depth > 0.0 else INACTIVE
    if row[0] == VERTICES:
        weights[0] = to_vertex(
            i, q, c, plan.radius, row[1], state.vertices, state.rotation, directions[0], part
        )
        return TANGENT
    if row[0] == REPULSION:
        weights[0] = repel(
            i,
            q,
            c,
            state.lost,
            plan.robot_radius,
            plan.sensing_robots,
            plan.radius,
            row[1],
            directions[0],
            part,
        )
        return TANGENT
    if row[0] == OWN:
        return own_wish(i, int(row[2]), plan, state, directions[0], weights, speeds, part)
    cycles = 1
    if row[0] == CHORDS:
        cycles = state.predecessors.shape[0]
        for cycle in range(cycles):
            other = int(state.predecessors[cycle, i])
            weights[cycle], speeds[cycle] = keep_distance(
                q[i], q[other], state.chord_length[0], row[1], directions[cycle]
            )
    else:
        weights[0], speeds[0] = keep_distance(q[i], c, plan.radius, row[1], directions[0])
    combine(cycles, directions, speeds, part)
    return cycles


@merged
def intrusion(i: int, row: Array, plan: Plan, state: State) -> float:
    """How deep the worst intruder is in robot i's safe sphere, by a row of avoidance; 0 for none [m]."""
    depth, _ = avoidance(
        i, state.q_measured, state.v_measured, state.e, state.lost, seen_neighbors(state),
        plan.failures.shape[0] > 0, obstacles_seen(i, plan, state), plan.obstacle_radius, plan.robot_radius,
        row, plan.slope, vector_at(stack_memory(), state.q.shape[1]),
    )  # fmt: skip
    return depth


@inlined
def outer_loop(i: int, first: int, levels: int, plan: Plan, state: State) -> None:
    """Reference velocity of one robot: its behaviors composed in the order of the ladder (eq. 2).

    Escort behaviors are relative to the target's motion (feed-forward), avoidance is not:
    v_d = v1 + N1 [c_dot + v2 + N2 v3] for the paper's order.

    Args:
        i: Which robot, from 0.
        first: Row of the ladder where its behaviors begin.
        levels: How many they are.
        plan: What the controller is told.
        state: Its state; `v_d` and `avoidance_active` are written.
    """
    p = state.q.shape[1]
    memory = stack_memory()
    directions = matrix_at(memory, MAX_CYCLES, p)
    weights = vector_at(memory + DOUBLE * MAX_CYCLES * p, MAX_CYCLES)
    speeds = vector_at(memory + DOUBLE * MAX_CYCLES * (p + 1), MAX_CYCLES)
    feedforward = vector_at(memory + DOUBLE * MAX_CYCLES * (p + 2), p)
    relative = vector_at(memory + DOUBLE * (MAX_CYCLES * (p + 2) + p), p)
    parts = matrix_at(memory + DOUBLE * (MAX_CYCLES * (p + 2) + 2 * p), MAX_LEVELS, p)
    if state.lost[i] != 0.0:  # nothing is asked of it any more
        state.avoidance_active[i] = 0.0
        for k in range(p):
            state.v_d[i, k] = 0.0
        return
    highest_escort = levels
    avoiding = False
    for k in range(p):
        feedforward[k] = state.target_velocity_measured[k] if plan.target_feedforward else 0.0

    for level in range(levels - 1, -1, -1):
        row = plan.ladder[first + level]
        if row[0] == AVOID_OBSTACLES and plan.outer == BARRIER_FILTER:  # which does that in its own way
            for k in range(p):
                parts[level, k] = 0.0
            continue
        rank = wish(i, row, plan, state, directions, weights, speeds, parts[level])
        if rank == INACTIVE:
            continue
        escort = row[0] != AVOID_OBSTACLES
        if not escort and row[SIDESTEP] > 0.0:
            sidestep(level, levels, row[SIDESTEP], directions[0], feedforward, parts)
        for lower in range(level + 1, levels):
            leave(rank, directions, weights, parts[lower])
        if not escort:
            avoiding = True
            leave(rank, directions, weights, feedforward)
            continue
        highest_escort = level
        if avoiding:  # an avoidance below has bent the feed-forward: only its remainder is projected
            for k in range(p):
                relative[k] = feedforward[k] - state.target_velocity_measured[k] * plan.target_feedforward
            leave(rank, directions, weights, relative)
            for k in range(p):
                feedforward[k] = state.target_velocity_measured[k] * plan.target_feedforward + relative[k]

    state.avoidance_active[i] = 1.0 if avoiding else 0.0
    total = state.v_d[i]
    for k in range(p):
        total[k] = 0.0
    for level in range(levels):
        if level == highest_escort:
            add_within_limit(total, feedforward, plan.max_speed)
        add_within_limit(total, parts[level], plan.max_speed)
    if highest_escort == levels:
        add_within_limit(total, feedforward, plan.max_speed)
