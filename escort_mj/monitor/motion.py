"""How fast everything moved since the last sample, and what motors and drives did: a part of the watch."""

from __future__ import annotations

import math
from typing import Annotated

from escort_mj.components.movers import COMES, TARGET
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, merged
from escort_mj.native.lanes import (
    WIDTH,
    any_of,
    copy_lanes,
    everywhere,
    greatest,
    load,
    load_rows,
    root,
    row_of,
    stack_rows,
    store,
    where,
)
from escort_mj.plan import Plan, State


class MotionState(Fields):
    """What the step before brought."""

    force_before: Annotated[Array, "n", "p", Value("N", "force of the step before, for its variation")]
    target_before: Annotated[Array, "p", Value("m", "where the target was, for its displacement")]
    mover_before: Annotated[Array, "movers", "p", Value("m", "where moving bodies were, likewise")]


@merged
def watch_motion(plan: Plan, state: State, first: bool) -> None:
    """The largest speeds, and running totals of what the motors did; eight robots at once."""
    n, p = state.q.shape
    dt = plan.timestep
    velocity, forces, before, demand = stack_rows(p), stack_rows(p), stack_rows(p), stack_rows(p)
    for i in range(0, n, WIDTH):
        square, effort, power = everywhere(0.0), everywhere(0.0), everywhere(0.0)
        variation, wanted = everywhere(0.0), everywhere(0.0)
        load_rows(state.v, i, velocity)
        load_rows(state.force, i, forces)
        load_rows(state.force_before, i, before)
        load_rows(state.tau, i, demand)
        for k in range(p):
            v, force = row_of(velocity, k), row_of(forces, k)
            square = square + v * v
            effort = effort + force * force
            power = power + force * v
            variation = variation + abs(force - row_of(before, k))
            wanted = greatest(wanted, abs(row_of(demand, k)))
        fastest = load(state.speed_max, i)
        faster = square > fastest * fastest
        if any_of(faster):
            store(state.speed_max, i, where(faster, root(square), fastest))
        store(state.effort, i, load(state.effort, i) + dt * effort)
        store(state.work, i, load(state.work, i) + dt * abs(power))
        if not first:
            store(state.force_variation, i, load(state.force_variation, i) + variation)
        saturated = where(wanted > load(plan.force_limit, i), dt, 0.0)
        store(state.saturated_time, i, load(state.saturated_time, i) + saturated)
    copy_lanes(state.force, state.force_before, n * p)


@inlined
def watch_displacements(plan: Plan, state: State, first: bool) -> None:
    """The largest displacements of target and moving obstacles, and the work of what drives them.

    What is led may jump, whatever its speed.
    """
    _watch_displacement(
        state.target_position, state.target_before, state.target_speed_max, 0, plan.timestep, first
    )
    for b in range(plan.mover_obstacle.shape[0]):
        _watch_drive(b, plan, state)
        obstacle = int(plan.mover_obstacle[b])
        if obstacle != TARGET:
            here, before = state.mover_position[b], state.mover_before[b]
            _watch_displacement(here, before, state.obstacle_speed_max, obstacle, plan.timestep, first)


@inlined
def _watch_drive(b: int, plan: Plan, state: State) -> None:
    """Adds the work of the force that drives a body in this step; of an opponent only on its way."""
    opponent, power = int(plan.mover_opponent[b]), 0.0
    if opponent < 0 or state.opponent_status[opponent] == COMES:
        for k in range(state.q.shape[1]):
            power += state.mover_force[b, k] * state.mover_velocity[b, k]
        state.mover_work[b] += plan.timestep * abs(power)


@inlined
def _watch_displacement(
    here: Array, before: Array, fastest: Array, body: int, timestep: float, first: bool
) -> None:
    """Notes how far one body came since the step before, over the timestep [m/s]."""
    square, least = 0.0, fastest[body] * timestep
    for k in range(here.shape[0]):
        square += (here[k] - before[k]) ** 2
        before[k] = here[k]
    if square > least * least and not first:
        fastest[body] = math.sqrt(square) / timestep
