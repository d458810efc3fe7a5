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

from escort_mj.monitor.clearances import MANY, NOBODY, note_clearance, note_pair, note_rows
from escort_mj.native.kernels import DOUBLE, double_at, inlined, pointer_at, stack_memory, vector_at
from escort_mj.native.lanes import (
    WIDTH,
    Lanes,
    any_of,
    everywhere,
    gather,
    greatest,
    lane_numbers,
    load,
    load_rows,
    pick,
    root,
    row_of,
    set_row,
    stack_rows,
    there,
    where,
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
    groups, singly = state.clearance.shape[1], state.target_clearance.shape[0] > MANY
    _stretch(d, state, addresses)
    here, least = stack_rows(state.q.shape[1]), everywhere(math.inf)
    for i in range(0, n, WIDTH):
        load_rows(state.q, i, here)
        own, column = load(state.stretch, i), -1
        for body in range(n + 1 + obstacles):
            if body == n and addresses.target_radius == 0.0:
                continue
            asked, most = _asked(i, body, plan), everywhere(math.inf)
            if not singly:
                if column != int(plan.watched_group[body]):
                    column = int(plan.watched_group[body])
                    least = gather(state.clearance, i * groups + column, groups)
                most = greatest(least, everywhere(_least_of(body, plan, state))) + NEARLY
            other = _radius_of(body, plan, state, addresses)
            if body > n and plan.shaped:
                rows = lesser(lane_numbers() + float(i), float(n - 1))
                gap = pick(state.obstacle_gap, rows * float(obstacles) + float(body - n - 1))
                clearance = gap - own
            else:
                square, reach = _squares(body, here, plan, state), most + (own + other)
                if not any_of((square < reach * reach) & asked):
                    continue
                away = root(square)
                clearance = away - other - own if body > n else away - own - other
            asked = asked & (clearance < most)
            if singly or any_of(asked & (clearance < plan.exact_within)):
                _note_singly(m, d, i, body, where(asked, clearance, math.inf), plan, state, addresses)
                column = -1  # what was read of it may be less now
                continue
            nearer = asked & (clearance < least)
            if any_of(nearer):
                least = where(nearer, clearance, least)
                note_rows(i, column, least, where(nearer, float(body), NOBODY), state)
            if body <= n and any_of(asked & (clearance < _least_of(body, plan, state))):
                _note_of_body(i, body, where(asked, clearance, math.inf), plan, state)
                column = -1


@inlined
def _asked(i: int, body: int, plan: Plan) -> Any:
    """Which of robots i to i + 7 are watched here with a body: each two robots that are no hulls once."""
    n, robots = plan.watched_radius.shape[0], lane_numbers() + float(i)
    parts = (load(plan.watched_radius, i) < 0.0) & there(n - i)
    if body < n and plan.watched_radius[body] < 0.0:
        return parts & (robots < float(body))
    return parts & (abs(robots - float(body)) > 0.5)


@inlined
def _least_of(body: int, plan: Plan, state: State) -> float:
    """Return a robot's or the target's least clearance to robots so far [m]; of obstacles none is noted."""
    n, robots = state.q.shape[0], int(plan.watched_group[0])
    if body > n:
        return -math.inf
    return state.clearance[body, robots] if body < n else state.target_clearance[robots]


@inlined
def _radius_of(body: int, plan: Plan, state: State, addresses: Addresses) -> float:
    """Return how far a body reaches from its center [m]."""
    n = state.q.shape[0]
    if body > n:
        return plan.obstacle_radius[body - n - 1]
    return state.stretch[body] if body < n else addresses.target_radius


@inlined
def _squares(body: int, here: Array, plan: Plan, state: State) -> Lanes:
    """Return the squared distances of eight robots to a body, center to center [m^2]."""
    n, p = state.q.shape
    square = everywhere(0.0)
    for k in range(p):
        if body > n:
            x = row_of(here, k) - state.obstacle_position[body - n - 1, k]
        elif body == n:
            x = row_of(here, k) - state.target_position[k]
        else:
            x = row_of(here, k) - state.q[body, k]
        square = square + x * x
    return square


@inlined
def _note_of_body(i: int, body: int, clearance: Lanes, plan: Plan, state: State) -> None:
    """Note the clearances of a robot or the target to robots i to i + 7, infinite where none is asked for."""
    n, robots, row = state.q.shape[0], int(plan.watched_group[0]), stack_rows(1)
    set_row(row, 0, clearance)
    for robot in range(i, min(i + WIDTH, n)):
        if body < n:
            note_clearance(
                state.clearance[body], state.clearance_body[body], robots, row[0, robot - i], robot
            )
        else:
            note_clearance(
                state.target_clearance, state.target_clearance_body, robots, row[0, robot - i], robot
            )


@inlined
def _note_singly(
    m: int, d: int, i: int, body: int, around: Lanes, plan: Plan, state: State, addresses: Addresses
) -> None:
    """Note the clearances of robots i to i + 7 and a body, by geoms where they are near.

    Args:
        m: Address of MuJoCo's model.
        d: Address of its data.
        i: First of the robots.
        body: As in `note_pair`.
        around: Clearances of the spheres around them [m]; infinite where none is asked for.
        plan: Gives the clearance below which those here are exact.
        state: The record's clearances are written.
        addresses: Gives the geoms.
    """
    n, row = state.q.shape[0], stack_rows(1)
    set_row(row, 0, around)
    for robot in range(i, min(i + WIDTH, n)):
        clearance, noted = row[0, robot - i], _noted(robot, body, plan, state)
        if clearance >= noted:
            continue
        if clearance < plan.exact_within:
            clearance = noted
            if body < n:
                first = int(addresses.part_span[body, START])
                for part in range(first, first + int(addresses.part_span[body, NUMBER])):
                    clearance = _to_geom(m, d, robot, int(addresses.parts[part]), clearance, addresses)
            elif body == n:
                clearance = _to_geom(m, d, robot, int(addresses.robot_geom[n]), noted, addresses)
            else:
                geom = int(addresses.obstacle_geom[body - n - 1])
                clearance = _to_geom(m, d, robot, geom, noted, addresses)
        note_pair(robot, body, clearance, plan, state)


@inlined
def _stretch(d: int, state: State, addresses: Addresses) -> None:
    """Find how far robots reach in their present pose, and the fastest point of each.

    The point of a body's geoms that moves fastest is at most as fast as its center of mass, and what turning
    adds as far from it as they reach.
    """
    for i in range(state.stretch.shape[0]):
        state.stretch[i] = addresses.part_span[i, REACH]
    centers, motions = pointer_at(d + DATA_MASS_CENTER()), pointer_at(d + DATA_MOTION())
    roots = pointer_at(d + DATA_CENTER())
    for row in range(addresses.limbs.shape[0]):
        limb = addresses.limbs[row]
        i = int(limb[ROBOT])
        center = vector_at(centers + 3 * DOUBLE * int(limb[BODY]), 3)
        motion = vector_at(motions + 6 * DOUBLE * int(limb[BODY]), 6)
        about = vector_at(roots + 3 * DOUBLE * int(limb[ROOT]), 3)
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
