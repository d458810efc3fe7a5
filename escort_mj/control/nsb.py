"""Null-space-based composition of behaviors (paper eq. 2), eight robots at once, and the speed limit.

Every direction of a task is a Jacobian of one row x, so its pseudoinverse is x / |x|^2 and its null-space
projector I - x x^T / |x|^2: the composition needs dot products only. Chords in space have two such rows
(cycles) and sum over them: w' = sum_c [v_c + N_c w]. Where a task asks nothing of a robot its weight is 0, so
that nothing is projected out and all lanes run the same instructions.

The part of each behavior is kept apart, p rows of lanes for each level of the priority stack, already
projected by everything of higher priority, so that the speed limit can be spent by priority.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import BEHAVIORS, Behavior
from escort_mj.behaviors.avoid_obstacles import POLAR
from escort_mj.behaviors.behavior import Avoidance
from escort_mj.behaviors.robots import Robots, robots_at
from escort_mj.behaviors.task import MAX_LEVELS, Task, along, as_task, enforced, inverse_square, leave, only
from escort_mj.components.component import block_at, number_of, reader
from escort_mj.components.dispatch import one_of
from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.setup import MissionSetup
from escort_mj.control.custom.calls import custom_task
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, inlined_once, merged
from escort_mj.native.lanes import (
    Lanes,
    any_of,
    everywhere,
    greatest,
    least,
    load,
    room_for,
    root,
    stack_rows,
    store,
    there,
)
from escort_mj.native.vectors import MOST_AXES, Vec, dot, part_at, set_part, set_rows, turned, where
from escort_mj.plan import Plan, State

Mask = NDArray[np.bool_]

ROUNDING = 1e-12
NONE = Avoidance(0.0)


class StackParameters(Fields):
    """The priority stacks of all phases: levels one below another, the most important first."""

    level_behavior: Annotated[Array, "levels", Value("1", "which behavior; their number for a plugin's")]
    level_place: Annotated[Array, "levels", Value("1", "where its block in `parameters` begins")]
    level_memory: Annotated[Array, "levels", Value("1", "where its own memory begins")]
    level_column: Annotated[Array, "levels", Value("1", "its column in what is recorded of tasks")]
    level_gain: Annotated[Array, "levels", Value("1/s", "rate at which its task's error decays")]
    level_in_world: Annotated[
        Array, "levels", Value("1", "1 where its velocities are in the world's frame, not the target's")
    ]
    level_avoids: Annotated[Array, "levels", Value("1", "1 where it keeps distances to bodies")]
    level_avoidance: Annotated[
        Array, "levels", len(Avoidance._fields), Value("m or 1", "these distances, see `Avoidance`")
    ]
    level_limit_row: Annotated[
        Array, "levels", Value("1", "row of `limit_x` where an inequality begins; -1 for other tasks")
    ]
    alike: Annotated[bool, Value("1", "whether all robots run one stack at every step")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        behaviors = setup.all_behaviors
        avoidance = [behavior.avoidance(setup) for behavior in behaviors]
        return {
            "level_behavior": [number_of(behavior, BEHAVIORS) for behavior in behaviors],
            "level_place": behaviors,
            "level_memory": setup.memory_rows("behaviors"),
            "level_column": [setup.kinds.index(behavior.behavior) for behavior in behaviors],
            "level_gain": [behavior.convergence for behavior in behaviors],
            "level_in_world": [behavior.frame == "world" for behavior in behaviors],
            "level_avoids": [each is not None for each in avoidance],
            "level_avoidance": [each or NONE for each in avoidance],
            "level_limit_row": _limit_rows(setup),
            "alike": not (setup.phases or setup.failures or setup.trigger or not setup.led),
        }


class LimitState(Fields):
    """Inequalities of the priority stacks, whole lanes of robots for each: for outer loops that need them."""

    limit_x: Annotated[Array, "limited", "p", Value("1", "gradient of the function that has a bound")]
    limit_rate: Annotated[Array, "limited", Value("m/s", "least rate of it, over the gradient's length")]
    limit_velocity: Annotated[
        Array, "limited", "p", Value("m/s", "velocity along it in place of what tasks below it want")
    ]
    limit_active: Annotated[Array, "limited", Value("1", "1 where the inequality is enforced")]


def _limit_rows(setup: MissionSetup) -> list[float]:
    """Return the row where the inequality of each level begins; -1 for other tasks."""
    rows: list[float] = []
    room = room_for(setup.count)
    for behavior in setup.all_behaviors:
        before = sum(row >= 0.0 for row in rows)
        rows.append(float(room * before) if behavior.limits else -1.0)
    return rows


@inlined
def stacked(i: int, phase: int, plan: Plan, state: State) -> Any:
    """Which of robots i to i + 7 have the priority stack of a phase; some may hold what it last gave them."""
    here = there(state.q.shape[0] - i)
    return here if plan.alike else here & (abs(load(state.phase, i) - float(phase)) < 0.5)


@inlined
def ruled(i: int, phase: int, plan: Plan, state: State) -> Any:
    """Which of robots i to i + 7 run their outer loop now, by the priority stack of a phase."""
    mine = stacked(i, phase, plan, state)
    return mine if plan.alike else mine & (load(state.fresh, i) > 0.5)


@merged
def compose(i: int, phase: int, plan: Plan, state: State) -> None:
    """Compose the behaviors of a phase in the order of its priority stack (eq. 2).

    Escort behaviors are relative to the target's motion (feed-forward), avoidance and goals are not:
    v_d = v1 + N1 [c_dot + v2 + N2 v3] for the paper's order. The lowest priority comes first: each behavior
    projects the parts below it, and, where it is in the world's frame, what is left of the feed-forward.

    Args:
        i: First robot, from 0: i to i + 7, as far as the phase rules them.
        phase: Which phase.
        plan: What the controller knows.
        state: Its state; `v_d` and `avoidance_active` are written. Nothing is asked of robots that are lost.
    """
    r, parts = robots_at(i, plan, state), stack_rows(MAX_LEVELS * MOST_AXES)
    first, levels = int(plan.phase_first[phase]), int(plan.phase_levels[phase])
    moving = 1.0 if plan.target_feedforward else 0.0
    drift = moving * r.target_velocity
    feedforward = drift  # what behaviors so far leave of it
    first_escort = levels  # none yet: level of the most important escort behavior so far
    projected = everywhere(0.0)  # 1 where the feed-forward has lost a part to a task in the world's frame
    active = everywhere(0.0)
    for level in range(levels - 1, -1, -1):
        escort = plan.level_in_world[first + level] == 0.0
        avoids = plan.level_avoids[first + level] != 0.0
        if avoids and plan.outer_avoids:
            set_part(parts, MOST_AXES * level, 0.0 * drift)
            continue
        task = task_of(first + level, r)
        row = int(plan.level_limit_row[first + level])
        if avoids and row < 0 and not any_of(task.active > 0.5):
            set_part(parts, MOST_AXES * level, task.velocity)
            continue
        if row >= 0:
            wanted = _limited_sum(level + 1, first_escort, levels, feedforward, parts, r)
            task = enforce(first + level, task, wanted, drift if escort else 0.0 * drift, r)
        velocity = task.velocity
        if avoids:
            active = greatest(active, task.active)
        if task.sidestep > 0.0:
            wanted = _limited_sum(level + 1, first_escort, levels, feedforward, parts, r)
            velocity = velocity + sidestep(task, wanted, state.q.shape[1])
        set_part(parts, MOST_AXES * level, velocity)
        for lower in range(level + 1, levels):
            set_part(parts, MOST_AXES * lower, leave(task, part_at(state, parts, MOST_AXES * lower)))
        if not escort:
            feedforward = leave(task, feedforward)
            projected = greatest(projected, task.active)
            continue
        first_escort = level
        if any_of(projected > 0.5):  # escort tasks project only what tasks in the world's frame have taken
            feedforward = drift + leave(task, feedforward - drift)
    set_velocities(phase, _limited_sum(0, first_escort, levels, feedforward, parts, r), active, r)


@inlined
def enforce(level: int, task: Task, wanted: Vec, frame: Vec, r: Robots) -> Task:
    """Return the task that an inequality is above other tasks, and keep it for outer loops and records.

    Args:
        level: Its level, of all phases' levels.
        task: That of the inequality by itself.
        wanted: What the other tasks want [m/s].
        frame: Velocity of the behavior's frame [m/s].
        r: The robots.
    """
    row, used = int(r.plan.level_limit_row[level]) + r.i, enforced(task, wanted - frame)
    set_rows(r.state.limit_x, row, used.x)
    set_rows(r.state.limit_velocity, row, used.velocity)
    store(r.state.limit_active, row, used.active)
    store(r.state.limit_rate, row, used.least_rate + dot(used.x, frame))
    return used


@inlined
def used_task(level: int, task: Task, r: Robots) -> Task:
    """Return the task of a level as it was used: of an inequality, what it was above other tasks.

    Args:
        level: Of all phases' levels.
        task: That of its behavior by itself.
        r: The robots.
    """
    row = int(r.plan.level_limit_row[level])
    if row < 0:
        return task
    velocity, active = r.at(r.state.limit_velocity, row), load(r.state.limit_active, row + r.i)
    used = along(task.x, inverse_square(task.x), velocity, active, task.error, task.value)
    return only(active > 0.5, used)


@inlined
def set_velocities(phase: int, velocity: Vec, active: Lanes, r: Robots) -> None:
    """Write the reference velocities of those robots that run the stack of a phase now.

    Args:
        phase: Which phase.
        velocity: Theirs [m/s].
        active: 1 for robots that avoid something, else 0.
        r: The robots.
    """
    i, plan, state = r.i, r.plan, r.state
    if not plan.alike:
        mine, left = ruled(i, phase, plan, state), load(state.lost, i) < 0.5
        velocity = where(mine, where(left, velocity, 0.0), r.at(state.v_d, 0))
        active = where(mine, where(left, active, 0.0), load(state.avoidance_active, i))
    store(state.avoidance_active, i, active)
    set_rows(state.v_d, i, velocity)


@inlined
def task_of(level: int, r: Robots) -> Task:
    """Return what one behavior, by itself, asks of robots.

    Args:
        level: The behavior's level, of all phases' levels.
        r: The robots.
    """
    found: Task = _task_of(int(r.plan.level_behavior[level]), level, r)
    return found


def _task_by(behavior: type[Behavior]) -> Callable[..., Any]:
    """Return the kernel that asks a behavior that ships."""
    ask, read = inlined_once(vars(behavior)["task"]), reader(behavior)

    def task_by(level: int, r: Robots) -> Task:
        found: Task = ask(read(block_at(int(r.plan.level_place[level]), r.plan), 0), r)
        return found

    def task_of_limit(level: int, r: Robots) -> Task:
        return as_task(ask(read(block_at(int(r.plan.level_place[level]), r.plan), 0), r))

    return inlined(task_of_limit if behavior.limits else task_by)


_task_of = one_of([*map(_task_by, BEHAVIORS), custom_task])


@inlined
def avoidance_of(level: int, plan: Plan) -> Avoidance:
    """Return what distances to bodies the behavior of a level keeps."""
    numbers = plan.level_avoidance[level]
    return Avoidance(numbers[0], numbers[1], numbers[2], numbers[3], numbers[4])


@inlined
def sidestep(task: Task, wanted: Vec, axes: int) -> Vec:
    """Return a velocity around what robots avoid, where it blocks head-on what behaviors below it want.

    What these leave across the gradient x, a unit vector away from the body, is filled up to a share of what
    avoidance blocks of them. All robots turn the same way around whatever they meet (counterclockwise in the
    plane), so that two that meet head-on pass each other. Along x nothing changes: J1 v_d stays lambda
    sigma~.

    Args:
        task: That of avoidance.
        wanted: Velocity that robots would have without it, cut to the speed limit [m/s].
        axes: Number of axes.
    """
    outward, square = dot(wanted, task.x), dot(wanted, wanted)
    speed = -task.sidestep * outward - root(greatest(square - outward * outward, 0.0))
    speed = where(speed > 0.0, speed, 0.0) * task.active
    if axes % 2 == 0:
        return speed * turned(task.x, 0)
    # Axes are turned in pairs; of an odd number one has no partner: not the one that x points along.
    polar = abs(task.x[-1]) > POLAR
    return where(polar, 0.0, speed) * turned(task.x, 0) + where(polar, speed, 0.0) * turned(task.x, 1)


@inlined
def _limited_sum(
    level: int, first_escort: int, levels: int, feedforward: Vec, parts: Array, r: Robots
) -> Vec:
    """Return the sum of the parts from one level down, each as far as the speed limit leaves room for it.

    Args:
        level: The first level.
        first_escort: That of the most important escort behavior: the feed-forward comes before it.
        levels: Number of levels.
        feedforward: What is left of it [m/s].
        parts: Parts by level, in rows of scratch [m/s].
        r: The robots.
    """
    total = 0.0 * feedforward
    for lower in range(level, levels):
        if lower == first_escort:
            total = _within_limit(total, feedforward, r.max_speed)
        total = _within_limit(total, part_at(r.state, parts, MOST_AXES * lower), r.max_speed)
    if first_escort == levels:
        total = _within_limit(total, feedforward, r.max_speed)
    return total


@inlined
def _within_limit(total: Vec, part: Vec, max_speed: float) -> Vec:
    """Return total + alpha part, with the largest alpha of 0 to 1 that keeps the speed limit.

    Args:
        total: Velocity spent by higher priorities [m/s].
        part: Velocity wanted by this priority [m/s].
        max_speed: Limit [m/s]; `UNLIMITED` for none.
    """
    if not max_speed < UNLIMITED:
        return total + part
    a, b, c = dot(part, part), dot(part, total), dot(total, total)
    room = max_speed * max_speed - c
    room = where(room < ROUNDING * max_speed * max_speed, 0.0, room)  # all is spent but rounding
    beyond = a + 2.0 * b > room
    alpha = everywhere(1.0)
    if any_of(beyond):
        discriminant = root(b * b + a * room)
        within = where(b > 0.0, room, discriminant - b) / where(b > 0.0, discriminant + b, a)
        alpha = where(beyond, least(within, 1.0), alpha)
    return total + alpha * part
