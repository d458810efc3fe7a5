"""Which teammates a robot has to look at: those near enough for how fast the two come together.

A teammate that keeps to its half matters as far away as the robot's own speed says. One that comes faster may
matter farther away. Speeds are compared in one frame: a teammate that is no faster than the robot is met at
no more than twice the robot's speed, and a faster one finds the robot within twice its own.
"""

from __future__ import annotations

import math
from typing import Annotated

from escort_mj.behaviors.avoid_obstacles import mate_within
from escort_mj.behaviors.behavior import Avoidance
from escort_mj.control.nsb import avoidance_of
from escort_mj.control.outer_loops.passing import Clearance, Rules, approach, horizon, horizon_lanes
from escort_mj.knowledge.belief import target_speed
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, merged, stack_memory, vector_at
from escort_mj.native.lanes import (
    WIDTH,
    Lanes,
    any_of,
    everywhere,
    greatest,
    largest,
    root,
    row_of,
    set_row,
    stack_rows,
    store,
    there,
)
from escort_mj.native.on_demand import on_demand
from escort_mj.native.vectors import (
    Vec,
    dot,
    norm,
    numbers_at,
    numbers_from,
    one_row,
    rows_at,
    set_numbers,
    where,
)
from escort_mj.numerics.neighbors import ALL, ROUNDING, empty_around, find_near
from escort_mj.plan import Plan, State

NEAR = 64  # teammates that may be near enough to matter; of more, all are looked at


class PaceState(Fields):
    """How fast robots may be met, which says how far away that matters."""

    pace_frame: Annotated[
        Array,
        "p",
        Value("m/s", "of the first robot's target: speeds are relative to it"),
    ]
    pace_most: Annotated[Array, 1, Value("m/s", "the largest speed of a robot, measured, relative to it")]
    pace_level: Annotated[
        Array, 1, Value("1", "level of avoidance whose distances `pace_met` is for; -1 for none in this step")
    ]
    pace_met: Annotated[
        Array,
        "avoiding",
        Value("m/s", "largest speed of each robot up to which no faster one binds it, in a crowd"),
    ]
    pace_fast: Annotated[
        Array, "avoiding", Value("m/s", "largest speed of those that may bind a slower robot, in a crowd")
    ]


@merged
def bound_velocities(plan: Plan, state: State) -> None:
    """Write the frame, that of the first robot's target, and the largest speed in it."""
    n, longest = state.q.shape[0], everywhere(0.0)
    set_numbers(state.pace_frame, 0, where(plan.target_feedforward, target_speed(0, plan, state), 0.0))
    for i in range(0, n, WIDTH):
        longest = greatest(longest, where(there(n - i), _squares_in_frame(i, state), 0.0))
    state.pace_most[0], state.pace_level[0] = math.sqrt(largest(longest)), -1.0


@inlined
def _squares_in_frame(i: int, state: State) -> Lanes:
    """Return the squares of measured speeds of robots i to i + 7 in the common frame [m^2/s^2]."""
    v = rows_at(state, state.v_measured, i) - one_row(state, state.pace_frame)
    square: Lanes = dot(v, v)
    return square


@inlined
def who_is_met(
    i: int, alike: Lanes, own: Lanes, far: Lanes, clearance: Clearance, plan: Plan, state: State
) -> Lanes:
    """Return 1 for those of robots i to i + 7 of a crowd that have to look at a teammate, else 0.

    It is so near, or comes so fast, that it may bind what the robot wants.

    Args:
        i: First robot, from 0.
        alike: Speeds at which they could meet one that keeps to its half [m/s].
        own: How fast what they want is in the common frame [m/s].
        far: Margins at which it matters that the fastest teammate comes [m].
        clearance: What distances are kept.
        plan: Gives radii.
        state: Gives measured positions and velocities, lists, and what robots want, `v_d`.
    """
    n, speeds, avoid = state.q.shape[0], stack_rows(4), clearance.avoid
    within = avoid.teammate_distance + far
    looks = there(n - i) & (within > empty_around(i, avoid.to_surface, state))
    if not any_of(looks):
        return everywhere(0.0)
    set_row(speeds, 0, alike)
    set_row(speeds, 1, own)
    set_row(speeds, 2, within)
    set_row(speeds, 3, where(looks, 1.0, 0.0))
    for robot in range(i, min(i + WIDTH, n)):
        lane = robot - i
        if speeds[3, lane] > 0.5 and not _is_met(
            robot, speeds[0, lane], speeds[1, lane], speeds[2, lane], clearance, plan, state
        ):
            speeds[3, lane] = 0.0
    return row_of(speeds, 3)


@inlined
def _is_met(
    robot: int, alike: float, own: float, within: float, clearance: Clearance, plan: Plan, state: State
) -> bool:
    """Whether a teammate may bind what one robot wants, see `who_is_met`; none does that is not `within`."""
    level, avoid, rules = clearance
    safe, wanted = avoid.teammate_distance, numbers_at(state, state.v_d, robot)
    if mate_within(safe + horizon(alike, rules), robot, avoid, plan, state):
        return True
    if state.pace_level[0] != level:
        if not mate_within(within, robot, avoid, plan, state):
            return False
        _find_met(level, rules.rate, rules.braking, rules.cone, plan, state)
    if _faster(robot, own, state) == own and (
        2.0 * own <= ROUNDING * alike
        or not mate_within(safe + horizon(2.0 * own, rules), robot, avoid, plan, state)
    ):
        return False
    found = vector_at(stack_memory(), NEAR)
    return find_meeting(robot, alike, 0.0, wanted, clearance, plan, state, found) != 0


