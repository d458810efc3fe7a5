"""What happens in truth at every physics step: clearances, contacts, effort. The law reads none of it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.plan import CONTACTS_BEFORE, WATCHED_STEP, Plan, State
from escort_mj.kernels import inlined, merged

Array = NDArray[np.float64]


@inlined
def watch(plan: Plan, state: State, contacts: int, contact_force: float) -> None:
    """Adds one solved physics step to the record.

    Args:
        plan: Gives radii, limits, timestep and the sampling stride.
        state: `q`, `v`, `tau`, `force` and the keys of the pairs that touch in this step are read; the
            record's worst and totals are written.
        contacts: Pairs of bodies that touch in this step.
        contact_force: Their largest normal force [N].
    """
    step = round(state.time[0] / plan.timestep) + 1.0  # 0 is "never"
    clock = state.clock
    first = clock[WATCHED_STEP] == 0.0
    again = step == clock[WATCHED_STEP]  # mj_forward at the same time: nothing new has happened
    clock[WATCHED_STEP] = step
    if first or (not again and (int(step) - 2) % plan.stride == 0):
        state.contacts[0] = 0.0
        state.contact_force[0] = 0.0
        for i in range(state.q.shape[0]):
            state.obstacle_clearance_worst[i] = math.inf
            state.robot_clearance_worst[i] = math.inf
    _watch_distances(plan, state, (int(step) - 1) % plan.stride == 0)
    state.contacts[0] = max(state.contacts[0], contacts)
    state.contact_force[0] = max(state.contact_force[0], contact_force)
    if not again:
        state.contact_onsets[0] += _onsets(state, min(contacts, state.touching.shape[1]))
        _watch_effort(plan, state, first)


@merged
def overlaps(plan: Plan, state: State, target_radius: float) -> int:
    """Finds the pairs of bodies that overlap in all axes: contacts, where MuJoCo can find none.

    In more than three axes a body's parts may lie on another's while the two are far apart.

    Args:
        plan: Gives obstacles and radii.
        state: `q` and `target_position` are read, the keys of the pairs are written to `touching`.
        target_radius: [m].

    Returns:
        How many pairs overlap; those beyond the size of `touching` have no key.
    """
    n, m = state.q.shape[0], plan.obstacle_radius.shape[0]
    found = 0
    for i in range(n):
        for j in range(i + m + 1):
            if j < i:
                other, radius = state.q[j], plan.robot_radius[j]
            elif j < i + m:
                other, radius = plan.obstacle_position[j - i], plan.obstacle_radius[j - i]
            else:
                other, radius = state.target_position, target_radius
            square = 0.0
            for k in range(state.q.shape[1]):
                square += (state.q[i, k] - other[k]) ** 2
            if square < (plan.robot_radius[i] + radius) ** 2:
                if found < state.touching.shape[1]:
                    state.touching[1, found] = i * (n + m + 1) + j
                found += 1
    return found


@merged
def _onsets(state: State, contacts: int) -> int:
    """How many of this step's touching pairs did not touch in the step before, which they then become."""
    before, now = state.touching[0], state.touching[1]
    known = int(state.clock[CONTACTS_BEFORE])
    begun = 0
    for c in range(contacts):
        old = False
        for k in range(known):
            old = old or before[k] == now[c]
        begun += 0 if old else 1
    for c in range(contacts):
        before[c] = now[c]
    state.clock[CONTACTS_BEFORE] = contacts
    return begun


@merged
def _watch_distances(plan: Plan, state: State, sampled: bool) -> None:
    """The worst clearances surface to surface; in a step that is sampled also all distances center to center.

    A root is taken only of a distance that may be a new worst one: few are.
    """
    q, radius = state.q, plan.robot_radius
    obstacle_worst, robot_worst = state.obstacle_clearance_worst, state.robot_clearance_worst
    n, p = q.shape
    for i in range(n):
        for j in range(plan.obstacle_radius.shape[0]):
            square = 0.0
            for k in range(p):
                x = q[i, k] - plan.obstacle_position[j, k]
                square += x * x
            bodies = radius[i] + plan.obstacle_radius[j]
            reach = obstacle_worst[i] + bodies
            if square < reach * reach:
                obstacle_worst[i] = min(obstacle_worst[i], math.sqrt(square) - bodies)
            if sampled:
                state.obstacle_distance[i, j] = math.sqrt(square)
        for j in range(i):
            square = 0.0
            for k in range(p):
                x = q[i, k] - q[j, k]
                square += x * x
            bodies = radius[i] + radius[j]
            reach = max(robot_worst[i], robot_worst[j]) + bodies
            if square < reach * reach:
                clearance = math.sqrt(square) - bodies
                robot_worst[i] = min(robot_worst[i], clearance)
                robot_worst[j] = min(robot_worst[j], clearance)
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
