"""Robots that are more than their hulls: how near what they can touch with comes to everything, and how fast.

A built-in robot meets others with its hull, the sphere around the point that the law controls, and
`monitor/clearances.py` watches that. A robot from a file, or one whose payload collides, has other geoms,
which its joints may carry far from that point. Its clearance is the least distance of these geoms to those of
another body, by MuJoCo's geometry, in the present pose. Where the sphere around them all is farther away than
anything that is asked for, its distance stands for theirs, which is never less. Where that
sphere is no nearer than what has been noted already, nothing is computed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.monitor.clearances import MANY, note_pair
from escort_mj.native.kernels import DOUBLE, double_at, inlined, pointer_at, stack_memory, vector_at
from escort_mj.native.lanes import (
    WIDTH,
    any_of,
    everywhere,
    gather,
    greatest,
    lane_numbers,
    load,
    load_rows,
    pick,
    row_of,
    stack_rows,
    there,
)
from escort_mj.native.lanes import least as lesser
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State
from escort_mj.robots.addresses import Addresses
from escort_mj.world.loop.drives import DATA_CENTER, DATA_MASS_CENTER, DATA_MOTION
from escort_mj.world.loop.layout import offset
from escort_mj.world.loop.library import geom_distance
from escort_mj.world.loop.nearest import DATA_PLACE, FARTHEST

Array = NDArray[np.float64]

MODEL_REACH = offset("mjModel", "geom_rbound")
NEARLY = 1e-5  # m, by which MuJoCo's distance between geoms may fall short of that between spheres
START, NUMBER, REACH = range(3)  # columns of `part_span`
ROBOT, BODY, ROOT, LIMB = range(4)  # of `limbs`


@on_demand
def watch_parts(m: int, d: int, plan: Plan, state: State, addresses: Addresses) -> None:
    """Note clearances of robots that are more than their hulls, and how fast their points can be.

    Args:
        m: Address of MuJoCo's model.
        d: Address of its data, in which geoms and motions are those of the solved step.
        plan: Gives columns, radii and the clearance below which those here are exact.
        state: The record's clearances and speeds are written.
        addresses: Gives the geoms.
    """
    n, obstacles = state.q.shape[0], plan.obstacle_radius.shape[0]
    _stretch(d, state, addresses)
    singly = state.target_clearance.shape[0] > MANY
    for i in range(0, n, WIDTH):
        for body in range(n + 1 + obstacles):
            if body == n and addresses.target_radius == 0.0:
                continue
            if not singly and not any_of(_may_be_least(i, body, plan, state, addresses)):
                continue
            for robot in range(i, min(i + WIDTH, n)):
                if _is_hull(robot, plan) or robot == body or (body < robot and not _is_hull(body, plan)):
                    continue
                if body < n:
                    _watch_robot(m, d, robot, body, plan, state, addresses)
                elif body == n:
                    _watch_target(m, d, robot, plan, state, addresses)
                else:
                    _watch_obstacle(m, d, robot, body - n - 1, plan, state, addresses)


@inlined
def _is_hull(robot: int, plan: Plan) -> bool:
    """Whether a robot is its hull, which is watched elsewhere."""
    return plan.watched_radius[robot] >= 0.0


@inlined
def _may_be_least(i: int, body: int, plan: Plan, state: State, addresses: Addresses) -> Any:
    """Whether robots i to i + 7 are so near to a body, by the spheres around them, that it may be noted."""
    n, p = state.q.shape
    group, groups, obstacle = int(plan.watched_group[body]), state.clearance.shape[1], body - n - 1
    least, own = gather(state.clearance, i * groups + group, groups), load(state.stretch, i) + NEARLY
    others = there(n - i) & (abs(lane_numbers() + float(i - body)) > 0.5)
    if body > n and plan.shaped:
        rows = lesser(lane_numbers() + float(i), float(n - 1))
        gap = pick(state.obstacle_gap, rows * float(plan.obstacle_radius.shape[0]) + float(obstacle))
        return (gap - own < least) & others
    here, square = stack_rows(p), everywhere(0.0)
    load_rows(state.q, i, here)
    for k in range(p):
        if body > n:
            x = row_of(here, k) - state.obstacle_position[obstacle, k]
        elif body == n:
            x = row_of(here, k) - state.target_position[k]
        else:
            x = row_of(here, k) - state.q[body, k]
        square = square + x * x
    robots = int(plan.watched_group[0])
    if body > n:
        reach = least + (own + plan.obstacle_radius[obstacle])
    elif body == n:
        reach = greatest(least, everywhere(state.target_clearance[robots])) + (own + addresses.target_radius)
    else:
        reach = greatest(least, everywhere(state.clearance[body, robots])) + (own + state.stretch[body])
    return (square < reach * reach) & others


@inlined
def _stretch(d: int, state: State, addresses: Addresses) -> None:
    """Find how far robots reach in their present pose, and the fastest point of each.

    The point of a body's geoms that moves fastest is at most as fast as its center of mass, and what turning
    adds as far from it as they reach.
    """
    for i in range(state.stretch.shape[0]):
        state.stretch[i] = addresses.part_span[i, REACH]
    for row in range(addresses.limbs.shape[0]):
        limb = addresses.limbs[row]
        i = int(limb[ROBOT])
        center = vector_at(pointer_at(d + DATA_MASS_CENTER()) + 3 * DOUBLE * int(limb[BODY]), 3)
        motion = vector_at(pointer_at(d + DATA_MOTION()) + 6 * DOUBLE * int(limb[BODY]), 6)
        about = vector_at(pointer_at(d + DATA_CENTER()) + 3 * DOUBLE * int(limb[ROOT]), 3)
        square, turning, away = 0.0, 0.0, 0.0
        for k in range(3):
            a, b = (k + 1) % 3, (k + 2) % 3
            speed = motion[3 + k] + motion[a] * (center[b] - about[b]) - motion[b] * (center[a] - about[a])
            square += speed * speed
            turning += motion[k] * motion[k]
        fastest = math.sqrt(square) + math.sqrt(turning) * limb[LIMB]
        state.point_speed_max[i] = max(state.point_speed_max[i], fastest)
        if addresses.part_span[i, REACH] < 0.0:
            hull = int(addresses.robot_geom[i])
            here = vector_at(pointer_at(d + DATA_PLACE()) + 3 * DOUBLE * hull, 3)
            for k in range(3):  # upwards as well: parts may be above the plane of a planar mission
                away += (center[k] - here[k]) ** 2
            state.stretch[i] = max(state.stretch[i], math.sqrt(away) + limb[LIMB])


@inlined
def _watch_robot(m: int, d: int, i: int, j: int, plan: Plan, state: State, addresses: Addresses) -> None:
    """Note the clearance of two robots."""
    square = 0.0
    for k in range(state.q.shape[1]):
        square += (state.q[i, k] - state.q[j, k]) ** 2
    clearance, noted = math.sqrt(square) - state.stretch[i] - state.stretch[j], _noted(i, j, plan, state)
    if clearance >= noted:
        return
    if clearance < plan.exact_within:
        clearance = noted
        first = int(addresses.part_span[j, START])
        for part in range(first, first + int(addresses.part_span[j, NUMBER])):
            clearance = _to_geom(m, d, i, int(addresses.parts[part]), clearance, addresses)
    note_pair(i, j, clearance, plan, state)


@inlined
def _watch_target(m: int, d: int, i: int, plan: Plan, state: State, addresses: Addresses) -> None:
    """Note the clearance of a robot and the target."""
    n, square = state.q.shape[0], 0.0
    for k in range(state.q.shape[1]):
        square += (state.q[i, k] - state.target_position[k]) ** 2
    clearance, noted = (
        math.sqrt(square) - state.stretch[i] - addresses.target_radius,
        _noted(i, n, plan, state),
    )
    if clearance >= noted:
        return
    if clearance < plan.exact_within:
        clearance = _to_geom(m, d, i, int(addresses.robot_geom[n]), noted, addresses)
    note_pair(i, n, clearance, plan, state)


@inlined
def _watch_obstacle(m: int, d: int, i: int, j: int, plan: Plan, state: State, addresses: Addresses) -> None:
    """Note the clearance of a robot and an obstacle."""
    n, square, gap = state.q.shape[0], 0.0, 0.0
    if plan.shaped:
        gap = state.obstacle_gap[i * plan.obstacle_radius.shape[0] + j]
    else:
        for k in range(state.q.shape[1]):
            square += (state.q[i, k] - state.obstacle_position[j, k]) ** 2
        gap = math.sqrt(square) - plan.obstacle_radius[j]
    clearance, noted = gap - state.stretch[i], _noted(i, n + 1 + j, plan, state)
    if clearance >= noted:
        return
    if clearance < plan.exact_within:
        clearance = _to_geom(m, d, i, int(addresses.obstacle_geom[j]), noted, addresses)
    note_pair(i, n + 1 + j, clearance, plan, state)


@inlined
def _noted(i: int, body: int, plan: Plan, state: State) -> float:
    """Return the clearance of a robot and another body from which on nothing is noted of it [m]."""
    n, least = state.q.shape[0], -math.inf
    for column in (int(plan.watched_group[body]), int(plan.watched_alone[body])):
        if column >= 0:
            least = max(least, state.clearance[i, column])
    for column in (int(plan.watched_group[i]), int(plan.watched_alone[i])):
        if column >= 0 and body <= n:
            there = state.clearance[body, column] if body < n else state.target_clearance[column]
            least = max(least, there)
    return least + NEARLY


@inlined
def _to_geom(m: int, d: int, i: int, other: int, least: float, addresses: Addresses) -> float:
    """Return the least distance of a robot's geoms to another geom, or what was less before [m]."""
    reaches, places = pointer_at(m + MODEL_REACH()), pointer_at(d + DATA_PLACE())
    there = vector_at(places + 3 * DOUBLE * other, 3)
    segment = stack_memory()
    first = int(addresses.part_span[i, START])
    for part in range(first, first + int(addresses.part_span[i, NUMBER])):
        geom = int(addresses.parts[part])
        here, square = vector_at(places + 3 * DOUBLE * geom, 3), 0.0
        for k in range(3):
            square += (here[k] - there[k]) ** 2
        around = double_at(reaches + DOUBLE * geom) + double_at(reaches + DOUBLE * other)
        if around + least > 0.0 and square < (around + least) ** 2:
            least = min(least, geom_distance(m, d, geom, other, FARTHEST, segment))
    return least
