"""Robots that are more than their hulls: how near what they can touch with comes to everything, and how fast.

A built-in robot meets others with its hull, the sphere around the point that the law controls, and
`monitor/clearances.py` watches that. A robot from a file, or one whose payload collides, has other geoms,
which its joints may carry far from that point. Its clearance is the least distance of these geoms to those of
another body, by MuJoCo's geometry, in the present pose. Where the sphere around them all is farther away than
anything that is asked for, its distance stands for theirs, which is never less.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.memory.layout import Plan, State
from escort_mj.monitor.clearances import note_pair
from escort_mj.native.kernels import DOUBLE, double_at, inlined, pointer_at, stack_memory, vector_at
from escort_mj.native.on_demand import on_demand
from escort_mj.world.loop.addresses import Addresses
from escort_mj.world.loop.drives import DATA_CENTER, DATA_MASS_CENTER, DATA_MOTION
from escort_mj.world.loop.layout import offset
from escort_mj.world.loop.library import geom_distance
from escort_mj.world.loop.nearest import DATA_PLACE, FARTHEST

Array = NDArray[np.float64]

MODEL_REACH = offset("mjModel", "geom_rbound")
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
    n = state.q.shape[0]
    _stretch(d, state, addresses)
    for i in range(n):
        if plan.watched_radius[i] >= 0.0:
            continue
        for j in range(n):
            if j > i or (j < i and plan.watched_radius[j] >= 0.0):
                _watch_robot(m, d, i, j, plan, state, addresses)
        if addresses.target_radius > 0.0:
            _watch_target(m, d, i, plan, state, addresses)
        for j in range(plan.obstacle_radius.shape[0]):
            _watch_obstacle(m, d, i, j, plan, state, addresses)


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
        for k in range(state.q.shape[1]):
            away += (center[k] - state.q[i, k]) ** 2
        fastest = math.sqrt(square) + math.sqrt(turning) * limb[LIMB]
        state.point_speed_max[i] = max(state.point_speed_max[i], fastest)
        if addresses.part_span[i, REACH] < 0.0:
            state.stretch[i] = max(state.stretch[i], math.sqrt(away) + limb[LIMB])


@inlined
def _watch_robot(m: int, d: int, i: int, j: int, plan: Plan, state: State, addresses: Addresses) -> None:
    """Note the clearance of two robots."""
    square = 0.0
    for k in range(state.q.shape[1]):
        square += (state.q[i, k] - state.q[j, k]) ** 2
    clearance = math.sqrt(square) - state.stretch[i] - state.stretch[j]
    if clearance < plan.exact_within:
        clearance = math.inf
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
    clearance = math.sqrt(square) - state.stretch[i] - addresses.target_radius
    if clearance < plan.exact_within:
        clearance = _to_geom(m, d, i, int(addresses.robot_geom[n]), math.inf, addresses)
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
    clearance = gap - state.stretch[i]
    if clearance < plan.exact_within:
        clearance = _to_geom(m, d, i, int(addresses.obstacle_geom[j]), math.inf, addresses)
    note_pair(i, n + 1 + j, clearance, plan, state)


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
        if math.sqrt(square) - around < least:
            least = min(least, geom_distance(m, d, geom, other, FARTHEST, segment))
    return least