@inlined
def find_meeting(
    robot: int, alike: float, ahead: float, motion: Vec, clearance: Clearance, plan: Plan, state: State,
    found: Array,
) -> int:  # fmt: skip
    """Find the teammates of a robot with a margin below the `horizon` of the speed at which they could meet.

    Args:
        robot: From 0.
        alike: Speed at which it could meet any that keeps to its half [m/s].
        ahead: Speed at which it could go toward any, relative to `motion`; one that comes toward it adds its
            own [m/s].
        motion: Velocity that all share [m/s].
        clearance: What distances are kept: within `horizon(alike)` any counts, farther away one that comes so
            fast.
        plan: Gives radii.
        state: Gives measured positions and velocities, and lists.
        found: Result: which robots, in ascending order, shape (NEAR,).

    Returns:
        How many; `ALL` where there are more than `found` holds.
    """
    level, avoid, rules = clearance
    own, to_surface, radius = ahead + _apart_from(motion, state), avoid.to_surface, plan.robot_radius
    fastest = state.pace_most[0]
    if fastest > own and state.pace_met.shape[0] > 0:
        if state.pace_level[0] != level:
            _find_met(level, rules.rate, rules.braking, rules.cone, plan, state)
        fastest = _faster(robot, own, state)
    near, far = horizon(alike, rules), horizon(max(alike, rules.foresees * (own + fastest)), rules)
    look = avoid.teammate_distance + to_surface * radius[robot] + far
    around, count = find_near(robot, look, to_surface, radius, state, found), 0
    everyone, q = around == int(ALL), numbers_at(state, state.q_measured, robot)
    for place in range(state.q.shape[0] if everyone else around):
        j = place if everyone else int(found[place])
        safe = avoid.teammate_distance + to_surface * (radius[robot] + radius[j])
        way = q - numbers_at(state, state.q_measured, j)
        square, closing = dot(way, way), dot(way, numbers_at(state, state.v_measured, j) - motion)
        if j == robot or square > (safe + far) ** 2:
            continue
        apart = math.sqrt(square)
        if square <= (safe + near) ** 2 or (
            apart <= safe + ROUNDING * horizon(max(ahead + closing / apart, 0.0), rules)
        ):
            if count < found.shape[0]:
                found[count] = j
            count += 1
    return count if count <= found.shape[0] else int(ALL)


@inlined
def _faster(robot: int, own: float, state: State) -> float:
    """Return the largest speed of faster ones that may bind a robot, or its own where none does [m/s]."""
    return own if state.pace_met[robot] > ROUNDING * own else max(own, ROUNDING * state.pace_fast[robot])


@inlined
def _apart_from(velocity: Vec, state: State) -> float:
    """Return the speed of a velocity in the common frame [m/s]."""
    speed: float = norm(velocity - numbers_from(state, state.pace_frame, 0))
    return speed


@on_demand
def _find_met(level: int, rate: float, braking: float, cone: float, plan: Plan, state: State) -> None:
    """Write `pace_met` and `pace_fast`: each robot looks for those that it finds within twice its own speed.

    A faster robot j may bind robot i from a speed of approach(margin) - r . v_j on.

    Args:
        level: Which one avoidance is.
        rate: See `Rules`, as the next two.
        braking: Likewise [m/s^2].
        cone: Likewise.
        plan: Gives radii.
        state: Gives measured positions and velocities, and lists.
    """
    avoid, rules = avoidance_of(level, plan), Rules(rate, braking, cone, 1.0, 0.0, 0.0)
    n, to_surface, within = state.q.shape[0], avoid.to_surface, stack_rows(1)
    state.pace_level[0] = level
    for i in range(0, n, WIDTH):
        store(state.pace_met, i, everywhere(math.inf))
        store(state.pace_fast, i, everywhere(0.0))
    for first in range(0, n, WIDTH):
        speed = root(_squares_in_frame(first, state))
        far = avoid.teammate_distance + horizon_lanes(2.0 * ROUNDING * speed, rules)
        looks = there(n - first) & (far > empty_around(first, to_surface, state))
        if not any_of(looks):
            continue
        set_row(within, 0, where(looks, far, 0.0))
        for j in range(first, min(first + WIDTH, n)):
            if within[0, j - first] > 0.0:
                _note_met(j, within[0, j - first], avoid, rules, plan, state)


@inlined
def _note_met(j: int, within: float, avoid: Avoidance, rules: Rules, plan: Plan, state: State) -> None:
    """Note which slower robots within a distance of robot j may be bound by it, and from which speed on."""
    n, q, v = state.q.shape[0], numbers_at(state, state.q_measured, j), numbers_at(state, state.v_measured, j)
    near, to_surface = vector_at(stack_memory(), NEAR), avoid.to_surface
    bodies, speed = to_surface * plan.robot_radius[j], _apart_from(v, state)
    count = find_near(j, within + bodies, to_surface, plan.robot_radius, state, near)
    everyone = count == int(ALL)
    for place in range(n if everyone else count):
        i = place if everyone else int(near[place])
        way = numbers_at(state, state.q_measured, i) - q
        closing, apart = dot(way, v - numbers_from(state, state.pace_frame, 0)), norm(way)
        if closing > 0.0 and i != j:
            margin = apart - avoid.teammate_distance - bodies - to_surface * plan.robot_radius[i]
            least = approach(margin, rules) - closing / apart
            if least < ROUNDING * speed:
                state.pace_met[i] = min(state.pace_met[i], least)
                state.pace_fast[i] = max(state.pace_fast[i], speed)
