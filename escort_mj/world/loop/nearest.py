"""The nearest points of obstacles that are no spheres, by MuJoCo's geometry, at every physics step.

Most are far away: the distance to the box around a shape, in the shape's own axes, is never more than that
to the shape. Only where it is less than what the mission could care for is MuJoCo asked for the exact one;
farther away the box stands for the shape. A box is its own box.

A robot whose center is inside a shape sees the shape behind it, at most by the robot's own radius: it is
pushed out by the shortest way, and finds itself nearer than anything outside.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import DOUBLE, inlined, pointer_at, stack_memory, vector_at
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State
from escort_mj.robots.addresses import Addresses
from escort_mj.world.loop.depth import depth_inside
from escort_mj.world.loop.layout import offset
from escort_mj.world.loop.library import geom_distance

Array = NDArray[np.float64]

MODEL_BOUNDS = offset("mjModel", "geom_aabb")
FARTHEST = 1e7  # of any two geoms [m]
DATA_PLACE, DATA_TURN = offset("mjData", "geom_xpos"), offset("mjData", "geom_xmat")


@on_demand
def find_nearest(m: int, d: int, plan: Plan, state: State, addresses: Addresses) -> None:
    """Writes `obstacle_point` and `obstacle_gap`: what each robot and a target find of each obstacle.

    Args:
        m: Address of MuJoCo's model.
        d: Address of its data, in which geoms are where they are now.
        plan: Gives the distance from which on the box will do.
        state: Both are written, m rows for each robot and for the target.
        addresses: Which geoms they are.
    """
    n, p = state.q.shape
    obstacles = plan.obstacle_radius.shape[0]
    segment = stack_memory()
    way = vector_at(segment + 6 * DOUBLE, p)
    seers = n + 1 if addresses.target_radius > 0.0 else n
    for i in range(seers):
        geom = int(addresses.robot_geom[i])
        body = vector_at(pointer_at(d + DATA_PLACE()) + 3 * DOUBLE * geom, 3)
        radius = plan.robot_radius[i] if i < n else addresses.target_radius
        for j in range(obstacles):
            row = i * obstacles + j
            point, square = state.obstacle_point[row], 0.0
            other = int(addresses.obstacle_geom[j])
            if plan.obstacle_radius[j] > 0.0:  # a sphere: its center
                center = vector_at(pointer_at(d + DATA_PLACE()) + 3 * DOUBLE * other, 3)
                for k in range(p):
                    point[k] = center[k]
                    square += (body[k] - center[k]) ** 2
                state.obstacle_gap[row] = math.sqrt(square) - plan.obstacle_radius[j]
                continue
            nearest = vector_at(segment + 3 * DOUBLE, 3)
            to_box = _to_box(m, d, other, body, nearest)
            depth = depth_inside(m, d, other, j, body, state, addresses, way) if to_box == 0.0 else 0.0
            if depth > 0.0:
                behind = min(depth, radius) if i < n else 0.0
                for k in range(p):
                    point[k] = body[k] - behind * way[k]
                state.obstacle_gap[row] = -depth
                continue
            state.obstacle_gap[row] = to_box
            if to_box - radius < plan.nearest_within:
                geom_distance(m, d, geom, other, FARTHEST, segment)
                for k in range(3):
                    square += (body[k] - nearest[k]) ** 2
                state.obstacle_gap[row] = math.sqrt(square)
            for k in range(p):
                point[k] = nearest[k]


@inlined
def _to_box(m: int, d: int, geom: int, body: Array, nearest: Array) -> float:
    """Distance from a point to the box around a geom, in the geom's axes [m], and its nearest point."""
    bounds = vector_at(pointer_at(m + MODEL_BOUNDS()) + 6 * DOUBLE * geom, 6)
    place = vector_at(pointer_at(d + DATA_PLACE()) + 3 * DOUBLE * geom, 3)
    turn = vector_at(pointer_at(d + DATA_TURN()) + 9 * DOUBLE * geom, 9)
    for k in range(3):
        nearest[k] = place[k]
    square = 0.0
    for axis in range(3):
        x = 0.0
        for k in range(3):
            x += turn[3 * k + axis] * (body[k] - place[k])
        inside = min(max(x, bounds[axis] - bounds[3 + axis]), bounds[axis] + bounds[3 + axis])
        square += (x - inside) * (x - inside)
        for k in range(3):
            nearest[k] += turn[3 * k + axis] * inside
    return math.sqrt(square)
