"""How the tasks of each robot get on with each other (paper eq. 19, remark 5): recorded, never acted upon."""

from __future__ import annotations

import math
from typing import Any

from escort_mj.behaviors.robots import Robots, robots_at
from escort_mj.behaviors.task import MAX_DIRECTIONS, MAX_LEVELS, Task, leave
from escort_mj.control.nsb import task_of, used_task
from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined, merged
from escort_mj.native.lanes import (
    Lanes,
    any_of,
    everywhere,
    gather,
    greatest,
    load,
    root,
    row_of,
    scatter,
    set_row,
    stack_rows,
    store,
    there,
)
from escort_mj.native.lanes import least as smaller
from escort_mj.native.on_demand import on_demand_unrolled
from escort_mj.native.vectors import MOST_AXES, Vec, dot, norm, part_at, set_part, where
from escort_mj.numerics.elementary import arc_cosine
from escort_mj.plan import Plan, State

NO_CONFLICT = math.pi / 2
TRAITS = 5  # of a task, beside its gradients: rows of scratch
NOBODY = -1.0  # ruling behavior of a robot whose behaviors are all inactive


@on_demand_unrolled
def weigh_tasks(i: int, plan: Plan, state: State) -> None:
    """Writes the task signals of robots i to i + 7: errors, wishes, what is removed, angles, who rules.

    Args:
        i: First robot, from 0.
        plan: What the controller knows.
        state: Its state; signals `task_...` and `ruling` are written.
    """
    behaviors = state.task_error.shape[1]
    every = plan.alike and int(plan.phase_levels[0]) == behaviors
    if not every:
        store(state.ruling, i, NOBODY)
        for column in range(i * behaviors, (i + 1) * behaviors):
            scatter(state.task_error, column, behaviors, 0.0)
            scatter(state.task_wish, column, behaviors, 0.0)
            scatter(state.task_removed, column, behaviors, 0.0)
            scatter(state.task_angle, column, behaviors, NO_CONFLICT)
    for phase in range(plan.phase_first.shape[0]):
        mine = there(state.q.shape[0] - i) & (load(state.lost, i) < 0.5)
        mine = mine & (abs(load(state.phase, i) - float(phase)) < 0.5)
        if any_of(mine):
            _weigh_phase(i, phase, every, plan, state)


@merged
def _weigh_phase(i: int, phase: int, every: bool, plan: Plan, state: State) -> None:
    """The task signals of those of robots i to i + 7 that a phase rules; `every`: all robots, all columns."""
    r, behaviors = robots_at(i, plan, state), state.task_error.shape[1]
    first, levels = int(plan.phase_first[phase]), int(plan.phase_levels[phase])
    wanted, parts = stack_rows(MAX_LEVELS * MOST_AXES), stack_rows(MAX_LEVELS * MOST_AXES)
    gradients, traits = stack_rows(MAX_LEVELS * MAX_DIRECTIONS * MOST_AXES), stack_rows(MAX_LEVELS * TRAITS)
    angles, ruling = stack_rows(MAX_LEVELS), everywhere(NOBODY)
    mine = r.there & (load(state.lost, i) < 0.5) & (abs(load(state.phase, i) - float(phase)) < 0.5)
    for level in range(levels - 1, -1, -1):
        place, at = plan.level_column[first + level], MOST_AXES * level
        column = i * behaviors + int(place)
        asked = task_of(first + level, r)
        task = used_task(first + level, asked, r)
        active = task.active > 0.5
        _write(state.task_wish, column, behaviors, mine & active, norm(task.velocity), 0.0, every)
        _write(state.task_error, column, behaviors, mine & (asked.active > 0.5), asked.error, 0.0, every)
        ruling = where(active, place, ruling)
        set_row(angles, level, everywhere(NO_CONFLICT))
        set_part(wanted, at, task.velocity)
        set_part(parts, at, task.velocity)
        for lower in range(level + 1, levels if any_of(active) else 0):
            other, angle = _kept(lower, gradients, traits, r), row_of(angles, lower)
            both = active & (other.active > 0.5)
            set_row(angles, lower, where(both, smaller(_angle(task, other), angle), angle))
            set_part(parts, MOST_AXES * lower, leave(task, part_at(state, parts, MOST_AXES * lower)))
        _keep(task, level, gradients, traits)
    store(state.ruling, i, ruling if every else where(mine, ruling, load(state.ruling, i)))
    for level in range(levels):
        column, at = i * behaviors + int(plan.level_column[first + level]), MOST_AXES * level
        removed = norm(part_at(state, wanted, at) - part_at(state, parts, at))
        _write(state.task_removed, column, behaviors, mine, removed, 0.0, every)
        _write(state.task_angle, column, behaviors, mine, row_of(angles, level), NO_CONFLICT, every)


