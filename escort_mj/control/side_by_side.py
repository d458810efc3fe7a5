"""The outer loop of eight robots at once: what `outer` says one by one, for a team that shares a ladder.

Lanes stand for robots i to i + 7, rows of scratch for axes. Where a task asks nothing of a robot its weight
is 0, so that nothing is projected out and no lane takes another way than its neighbors.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.behaviors.avoid_obstacles import POLAR
from escort_mj.control.neighbors import candidate, number_of_candidates, seen_neighbors
from escort_mj.control.nsb import ROUNDING, TANGENT, UNLIMITED
from escort_mj.control.plan import (
    AVOID_OBSTACLES,
    CHORDS,
    MAX_CYCLES,
    MAX_LEVELS,
    SIDESTEP,
    VERTICES,
    Plan,
    State,
)
from escort_mj.kernels import inlined, merged
from escort_mj.lanes import (
    WIDTH,
    Lanes,
    any_of,
    everywhere,
    greatest,
    lane_numbers,
    least,
    load,
    load_rows,
    pick,
    row_of,
    set_row,
    stack_rows,
    store,
    store_rows,
    there,
    where,
)

Array = NDArray[np.float64]

AXES = 3  # at most, for which the scratch has room


@merged
def outer_loops(i: int, first: int, levels: int, plan: Plan, state: State) -> None:
    """Reference velocities of robots i to i + 7, as far as there are so many (eq. 2).

    Args:
        i: The first robot, from 0.
        first: Row of the ladder where its behaviors begin.
        levels: How many they are.
        plan: What the controller is told; no robot fails, and nobody is repelled.
        state: Its state; `v_d` and `avoidance_active` are written.
    """
    n, p = state.q.shape
    parts, x = stack_rows(MAX_LEVELS * p), stack_rows(MAX_CYCLES * p)
    carried, relative = stack_rows(p), stack_rows(p)
    share = 1.0 if plan.target_feedforward else 0.0
    for k in range(p):
        set_row(carried, k, everywhere(share * state.target_velocity_measured[k]))
    active, highest = everywhere(0.0), levels
    for level in range(levels - 1, -1, -1):
        row = plan.ladder[first + level]
        escort = row[0] != AVOID_OBSTACLES
        rank, weight, second, _ = wishes(i, row, plan, state, x, parts, p * level)
        if not escort:
            if not any_of(weight > 0.0):
                continue
            active = greatest(active, weight)
            if row[SIDESTEP] > 0.0:
                _sidestep(level, levels, row[SIDESTEP], weight, x, carried, parts)
        for lower in range(level + 1, levels):
            leave(p, rank, x, weight, second, parts, p * lower)
        if not escort:
            leave(p, rank, x, weight, second, carried, 0)
            continue
        highest = level
        if any_of(active > 0.0):  # an avoidance below has bent the feed-forward: its remainder is projected
            for k in range(p):
                set_row(relative, k, row_of(carried, k) - share * state.target_velocity_measured[k])
            leave(p, rank, x, weight, second, relative, 0)
            for k in range(p):
                set_row(carried, k, share * state.target_velocity_measured[k] + row_of(relative, k))
    store(state.avoidance_active, i, active)
    for k in range(p):
        set_row(relative, k, everywhere(0.0))
    for level in range(levels):
        if level == highest:
            _add_within_limit(relative, carried, 0, plan.max_speed)
        _add_within_limit(relative, parts, p * level, plan.max_speed)
    if highest == levels:
        _add_within_limit(relative, carried, 0, plan.max_speed)
    store_rows(state.v_d, i, relative)


@inlined
def wishes(
    i: int, row: Array, plan: Plan, state: State, x: Array, parts: Array, own: int
) -> tuple[int, Lanes, Lanes, Lanes]:
    """What one behavior, by itself, wants of robots i to i + 7; as `outer.wish`.

    Args:
        i: The first robot, from 0.
        row: The behavior's row of the ladder.
        plan: As for `outer_loops`.
        state: As for `outer_loops`; nothing is written.
        x: Result: the task's Jacobians, in rows of lanes, the second behind the first.
        parts: Result: the wanted velocities [m/s], in its rows from `own` on.
        own: Which row that is.

    Returns:
        The task's rank; weights 1 / |x|^2 of its first and its second direction, 0 where it asks nothing; and
        how deep the worst intruder is, of avoidance [m].
    """
    p = state.q.shape[1]
    rank, second, depth = 1, everywhere(0.0), everywhere(0.0)
    if row[0] == AVOID_OBSTACLES:
        depth, speed = _avoidance(i, row, plan, state, x)
        weight = where(depth > 0.0, 1.0, everywhere(0.0))
        for k in range(p):
            set_row(parts, own + k, speed * row_of(x, k))
    elif row[0] == VERTICES:
        weight, rank = _to_vertex(i, row[1], plan, state, x, parts, own), TANGENT
    elif row[0] == CHORDS:
        rank = state.predecessors.shape[0]
        _look_at_others(i, state.q_measured, state.predecessors[0], x, 0)
        weight = _keep_distance(p, state.chord_length[0], row[1], x, 0, parts, own)
        if rank == MAX_CYCLES:
            other = stack_rows(p)
            _look_at_others(i, state.q_measured, state.predecessors[1], x, p)
            second = _keep_distance(p, state.chord_length[0], row[1], x, p, other, 0)
            for k in range(p):
                set_row(parts, own + k, row_of(parts, own + k) + row_of(other, k))
    else:
        _look_at_center(i, state.q_measured, state.target_position_measured, x)
        weight = _keep_distance(p, plan.radius, row[1], x, 0, parts, own)
    return rank, weight, second, depth


@inlined
def _look_at_center(i: int, q: Array, center: Array, x: Array) -> None:
    """Writes where robots are, as seen from the target, to the first rows of x."""
    n, p = q.shape
    way = stack_rows(p)
    load_rows(q, i, way)
    for k in range(p):
        set_row(x, k, where(there(n - i), row_of(way, k) - center[k], 0.0))


@inlined
def _look_at_others(i: int, q: Array, others: Array, x: Array, first: int) -> None:
    """Writes where robots are, as seen each from another one, to the rows of x from the first one on."""
    n, p = q.shape
    here, seen = stack_rows(p), float(p) * least(greatest(load(others, i), 0.0), float(n - 1))
    load_rows(q, i, here)
    for k in range(p):
        way = row_of(here, k) - pick(q, seen + float(k))
        set_row(x, first + k, where(there(n - i), way, 0.0))


@inlined
def _keep_distance(
    p: int, distance: float, gain: float, x: Array, first: int, parts: Array, own: int
) -> Lanes:
    """As `behaviors.distance.keep_distance`, with x in its rows from the first one on.

    Returns:
        1 / |x|^2; the rows of `parts` from its own on get the task's velocity.
    """
    square = everywhere(0.0)
    for k in range(p):
        square = square + row_of(x, first + k) * row_of(x, first + k)
    weight = where(square > 0.0, 1.0 / square, 0.0)
    speed = gain * 0.5 * (distance * distance - square) * weight
    for k in range(p):
        set_row(parts, own + k, speed * row_of(x, first + k))
    return weight


@inlined
def _to_vertex(i: int, gain: float, plan: Plan, state: State, x: Array, parts: Array, own: int) -> Lanes:
    """As `behaviors.vertices.to_vertex`.

    Returns:
        1 / |x|^2; the rows of `parts` from its own on get the task's velocity.
    """
    p = state.q.shape[1]
    square, along, figure = everywhere(0.0), everywhere(0.0), stack_rows(p)
    _look_at_center(i, state.q_measured, state.target_position_measured, x)
    load_rows(state.vertices, i, figure)
    for k in range(p):
        square = square + row_of(x, k) * row_of(x, k)
    weight = where(square > 0.0, 1.0 / square, 0.0)
    for k in range(p):
        vertex = everywhere(0.0)
        for c in range(p):
            vertex = vertex + state.rotation[k, c] * row_of(figure, c)
        wanted = gain * (plan.radius * vertex - row_of(x, k))
        set_row(parts, own + k, wanted)
        along = along + wanted * row_of(x, k)
    along = along * weight
    for k in range(p):
        set_row(parts, own + k, row_of(parts, own + k) - along * row_of(x, k))
    return weight


@inlined
def _avoidance(i: int, row: Array, plan: Plan, state: State, x: Array) -> tuple[Lanes, Lanes]:
    """As `behaviors.avoid_obstacles.avoidance`.

    Returns:
        How deep the worst intruder is [m], and the task's speed along the rows of `x` [m/s]; 0 without one.
    """
    n, p = state.q.shape
    q, radius, to_surface = state.q_measured, plan.robot_radius, row[4]
    own, worst, distance = load(radius, i), everywhere(0.0), everywhere(0.0)
    here, other = stack_rows(p), stack_rows(p)
    load_rows(q, i, here)
    for k in range(p):
        set_row(x, k, everywhere(0.0))
    m = plan.obstacle_radius.shape[0]
    for j in range(m):
        square = everywhere(0.0)
        for k in range(p):
            way = row_of(here, k) - obstacle_places(i, j, k, plan, state)
            square = square + way * way
        reach = row[1] + to_surface * (own + plan.obstacle_radius[j])
        near = (square < reach * reach) & there(n - i)
        if any_of(near):
            length = math.sqrt(square)
            worse = near & (reach - length > worst)
            worst, distance = where(worse, reach - length, worst), where(worse, length, distance)
            for k in range(p):
                way = row_of(here, k) - obstacle_places(i, j, k, plan, state)
                set_row(x, k, where(worse, way, row_of(x, k)))
    lists = seen_neighbors(state)
    looking = row[2] > 0.0
    if looking and lists.shape[0] > 0:
        looking = _someone_near(i, row, q, radius, lists)
    if looking:
        for j in range(n):
            square = everywhere(0.0)
            for k in range(p):
                way = row_of(here, k) - q[j, k]
                square = square + way * way
            reach = row[2] + to_surface * (own + radius[j])
            near = (square < reach * reach) & (lane_numbers() + float(i) != float(j)) & there(n - i)
            if any_of(near):
                length = math.sqrt(square)
                worse = near & (reach - length > worst)
                worst, distance = where(worse, reach - length, worst), where(worse, length, distance)
                for k in range(p):
                    set_row(x, k, where(worse, row_of(here, k) - q[j, k], row_of(x, k)))
    v_square, e_square = everywhere(0.0), everywhere(0.0)
    if not any_of(worst > 0.0):
        return v_square, e_square
    load_rows(state.v_measured, i, here)
    load_rows(state.e, i, other)
    for k in range(p):
        aside = everywhere(1.0 if k == 0 else 0.0)
        set_row(x, k, where(distance > 0.0, row_of(x, k) / distance, aside))
        v_square = v_square + row_of(here, k) * row_of(here, k)
        e_square = e_square + row_of(other, k) * row_of(other, k)
    speed, error = math.sqrt(v_square), plan.slope * math.sqrt(e_square)
    if row[5] != 0.0:
        pull = speed - 2.0 * error + math.sqrt(greatest(error * (5.0 * error - 2.0 * speed), 0.0))
    else:
        pull = speed + (math.sqrt(2.0) - 1.0) * error
    active = worst > 0.0
    return worst, where(active, pull + row[3] * worst, 0.0)


@inlined
def obstacle_places(i: int, j: int, k: int, plan: Plan, state: State) -> Lanes:
    """Where robots i to i + 7 find an obstacle on an axis: see `movers.obstacles_seen`."""
    m, p = state.obstacle_position.shape
    if plan.shaped:
        robots = least(lane_numbers() + float(i), float(state.q.shape[0] - 1))
        seen: Lanes = pick(state.obstacle_point, robots * float(m * p) + float(j * p + k))
        return seen
    return everywhere(state.obstacle_position[j, k])


@inlined
def _someone_near(i: int, row: Array, q: Array, radius: Array, lists: Array) -> bool:
    """Whether one of robots i to i + 7 has a teammate that intrudes."""
    n, p = q.shape
    for robot in range(i, min(i + WIDTH, n)):
        for c in range(number_of_candidates(robot, n, lists)):
            j = candidate(robot, c, lists)
            square = 0.0
            for k in range(p):
                way = q[robot, k] - q[j, k]
                square += way * way
            reach = row[2] + row[4] * (radius[robot] + radius[j])
            if square < reach * reach and j != robot:
                return True
    return False


@inlined
def _sidestep(
    level: int, levels: int, share: float, weight: Lanes, direction: Array, carried: Array, parts: Array
) -> None:
    """As `behaviors.avoid_obstacles.sidestep`, for robots of weight 1."""
    p = carried.shape[0]
    outward, square = everywhere(0.0), everywhere(0.0)
    for k in range(p):
        wanted = row_of(carried, k)
        for lower in range(level + 1, levels):
            wanted = wanted + row_of(parts, lower * p + k)
        outward = outward + wanted * row_of(direction, k)
        square = square + wanted * wanted
    speed = -share * outward - math.sqrt(greatest(square - outward * outward, 0.0))
    speed = where(speed > 0.0, speed, 0.0) * weight
    if p % 2 == 0:
        _turn(level, 0, speed, direction, parts)
        return
    polar = abs(row_of(direction, p - 1)) > POLAR
    _turn(level, 0, where(polar, 0.0, speed), direction, parts)
    _turn(level, 1, where(polar, speed, 0.0), direction, parts)


@inlined
def _turn(level: int, first: int, speed: Lanes, direction: Array, parts: Array) -> None:
    """Adds a velocity across a direction, in pairs of axes."""
    p = parts.shape[0] // MAX_LEVELS
    for k in range(first, first + p - p % 2, 2):
        set_row(parts, level * p + k, row_of(parts, level * p + k) - speed * row_of(direction, k + 1))
        set_row(parts, level * p + k + 1, row_of(parts, level * p + k + 1) + speed * row_of(direction, k))


@inlined
def leave(p: int, rank: int, x: Array, weight: Lanes, second: Lanes, parts: Array, at: int) -> None:
    """As `nsb.leave`, of the part in the rows from one on; `second` is the weight of a second direction."""
    along, other = everywhere(0.0), everywhere(0.0)
    for k in range(p):
        along = along + row_of(x, k) * row_of(parts, at + k)
    along = along * weight
    if rank == MAX_CYCLES:
        for k in range(p):
            other = other + row_of(x, p + k) * row_of(parts, at + k)
        other = other * second
        for k in range(p):
            rest = 2.0 * row_of(parts, at + k) - along * row_of(x, k) - other * row_of(x, p + k)
            set_row(parts, at + k, rest)
        return
    for k in range(p):
        removed = along * row_of(x, k)
        set_row(parts, at + k, removed if rank == TANGENT else row_of(parts, at + k) - removed)


@inlined
def _add_within_limit(total: Array, parts: Array, at: int, max_speed: float) -> None:
    """As `nsb.add_within_limit`, of the part in the rows from one on."""
    p = total.shape[0]
    alpha = everywhere(1.0)
    if max_speed < UNLIMITED:
        a, b, c = everywhere(0.0), everywhere(0.0), everywhere(0.0)
        for k in range(p):
            a = a + row_of(parts, at + k) * row_of(parts, at + k)
            b = b + row_of(parts, at + k) * row_of(total, k)
            c = c + row_of(total, k) * row_of(total, k)
        room = max_speed * max_speed - c
        room = where(room < ROUNDING * max_speed * max_speed, 0.0, room)
        beyond = a + 2.0 * b > room
        if any_of(beyond):
            root = math.sqrt(b * b + a * room)
            within = where(b > 0.0, room, root - b) / where(b > 0.0, root + b, a)
            alpha = where(beyond, least(within, 1.0), alpha)
    for k in range(p):
        set_row(total, k, row_of(total, k) + alpha * row_of(parts, at + k))
