"""The outer loop (null-space-based behavioral control): what velocity each robot is to have."""

from __future__ import annotations

from escort_mj.control.behaviors.avoid_obstacles import avoidance
from escort_mj.control.behaviors.distance import keep_distance
from escort_mj.control.behaviors.repulsion import repel
from escort_mj.control.behaviors.vertices import to_vertex
from escort_mj.control.nsb import add_within_limit, compose, keep_along, project
from escort_mj.control.plan import (
    AVOID_OBSTACLES,
    CHORDS,
    MAX_CYCLES,
    MAX_LEVELS,
    REPULSION,
    VERTICES,
    Plan,
    State,
)
from escort_mj.kernels import DOUBLE, inlined, matrix_at, stack_memory, vector_at


@inlined
def outer_loop(i: int, plan: Plan, state: State) -> None:
    """Reference velocity of one robot: its behaviors composed in the order of the ladder (eq. 2).

    Escort behaviors are relative to the target's motion (feed-forward), avoidance is not:
    v_d = v1 + N1 [c_dot + v2 + N2 v3] for the paper's order.
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
    levels = plan.ladder.shape[0]
    highest_escort = levels
    avoiding = False
    for k in range(p):
        feedforward[k] = state.target_velocity[k] if plan.target_feedforward else 0.0

    for level in range(levels - 1, -1, -1):
        row = plan.ladder[level]
        if row[0] == AVOID_OBSTACLES:
            active, speeds[0] = avoidance(
                i, state.q_measured, state.v_measured, state.e, state.lost, plan.failures.shape[0] > 0,
                plan.obstacle_position, plan.obstacle_radius, plan.robot_radius,
                row, plan.slope, directions[0],
            )  # fmt: skip
            if active:
                avoiding = True
                weights[0] = 1.0
                compose(level, levels, 1, directions, weights, speeds, parts)
                project(1, directions, weights, feedforward)
            else:
                for k in range(p):
                    parts[level, k] = 0.0
            continue
        highest_escort = level
        if row[0] == VERTICES or row[0] == REPULSION:
            if row[0] == VERTICES:
                weights[0] = to_vertex(
                    i, state.q_measured, state.target_position, plan.radius, row[1],
                    state.vertices, state.rotation, directions[0], parts[level],
                )  # fmt: skip
            else:
                weights[0] = repel(
                    i, state.q_measured, state.target_position, state.lost, plan.radius, row[1],
                    directions[0], parts[level],
                )  # fmt: skip
            for lower in range(level + 1, levels):
                keep_along(directions[0], weights[0], parts[lower])
            if avoiding:
                for k in range(p):
                    relative[k] = feedforward[k] - state.target_velocity[k] * plan.target_feedforward
                keep_along(directions[0], weights[0], relative)
                for k in range(p):
                    feedforward[k] = state.target_velocity[k] * plan.target_feedforward + relative[k]
            continue
        cycles = 1
        if row[0] == CHORDS:
            cycles = state.predecessors.shape[0]
            for c in range(cycles):
                other = int(state.predecessors[c, i])
                weights[c], speeds[c] = keep_distance(
                    state.q_measured[i], state.q_measured[other], state.chord_length[0], row[1], directions[c]
                )
        else:
            weights[0], speeds[0] = keep_distance(
                state.q_measured[i], state.target_position, plan.radius, row[1], directions[0]
            )
        compose(level, levels, cycles, directions, weights, speeds, parts)
        if avoiding:  # an avoidance below has bent the feed-forward: only its remainder is projected
            for k in range(p):
                relative[k] = feedforward[k] - state.target_velocity[k] * plan.target_feedforward
            project(cycles, directions, weights, relative)
            for k in range(p):
                feedforward[k] = state.target_velocity[k] * plan.target_feedforward + relative[k]

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