@inlined
def _keep(task: Task, level: int, gradients: Array, traits: Array) -> None:
    """Keeps what angles take of a task in rows of scratch, by its level."""
    set_part(gradients, MAX_DIRECTIONS * MOST_AXES * level, task.x)
    set_part(gradients, MAX_DIRECTIONS * MOST_AXES * level + MOST_AXES, task.other)
    set_row(traits, TRAITS * level, task.weight)
    set_row(traits, TRAITS * level + 1, task.other_weight)
    set_row(traits, TRAITS * level + 2, task.across)
    set_row(traits, TRAITS * level + 3, task.active)
    set_row(traits, TRAITS * level + 4, everywhere(float(task.directions)))


@inlined
def _kept(level: int, gradients: Array, traits: Array, r: Robots) -> Task:
    """Return a task that is kept: what angles take of it."""
    x = part_at(r.state, gradients, MAX_DIRECTIONS * MOST_AXES * level)
    other = part_at(r.state, gradients, MAX_DIRECTIONS * MOST_AXES * level + MOST_AXES)
    weight, other_weight = row_of(traits, TRAITS * level), row_of(traits, TRAITS * level + 1)
    crosswise, active = row_of(traits, TRAITS * level + 2), row_of(traits, TRAITS * level + 3)
    directions = int(traits[TRAITS * level + 4, 0])
    nothing = everywhere(0.0)
    return Task(
        x, x, weight, other, other_weight, directions, crosswise, active, nothing, nothing, nothing, 0.0
    )  # fmt: skip


@inlined
def _write(
    signal: Array, column: int, behaviors: int, where_to: Any, value: Lanes, others: float, every: bool
) -> None:
    """Writes a signal of those robots that are meant; the others' is kept, or becomes what every one has."""
    left = everywhere(others) if every else gather(signal, column, behaviors)
    scatter(signal, column, behaviors, where(where_to, value, left))


@inlined
def _angle(task: Task, below: Task) -> Lanes:
    """Smallest angle between what two tasks move along [rad]; a right angle is no conflict (eq. 19).

    Args:
        task: The task above.
        below: The task below.
    """
    found = everywhere(0.0)
    for a in range(task.directions):
        x, u = _gradient(task, a)
        for b in range(below.directions):
            y, v = _gradient(below, b)
            share = abs(dot(x, y)) * root(u * v)
            if any_of(greatest(task.across, below.across) > 0.5):
                share = where(below.across > 0.5, _share_across(y, v, x, u), share)
                share = where(task.across > 0.5, _share_across(x, u, y, v), share)
                share = where((task.across > 0.5) & (below.across > 0.5), 1.0, share)
            found = greatest(share, found)
    return arc_cosine(smaller(found, 1.0))


@inlined
def _gradient(task: Task, number: int) -> tuple[Vec, Lanes]:
    """Return the gradient of one of a task's functions, and 1 / |x|^2 of it."""
    if number == 0:
        return task.x, task.weight
    return task.other, task.other_weight


@inlined
def _share_across(x: Vec, u: Lanes, y: Vec, v: Lanes) -> Lanes:
    """Share of y that is across x: sine of the angle between them, 0 where y is 0.

    Args:
        x: A vector.
        u: 1 / |x|^2.
        y: Another one.
        v: 1 / |y|^2.
    """
    rest = y - (dot(x, y) * u) * x
    share: Lanes = root(dot(rest, rest) * v)
    return share
