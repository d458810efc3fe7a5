"""Lidars: rays by which robots know obstacles, in place of their shapes (docs/sensing.md).

A scan measures, along each ray, the distance of the obstacle that the ray meets first. The robot takes each
return for a point, as seen from where it measures itself to be, and keeps the nearest return from each
obstacle until the next scan. What no ray meets it does not know of.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np

from escort_mj.components.component import block_at, reader
from escort_mj.components.rays import stretch_in
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Recorded, Value
from escort_mj.native.on_demand import on_demand_in_space
from escort_mj.native.vectors import dot, numbers_at, set_numbers_at
from escort_mj.numerics.gaussian import LIDAR, normals
from escort_mj.plan import Plan, State
from escort_mj.sensors import Lidar

FAR = 1e7  # on each axis, for what no ray meets [m]
NOTHING = -1.0


class LidarParameters(Fields):
    """The lidar of each robot; no rays where there is none. What else it is, `Lidar` says."""

    lidar_rays: Annotated[Array, "rays", "p", Value("1", "unit vectors along the rays")]
    lidar_place: Annotated[int, Value("1", "where its block in `parameters` begins")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        lidar = setup.sensing.lidar
        rays = lidar.directions(setup.axes) if lidar else np.zeros((0, setup.axes))
        return {"lidar_rays": rays, "lidar_place": lidar or 0}


read_lidar = reader(Lidar)


class LidarSignals(Fields):
    """What lidars return; recorded where the scenario asks for it."""

    lidar_range: Annotated[
        Array,
        "returned",
        "rays",
        Recorded("m", "distance along each ray of the robot's lidar; inf if the ray hits nothing"),
    ]


class LidarState(Fields):
    """The last scan of each robot, and the ray under way."""

    lidar_point: Annotated[Array, "scanned*m", "p", Value("m", "nearest return from each obstacle")]
    lidar_nearest: Annotated[Array, "scanned*m", Value("m", "its distance in the scan")]
    ray_length: Annotated[Array, "rays", Value("m", "of each ray of one robot, up to what it meets")]
    ray_obstacle: Annotated[Array, "rays", Value("1", "what that is, from 0; -1 for nothing")]
    ray_error: Annotated[Array, "rays", Value("1", "normal numbers")]


def widest_gap(count: int, axes: int) -> float:
    """Return the greatest angle of a cone between so many rays that none is in [rad]."""
    return 2.0 * math.pi / count if axes == 2 else 1.5 * math.sqrt(4.0 * math.pi / count)


@on_demand_in_space
def scan(plan: Plan, state: State) -> None:
    """Scan from all robots, if that is due: `lidar_point`."""
    step, lidar = int(state.step[0]), read_lidar(block_at(plan.lidar_place, plan), 0)
    every = max(round(1.0 / (lidar.rate * plan.timestep)), 1)
    if step % every != 0 and state.evaluated[0] > 0.0:
        return
    m, rays = plan.obstacle_radius.shape[0], plan.lidar_rays.shape[0]
    for i in range(state.q.shape[0]):
        q = numbers_at(state, state.q, i)
        for r in range(rays):
            state.ray_length[r], state.ray_obstacle[r] = lidar.range, NOTHING
        for j in range(m):
            state.lidar_nearest[i * m + j] = math.inf
            state.lidar_point[i * m + j] = FAR
            ball = plan.obstacle_radius[j]
            if ball == 0.0:
                ball = plan.shape_reach[j] + abs(plan.shape_lift[j])
            way = q - numbers_at(state, state.obstacle_position, j)
            if dot(way, way) > (lidar.range + ball) ** 2:
                continue
            for r in range(rays):
                first, last = stretch_in(j, q, numbers_at(state, plan.lidar_rays, r), plan, state)
                first = max(first, 0.0)
                if first < last and first < state.ray_length[r]:
                    state.ray_length[r], state.ray_obstacle[r] = first, float(j)
        if lidar.noise > 0.0:
            normals(rays, plan.seed, 1, LIDAR, i, step, state.ray_error)
        for r in range(rays):
            nothing, length = state.ray_obstacle[r] == NOTHING, state.ray_length[r]
            if lidar.noise > 0.0:
                length = max(length + lidar.noise * state.ray_error[r], 0.0)
            if state.lidar_range.shape[0] > 0:
                state.lidar_range[i, r] = math.inf if nothing else length
            if nothing:
                continue
            row = i * m + int(state.ray_obstacle[r])
            if length < state.lidar_nearest[row]:
                state.lidar_nearest[row] = length
                point = numbers_at(state, state.q_measured, i)
                set_numbers_at(state.lidar_point, row, point + length * numbers_at(state, plan.lidar_rays, r))
