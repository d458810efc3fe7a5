"""The controller of the paper's figure 1, one evaluation at a time: measure, outer loop, inner loop.

`evaluate` is what the physics callback calls at every step. It may be called again at the same time
(MuJoCo does in `mj_forward`): the state advances only when time has.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.behaviors.avoid_obstacles import avoidance
from escort_mj.control.behaviors.distance import keep_distance
from escort_mj.control.behaviors.repulsion import repel
from escort_mj.control.behaviors.vertices import to_vertex, turn_figure
from escort_mj.control.laws.sliding import is_winding_up, smooth_signs
from escort_mj.control.noise import measure_with_noise
from escort_mj.control.nsb import add_within_limit, compose, keep_along, project
from escort_mj.control.plan import (
    AVOID_OBSTACLES,
    CHORDS,
    LAST_TIME,
    MAX_CYCLES,
    MAX_LEVELS,
    REPULSION,
    STARTED,
    VERTICES,
    Plan,
    State,
)
from escort_mj.control.program import evaluate as evaluate_program
from escort_mj.kernels import DOUBLE, inlined, matrix_at, stack_memory, vector_at

Array = NDArray[np.float64]


@inlined
def evaluate(plan: Plan, state: State) -> None:
    """One evaluation of the law: reads `time`, `q`, `v` of the state, writes all its control signals.

    Args:
        plan: What the controller is told.
        state: Its state; `tau` is the force demanded, `disturbance` the force that the plant is to add.
    """
    moved = advance(plan, state)
    follow_time(plan, state)
    measure(plan, state)
    n, p = state.q.shape
    for i in range(n):
        for k in range(p):
            state.e[i, k] = state.q_d[i, k] - state.q_measured[i, k]
    if moved and plan.vertices.shape[0] > 0:
        turn_figure(state.q_measured, state.target_position, plan.vertices, state.rotation)
    for i in range(n):
        outer_loop(i, plan, state)
    inner_loop(plan, state)


@inlined
def advance(plan: Plan, state: State) -> bool:
    """Integrates reference position and estimate over the step since the last evaluation (eqs. 8, 10).

    Returns:
        Whether this is the first evaluation at the present time.
    """
    n, p = state.q.shape
    time, clock = state.time[0], state.clock
    moved = False
    if clock[STARTED] == 0.0:
        moved = True
        for i in range(n):
            for k in range(p):
                state.q_d[i, k] = state.q[i, k]
                state.rho_hat[i, k] = plan.rho_hat_0
        for a in range(p):
            for b in range(p):
                state.rotation[a, b] = 1.0 if a == b else 0.0
        clock[STARTED] = 1.0
    elif time > clock[LAST_TIME]:
        moved = True
        for i in range(n):
            for k in range(p):
                state.q_d[i, k] += plan.timestep * state.q_d_rate[i, k]
                state.rho_hat[i, k] += plan.timestep * state.rho_hat_rate[i, k]
    clock[LAST_TIME] = time
    return moved


@inlined
def follow_time(plan: Plan, state: State) -> None:
    """Target and disturbance at the present time."""
    n, p = state.q.shape
    time = state.time[0]
    for k in range(p):
        state.target_position[k], state.target_velocity[k] = evaluate_program(
            plan.code, int(plan.target[k, 0]), int(plan.target[k, 1]), plan.pieces, time, state.stack
        )
        push, _ = evaluate_program(
            plan.code,
            int(plan.disturbance[k, 0]),
            int(plan.disturbance[k, 1]),
            plan.pieces,
            time,
            state.stack,
        )
        for i in range(n):
            state.disturbance[i, k] = push


@inlined
def measure(plan: Plan, state: State) -> None:
    """What the law is given: true positions and velocities plus noise from a ball (section 5)."""
    n, p = state.q.shape
    step = round(state.time[0] / plan.timestep)
    for i in range(n):
        for k in range(p):
            state.q_measured[i, k] = state.q[i, k]
            state.v_measured[i, k] = state.v[i, k]
    if plan.noise_position > 0.0 or plan.noise_velocity > 0.0:
        for i in range(n):
            measure_with_noise(
                i, state.q, state.v, state.q_measured, state.v_measured,
                plan.noise_position, plan.noise_velocity, plan.seed, step,
            )  # fmt: skip


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
    levels = plan.ladder.shape[0]
    highest_escort = levels
    avoiding = False
    for k in range(p):
        feedforward[k] = state.target_velocity[k] if plan.target_feedforward else 0.0

    for level in range(levels - 1, -1, -1):
        row = plan.ladder[level]
        if row[0] == AVOID_OBSTACLES:
            active, speeds[0] = avoidance(
                i, state.q_measured, state.v_measured, state.e,
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
                    plan.vertices, state.rotation, directions[0], parts[level],
                )  # fmt: skip
            else:
                weights[0] = repel(
                    i, state.q_measured, state.target_position, plan.radius, row[1],
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
            cycles = plan.predecessors.shape[0]
            for c in range(cycles):
                other = int(plan.predecessors[c, i])
                weights[c], speeds[c] = keep_distance(
                    state.q_measured[i], state.q_measured[other], plan.chord_length, row[1], directions[c]
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


@inlined
def inner_loop(plan: Plan, state: State) -> None:
    """Forces demanded of all robots and the rates of their state (eqs. 7, 9, 10, 17)."""
    n, p = state.q.shape
    switching = state.switching
    for i in range(n):
        for k in range(p):
            e_dot = state.v_d[i, k] - state.v_measured[i, k]
            s = e_dot + plan.slope * state.e[i, k]
            state.e_dot[i, k] = e_dot
            state.s[i, k] = s
            switching[i * p + k] = s / plan.boundary_layer
    smooth_signs(switching, plan.smoothing)
    for i in range(n):
        limit = plan.force_limit[i]
        for k in range(p):
            s = state.s[i, k]
            tau = (
                state.rho_hat[i, k]
                + plan.kp * state.e[i, k]
                + plan.kd * state.e_dot[i, k]
                + plan.k * switching[i * p + k]
            )
            held = plan.anti_windup and is_winding_up(tau, s, limit)
            state.tau[i, k] = tau
            state.rho_hat_rate[i, k] = 0.0 if held else plan.mu * s
            state.q_d_rate[i, k] = state.v_measured[i, k] if held else state.v_d[i, k]
