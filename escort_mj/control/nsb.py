"""Null-space-based composition of behaviors (paper eq. 2), eight robots at once, and the speed limit.

Every direction of a task is a Jacobian of one row x, so its pseudoinverse is x / |x|^2 and its null-space
projector I - x x^T / |x|^2: the composition needs dot products only. Chords in space have two such rows
(cycles) and sum over them: w' = sum_c [v_c + N_c w]. Where a task asks nothing of a robot its weight is 0, so
that nothing is projected out and no lane takes another way than its neighbors.

The part of each behavior is kept apart, p rows of lanes for each level of the priority stack, already
projected by everything of higher priority, so that the speed limit can be spent by priority.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import BEHAVIORS, AvoidObstacles, Behavior
from escort_mj.behaviors.avoid_obstacles import sidestep
from escort_mj.behaviors.wish import MAX_DIRECTIONS, MAX_LEVELS, Wish
from escort_mj.components.component import block_at, number_of, reader
from escort_mj.components.dispatch import one_of
from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.setup import MissionSetup
from escort_mj.control.custom.calls import custom_wishes
from escort_mj.knowledge.belief import target_velocity_rows
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, merged
from escort_mj.native.lanes import (
    Lanes,
    any_of,
    everywhere,
    greatest,
    least,
    load,
    load_rows,
    root,
    row_of,
    set_row,
    stack_rows,
    store,
    store_rows,
    there,
    where,
)
from escort_mj.plan import Plan, State

Mask = NDArray[np.bool_]

ROUNDING = 1e-12


class StackParameters(Fields):
    """The priority stacks of all phases: levels one below another, the most important first."""

    level_behavior: Annotated[Array, "levels", Value("1", "which behavior; their number for a plugin's")]
    level_place: Annotated[Array, "levels", Value("1", "where its block in `parameters` begins")]
    level_column: Annotated[Array, "levels", Value("1", "its column in what is recorded of tasks")]
    level_gain: Annotated[Array, "levels", Value("1/s", "rate at which its task's error decays")]
    level_in_world: Annotated[
        Array, "levels", Value("1", "1 where it wishes velocities in the world's frame, not the target's")
    ]
    level_avoids: Annotated[Array, "levels", Value("1", "1 where it avoids something")]
    alike: Annotated[bool, Value("1", "whether all robots run one stack at every step")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        behaviors = setup.all_behaviors
        return {
            "level_behavior": [number_of(behavior, BEHAVIORS) for behavior in behaviors],
            "level_column": [setup.kinds.index(behavior.behavior) for behavior in behaviors],
            "level_gain": [behavior.convergence for behavior in behaviors],
            "level_in_world": [behavior.frame == "world" for behavior in behaviors],
            "level_avoids": [behavior.avoids for behavior in behaviors],
            "alike": not (setup.phases or setup.failures or setup.trigger or setup.outside),
        }


@inlined
def ruled(i: int, phase: int, plan: Plan, state: State) -> Any:
    """Which of robots i to i + 7 run their outer loop now, by the priority stack of a phase."""
    here = there(state.q.shape[0] - i)
    if plan.alike:
        return here
    return here & (abs(load(state.phase, i) - float(phase)) < 0.5) & (load(state.fresh, i) > 0.5)


@merged
def compose(i: int, phase: int, plan: Plan, state: State) -> None:
    """Composes the behaviors of a phase in the order of its priority stack (eq. 2).

    Escort behaviors are relative to the target's motion (feed-forward), avoidance and goals are not:
    v_d = v1 + N1 [c_dot + v2 + N2 v3] for the paper's order.

    Args:
        i: First robot, from 0: i to i + 7, as far as the phase rules them.
        phase: Which phase.
        plan: What the controller knows.
        state: Its state; `v_d` and `avoidance_active` are written. Nothing is asked of robots that are lost.
    """
    p = state.q.shape[1]
    first, levels = int(plan.phase_first[phase]), int(plan.phase_levels[phase])
    parts, x = stack_rows(MAX_LEVELS * p), stack_rows(MAX_DIRECTIONS * p)
    carried, relative, speed = stack_rows(p), stack_rows(p), stack_rows(p)
    moving = 1.0 if plan.target_feedforward else 0.0
    target_velocity_rows(i, plan, state, speed)
    for k in range(p):
        set_row(carried, k, moving * row_of(speed, k))
    active, bent, highest = everywhere(0.0), everywhere(0.0), levels
    for level in range(levels - 1, -1, -1):
        escort = plan.level_in_world[first + level] == 0.0
        avoids = plan.level_avoids[first + level] != 0.0
        if avoids and plan.outer_avoids:
            for k in range(p):
                set_row(parts, p * level + k, everywhere(0.0))
            continue
        task = wish(i, first + level, plan, state, x, parts, p * level)
        if avoids:
            if not any_of(task.active > 0.5):
                continue
            active = greatest(active, task.active)
            if plan.level_behavior[first + level] == AVOID_OBSTACLES:
                share = avoidance_of(first + level, plan).sidestep
                if share > 0.0:
                    _spend(level + 1, highest, levels, carried, parts, plan.max_speed, relative)
                    sidestep(level, share, task.active, x, relative, parts)
        for lower in range(level + 1, levels):
            leave(p, task, x, parts, p * lower)
        if not escort:
            leave(p, task, x, carried, 0)
            bent = greatest(bent, task.active)
            continue
        highest = level
        if any_of(bent > 0.5):  # what is below has bent the feed-forward: its remainder is projected
            for k in range(p):
                set_row(relative, k, row_of(carried, k) - moving * row_of(speed, k))
            leave(p, task, x, relative, 0)
            for k in range(p):
                set_row(carried, k, moving * row_of(speed, k) + row_of(relative, k))
    _spend(0, highest, levels, carried, parts, plan.max_speed, relative)
    set_velocities(i, phase, relative, active, plan, state)


@inlined
def set_velocities(i: int, phase: int, velocity: Array, active: Lanes, plan: Plan, state: State) -> None:
    """Writes the reference velocities of those of robots i to i + 7 that a phase rules now.

    Args:
        i: First robot, from 0.
        phase: Which phase.
        velocity: In p rows of lanes [m/s]; changed.
        active: 1 for robots that avoid something, else 0.
        plan: As for `compose`.
        state: As for `compose`.
    """
    p = state.q.shape[1]
    if not plan.alike:
        mine, before = ruled(i, phase, plan, state), stack_rows(p)
        left = load(state.lost, i) < 0.5
        load_rows(state.v_d, i, before)
        for k in range(p):
            mended = where(left, row_of(velocity, k), 0.0)
            set_row(velocity, k, where(mine, mended, row_of(before, k)))
        active = where(mine, where(left, active, 0.0), load(state.avoidance_active, i))
    store(state.avoidance_active, i, active)
    store_rows(state.v_d, i, velocity)


@inlined
def wish(i: int, level: int, plan: Plan, state: State, x: Array, parts: Array, at: int) -> Wish:
    """What one behavior, by itself, wants of robots i to i + 7.

    Args:
        i: First robot, from 0.
        level: The behavior's level, of all phases' levels.
        plan: As for `compose`.
        state: As for `compose`; nothing is written.
        x: Result: the task's directions, in p rows of lanes each.
        parts: Result: the wished velocities [m/s], in p rows of lanes; 0 where the task is inactive.
        at: The first of these rows.
    """
    behavior, block = int(plan.level_behavior[level]), block_at(int(plan.level_place[level]), plan)
    return _wish_of(behavior, block, i, plan, state, x, parts, at)


def _wish_by(behavior: type[Behavior]) -> Callable[..., Any]:
    """Return the kernel that asks a behavior that ships."""
    ask, read = inlined(behavior.__dict__["wish_lanes"]), reader(behavior)

    def wish_by(block: int, i: int, plan: Plan, state: State, x: Array, parts: Array, at: int) -> Wish:
        found: Wish = ask(read(block, 0), i, plan, state, x, parts, at)
        return found

    return inlined(wish_by)


_wish_of = one_of([*map(_wish_by, BEHAVIORS), custom_wishes])
AVOID_OBSTACLES = BEHAVIORS.index(AvoidObstacles)
_read_avoidance = reader(AvoidObstacles)


@inlined
def avoidance_of(level: int, plan: Plan) -> Any:
    """Return the parameters of avoid_obstacles, of which a level is."""
    return _read_avoidance(block_at(int(plan.level_place[level]), plan), 0)


@inlined
def leave(p: int, task: Wish, x: Array, parts: Array, at: int) -> None:
    """Projects a part of lower priority into the null space of a task, in place.

    Args:
        p: Number of axes.
        task: The task.
        x: Its directions.
        parts: The part is in its p rows from `at` on.
        at: The first of them.
    """
    along, other = everywhere(0.0), everywhere(0.0)
    for k in range(p):
        along = along + row_of(x, k) * row_of(parts, at + k)
    along = along * task.weight
    if task.directions == MAX_DIRECTIONS:
        for k in range(p):
            other = other + row_of(x, p + k) * row_of(parts, at + k)
        other = other * task.second
        for k in range(p):
            rest = 2.0 * row_of(parts, at + k) - along * row_of(x, k) - other * row_of(x, p + k)
            set_row(parts, at + k, rest)
        return
    for k in range(p):
        removed = along * row_of(x, k)
        set_row(parts, at + k, where(task.across > 0.5, removed, row_of(parts, at + k) - removed))


@inlined
def _spend(
    level: int, highest: int, levels: int, carried: Array, parts: Array, max_speed: float, total: Array
) -> None:
    """Adds up the parts from one level down, each as far as the speed limit leaves room for it.

    Args:
        level: The first level.
        highest: That of the most important escort behavior: the feed-forward comes before it.
        levels: Number of levels.
        carried: What is left of the feed-forward, in p rows of lanes [m/s].
        parts: Parts by level, p rows each [m/s].
        max_speed: Limit [m/s]; `UNLIMITED` for none.
        total: Result, in p rows [m/s].
    """
    p = total.shape[0]
    for k in range(p):
        set_row(total, k, everywhere(0.0))
    for lower in range(level, levels):
        if lower == highest:
            _add_within_limit(total, carried, 0, max_speed)
        _add_within_limit(total, parts, p * lower, max_speed)
    if highest == levels:
        _add_within_limit(total, carried, 0, max_speed)


@inlined
def _add_within_limit(total: Array, parts: Array, at: int, max_speed: float) -> None:
    """Adds as much of a part as the speed limit leaves: total + alpha part, alpha in [0, 1] at its largest.

    Args:
        total: Velocity spent by higher priorities, in p rows of lanes [m/s]; changed in place.
        parts: Velocity wanted by this priority, in its rows from `at` on [m/s].
        at: The first of them.
        max_speed: Limit [m/s]; `UNLIMITED` for none.
    """
    p = total.shape[0]
    alpha = everywhere(1.0)
    if max_speed < UNLIMITED:
        a, b, c = everywhere(0.0), everywhere(0.0), everywhere(0.0)
        for k in range(p):
            a = a + row_of(parts, at + k) * row_of(parts, at + k)
            b = b + row_of(parts, at + k) * row_of(total, k)
            c = c + row_of(total, k) * row_of(total, k)
        room = max_speed * max_speed - c
        room = where(room < ROUNDING * max_speed * max_speed, 0.0, room)  # all is spent but rounding
        beyond = a + 2.0 * b > room
        if any_of(beyond):
            discriminant = root(b * b + a * room)
            within = where(b > 0.0, room, discriminant - b) / where(b > 0.0, discriminant + b, a)
            alpha = where(beyond, least(within, 1.0), alpha)
    for k in range(p):
        set_row(total, k, row_of(total, k) + alpha * row_of(parts, at + k))
