"""The reference velocities of eight robots: the paper's outer loop, or one of the baselines in its place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import AvoidObstacles, Behavior
from escort_mj.behaviors.task import Situation
from escort_mj.behaviors.wish import MAX_DIRECTIONS
from escort_mj.components.component import OUTSIDE
from escort_mj.components.obstacles import obstacles_seen
from escort_mj.components.parameters import UNLIMITED
from escort_mj.control.nsb import (
    AVOID_OBSTACLES,
    compose,
    outer_loop,
    parameters_at,
    read_avoidance,
    ruled,
    set_velocities,
    wish,
)
from escort_mj.control.outer_loops import BARRIER_FILTER, POTENTIAL_FIELD, BarrierFilter, PotentialField
from escort_mj.control.outer_loops.barrier_filter import filter_velocity, filtered
from escort_mj.control.outer_loops.potential_field import repulsion, repulsions
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, merged, stack_memory, vector_at
from escort_mj.native.lanes import WIDTH, any_of, everywhere, load, row_of, set_row, stack_rows, store, where
from escort_mj.native.on_demand import on_demand

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State

Mask = NDArray[np.bool_]


class OuterLoopParameters(Fields):
    """How behaviors become one velocity."""

    outer: Annotated[int, Value("1", "place in OUTER_LOOPS; OUTSIDE for none")]
    outer_gain: Annotated[float, Value("m^4/s or 1/s", "of the repulsion, or rate of the filter")]
    outer_distance: Annotated[float, Value("m", "below which repulsion grows no further")]


@inlined
def reference_velocities(i: int, plan: Plan, state: State, moved: bool) -> None:
    """Computes the reference velocities of those robots that run their outer loop now.

    Args:
        i: First robot, from 0: i to i + 7, as far as there are so many.
        plan: What the controller knows.
        state: Its state; `v_d`, `avoidance_active` and `outer_updates` are written.
        moved: Whether this is the first evaluation at the present time.
    """
    for phase in range(plan.phase_first.shape[0]):
        if not any_of(ruled(i, phase, plan, state)):
            continue
        if plan.outer == POTENTIAL_FIELD:
            _add_up(i, phase, plan, state)
        elif plan.outer != OUTSIDE:
            compose(i, phase, plan, state)
        if plan.outer == BARRIER_FILTER:
            _filter(i, phase, plan, state)
        if moved:
            runs = ruled(i, phase, plan, state) & (load(state.lost, i) < 0.5)
            store(state.outer_updates, i, load(state.outer_updates, i) + where(runs, 1.0, everywhere(0.0)))


@on_demand
def _add_up(i: int, phase: int, plan: Plan, state: State) -> None:
    """Potential fields: the sum of all wishes and repulsions, slowed down where it is too fast."""
    n, p = state.q.shape
    first, levels = int(plan.phase_first[phase]), int(plan.phase_levels[phase])
    x, part, total = stack_rows(MAX_DIRECTIONS * p), stack_rows(p), stack_rows(p)
    for k in range(p):
        set_row(total, k, everywhere(state.target_velocity_measured[k] if plan.target_feedforward else 0.0))
    for level in range(first, first + levels):
        if plan.level_in_world[level] == 0.0:
            wish(i, level, plan, state, x, part, 0)
            for k in range(p):
                set_row(total, k, row_of(total, k) + row_of(part, k))
    set_velocities(i, phase, total, everywhere(0.0), plan, state)
    for robot in range(i, min(i + WIDTH, n)):
        if not _runs(robot, phase, plan, state):
            continue
        for level in range(first, first + levels):
            if plan.level_behavior[level] == AVOID_OBSTACLES:
                avoid = read_avoidance(parameters_at(level, plan), 0)
                repelled = repulsion(
                    robot, state.q_measured, state.lost, obstacles_seen(robot, plan, state),
                    plan.obstacle_radius, plan.robot_radius, avoid, plan.outer_gain, plan.outer_distance,
                    vector_at(stack_memory(), p), state.v_d[robot],
                )  # fmt: skip
                state.avoidance_active[robot] = 1.0 if repelled else 0.0
        _slow_down(robot, plan, state)


@on_demand
def _filter(i: int, phase: int, plan: Plan, state: State) -> None:
    """Barrier filter: changes the velocity of the escort behaviors by as little as safety takes.

    Slowing down the result breaks no constraint unless a distance is too small already: rest keeps them.
    """
    first, levels = int(plan.phase_first[phase]), int(plan.phase_levels[phase])
    for robot in range(i, min(i + WIDTH, state.q.shape[0])):
        if not _runs(robot, phase, plan, state):
            continue
        moved = False
        for level in range(first, first + levels):
            if plan.level_behavior[level] == AVOID_OBSTACLES:
                avoid = read_avoidance(parameters_at(level, plan), 0)
                moved = filter_velocity(
                    robot, state.q_measured, state.lost, obstacles_seen(robot, plan, state),
                    plan.obstacle_radius, plan.robot_radius, avoid, plan.sensing_robots,
                    plan.sensing_obstacles, plan.outer_gain, state.v_d[robot],
                )  # fmt: skip
        state.avoidance_active[robot] = 1.0 if moved else 0.0
        _slow_down(robot, plan, state)


@merged
def _runs(robot: int, phase: int, plan: Plan, state: State) -> bool:
    """Whether a robot is left and runs its outer loop now, by the ladder of a phase."""
    now = plan.alike or (int(state.phase[robot]) == phase and state.fresh[robot] != 0.0)
    return now and state.lost[robot] == 0.0


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


# The same in plain NumPy.


def reference_velocity(behaviors: tuple[Behavior, ...], now: Situation) -> tuple[Array, Mask]:
    """The outer loop that the mission asks for; arguments and results as of `outer.outer_loop`."""
    setup, q, lost = now.setup, now.q, now.team.lost
    loop = setup.outer
    escorting = tuple(b for b in behaviors if b.frame == "target")
    avoiding = [b for b in behaviors if isinstance(b, AvoidObstacles)]
    active = np.zeros(len(q), dtype=bool)
    if isinstance(loop, BarrierFilter):
        velocity, _ = outer_loop(escorting, now)
        for avoid in avoiding:
            velocity, active = filtered(loop, avoid, velocity, q, setup, lost)
    elif isinstance(loop, PotentialField):
        velocity = np.tile(now.c_dot * setup.target_feedforward, (len(q), 1))
        for behavior in escorting:
            velocity = velocity + behavior.velocity(now)
        for avoid in avoiding:
            push, active = repulsions(loop, avoid, q, setup, lost)
            velocity = velocity + push
    else:
        return outer_loop(behaviors, now)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(speed > setup.max_speed, setup.max_speed / speed, 1.0)
    return velocity * share, active
