"""What happens in truth at every physics step: clearances, speeds, effort. The law reads none of it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.movers import obstacles_seen
from escort_mj.control.plan import WATCHED_STEP, Plan, State
from escort_mj.kernels import inlined, merged

Array = NDArray[np.float64]

NOBODY = -1.0


@inlined
def again(plan: Plan, state: State) -> bool:
    """Whether this step has been watched before: mj_forward at the same time brings nothing new."""
    return round(state.time[0] / plan.timestep) + 1.0 == state.clock[WATCHED_STEP]


@inlined
def watch(plan: Plan, state: State, target_radius: float, kinetic_energy: float) -> None:
    """Adds one solved physics step, one that was not watched before, to the record.

    Args:
        plan: Gives radii, limits, timestep and the sampling stride.
        state: `q`, `v`, `tau` and `force` are read; the record's worst and totals are written.
        target_radius: [m].
        kinetic_energy: Of all that moves freely [J].
    """
    step = round(state.time[0] / plan.timestep) + 1.0  # 0 is "never"
    clock = state.clock
    first = clock[WATCHED_STEP] == 0.0
    clock[WATCHED_STEP] = step
    if first or (int(step) - 2) % plan.stride == 0:
        _forget(state)
    state.kinetic_energy[0] = max(state.kinetic_energy[0], kinetic_energy)
    _watch_speeds(state)
    _watch_obstacles(plan, state, target_radius, (int(step) - 1) % plan.stride == 0)
    _watch_robots(plan, state, (int(step) - 1) % plan.stride == 0)
    _watch_effort(plan, state, first)


@merged
def _forget(state: State) -> None:
    """Begins a new sample: what was worst since the last one is no more."""
    state.kinetic_energy[0] = 0.0
    for g in range(state.target_clearance.shape[0]):
        state.target_clearance[g], state.target_clearance_body[g] = math.inf, NOBODY
        for i in range(state.q.shape[0]):
            state.clearance[i, g], state.clearance_body[i, g] = math.inf, NOBODY
    for i in range(state.q.shape[0]):
        state.speed_max[i] = 0.0


@merged
def _watch_speeds(state: State) -> None:
    """The largest speeds."""
    for i in range(state.q.shape[0]):
        square = 0.0
        for k in range(state.q.shape[1]):
            square += state.v[i, k] * state.v[i, k]
        if square > state.speed_max[i] * state.speed_max[i]:
            state.speed_max[i] = math.sqrt(square)


@inlined
def _note(least: Array, nearest: Array, columns: Array, square: float, bodies: float, body: int) -> None:
    """Notes a distance where it is the least so far: that of a body to one of its group, or to it alone.

    A root is taken only of a distance that may be a new least one: few are.

    Args:
        least: Clearances by watched group [m].
        nearest: Bodies that were so near.
        columns: The body's group among those watched, and its own place among them.
        square: Squared distance, center to center [m^2].
        bodies: Sum of the two radii [m].
        body: Which body.
    """
    for which in range(2):
        g = int(columns[which])
        if g >= 0:
            reach = least[g] + bodies
            if square < reach * reach:
                clearance = math.sqrt(square) - bodies
                if clearance < least[g]:
                    least[g], nearest[g] = clearance, body


@merged
def _watch_obstacles(plan: Plan, state: State, target_radius: float, sampled: bool) -> None:
    """Clearances to target and obstacles; in a step that is sampled also distances center to center."""
    q, radius = state.q, plan.robot_radius
    n, p = q.shape
    for i in range(n):
        square = 0.0
        for k in range(p):
            x = q[i, k] - state.target_position[k]
            square += x * x
        bodies = radius[i] + target_radius
        _note(state.clearance[i], state.clearance_body[i], plan.columns[n], square, bodies, n)
        _note(state.target_clearance, state.target_clearance_body, plan.columns[i], square, bodies, i)
    for i in range(n + 1):  # the target last
        seen = obstacles_seen(i, plan, state)
        for j in range(plan.obstacle_radius.shape[0]):
            body = n + 1 + j
            square = 0.0
            for k in range(p):
                x = (q[i, k] if i < n else state.target_position[k]) - seen[j, k]
                square += x * x
            bodies = plan.obstacle_radius[j] + (radius[i] if i < n else target_radius)
            column = plan.columns[body]
            if i < n:
                _note(state.clearance[i], state.clearance_body[i], column, square, bodies, body)
                if sampled:
                    state.obstacle_distance[i, j] = math.sqrt(square)
            else:
                _note(state.target_clearance, state.target_clearance_body, column, square, bodies, body)


@merged
def _watch_robots(plan: Plan, state: State, sampled: bool) -> None:
    """Clearances between robots; in a step that is sampled also distances center to center."""
    q, radius = state.q, plan.robot_radius
    n, p = q.shape
    for i in range(n):
        for j in range(i):
            square = 0.0
            for k in range(p):
                x = q[i, k] - q[j, k]
                square += x * x
            bodies = radius[i] + radius[j]
            _note(state.clearance[i], state.clearance_body[i], plan.columns[j], square, bodies, j)
            _note(state.clearance[j], state.clearance_body[j], plan.columns[i], square, bodies, i)
    if sampled:
        for i in range(n):
            nearest = math.inf
            for j in range(n):
                square = 0.0
                for k in range(p):
                    x = q[i, k] - q[j, k]
                    square += x * x
                if j != i:
                    nearest = min(nearest, square)
            state.robot_distance_min[i] = math.sqrt(nearest)


@merged
def _watch_effort(plan: Plan, state: State, first: bool) -> None:
    """Running totals of what the motors did."""
    n, p = state.q.shape
    for i in range(n):
        saturated = False
        for k in range(p):
            force = state.force[i, k]
            saturated = saturated or abs(state.tau[i, k]) > plan.force_limit[i]
            state.effort[i] += plan.timestep * force * force
            state.work[i] += plan.timestep * abs(force * state.v[i, k])
            if not first:
                state.force_variation[i] += abs(force - state.force_before[i, k])
            state.force_before[i, k] = force
        if saturated:
            state.saturated_time[i] += plan.timestep
