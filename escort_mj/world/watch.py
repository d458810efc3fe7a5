"""What happens in truth at every physics step: clearances, speeds, effort. The law reads none of it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.movers import obstacles_seen
from escort_mj.control.neighbors import candidate, number_of_candidates
from escort_mj.control.plan import WATCHED_STEP, Plan, State
from escort_mj.kernels import inlined, merged
from escort_mj.on_demand import on_demand
from escort_mj.scenario.bodies import GROUPS

Array = NDArray[np.float64]

NOBODY = -1.0
GROUP, SINGLE = 0, 1  # places in a row of `plan.columns`
MANY = len(GROUPS)  # what is watched beyond these are single bodies


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
    if state.target_clearance.shape[0] > MANY:
        _watch_single_bodies(plan, state, target_radius)
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
def _note(least: Array, nearest: Array, g: int, square: float, bodies: float, body: int) -> None:
    """Notes a distance where it is the least so far.

    A root is taken only of a distance that may be a new least one: few are.

    Args:
        least: Clearances by watched group [m].
        nearest: Bodies that were so near.
        g: Which of the groups.
        square: Squared distance, center to center [m^2].
        bodies: Sum of the two radii [m].
        body: Which body.
    """
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
    robots, target = int(plan.columns[0, GROUP]), int(plan.columns[n, GROUP])
    for i in range(n):
        square = 0.0
        for k in range(p):
            x = q[i, k] - state.target_position[k]
            square += x * x
        bodies = radius[i] + target_radius
        _note(state.clearance[i], state.clearance_body[i], target, square, bodies, n)
        _note(state.target_clearance, state.target_clearance_body, robots, square, bodies, i)
    for i in range(n + 1):  # the target last
        seen = obstacles_seen(i, plan, state)
        for j in range(plan.obstacle_radius.shape[0]):
            body = n + 1 + j
            g = int(plan.columns[body, GROUP])
            square = 0.0
            for k in range(p):
                x = (q[i, k] if i < n else state.target_position[k]) - seen[j, k]
                square += x * x
            bodies = plan.obstacle_radius[j] + (radius[i] if i < n else target_radius)
            if i < n:
                _note(state.clearance[i], state.clearance_body[i], g, square, bodies, body)
                if sampled:
                    state.obstacle_distance[i, j] = math.sqrt(square)
            else:
                _note(state.target_clearance, state.target_clearance_body, g, square, bodies, body)


@on_demand
def _watch_single_bodies(plan: Plan, state: State, target_radius: float) -> None:
    """Clearances to bodies that are watched by themselves."""
    n, p = state.q.shape
    for body in range(n + 1 + plan.obstacle_radius.shape[0]):
        g = int(plan.columns[body, SINGLE])
        if g < 0:
            continue
        for i in range(n + 1):  # the target last
            if i == body:
                continue
            square, bodies = 0.0, plan.robot_radius[i] if i < n else target_radius
            seen = obstacles_seen(i, plan, state)
            if body > n:
                bodies += plan.obstacle_radius[body - n - 1]
            else:
                bodies += plan.robot_radius[body] if body < n else target_radius
            for k in range(p):
                x = state.q[i, k] if i < n else state.target_position[k]
                if body > n:
                    x -= seen[body - n - 1, k]
                else:
                    x -= state.q[body, k] if body < n else state.target_position[k]
                square += x * x
            if i < n:
                _note(state.clearance[i], state.clearance_body[i], g, square, bodies, body)
            else:
                _note(state.target_clearance, state.target_clearance_body, g, square, bodies, body)


@merged
def _watch_robots(plan: Plan, state: State, sampled: bool) -> None:
    """Clearances between robots; in a step that is sampled also distances center to center."""
    q, radius, least, who = state.q, plan.robot_radius, state.clearance, state.clearance_body
    n, p = q.shape
    g = int(plan.columns[0, GROUP])
    if state.neighbors.shape[0] > 0:
        _watch_crowd(plan, state, sampled)
        return
    for i in range(n):
        for j in range(i):
            square = 0.0
            for k in range(p):
                x = q[i, k] - q[j, k]
                square += x * x
            bodies = radius[i] + radius[j]
            reach = max(least[i, g], least[j, g]) + bodies
            if square < reach * reach:
                clearance = math.sqrt(square) - bodies
                if clearance < least[i, g]:
                    least[i, g], who[i, g] = clearance, j
                if clearance < least[j, g]:
                    least[j, g], who[j, g] = clearance, i
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


@on_demand
def _watch_crowd(plan: Plan, state: State, sampled: bool) -> None:
    """As `_watch_robots`, by the lists of neighbors."""
    q, lists = state.q, state.neighbors
    n, p = q.shape
    g = int(plan.columns[0, GROUP])
    for i in range(n):
        nearest = math.inf
        for c in range(number_of_candidates(i, n, lists)):
            j = candidate(i, c, lists)
            if j == i:
                continue
            square = 0.0
            for k in range(p):
                x = q[i, k] - q[j, k]
                square += x * x
            nearest = min(nearest, square)
            bodies = plan.robot_radius[i] + plan.robot_radius[j]
            _note(state.clearance[i], state.clearance_body[i], g, square, bodies, j)
        if sampled:
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
