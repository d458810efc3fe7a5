"""Obstacles as the controller has them: where they are, and what robots see of those that are no spheres."""

from __future__ import annotations

from typing import Annotated, Any

from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Recorded, Value
from escort_mj.native.kernels import inlined, merged
from escort_mj.native.lanes import lane_numbers, least
from escort_mj.native.vectors import Vec, numbers_at, one_row, rows_from, where
from escort_mj.plan import Plan, State


class ObstacleParameters(Fields):
    """Obstacles as the mission begins; m of them."""

    obstacle_position: Annotated[Array, "m", "p", Value("m", "center of each at the start")]
    obstacle_radius: Annotated[Array, "m", Value("m", "of each; 0 for those that are no spheres")]
    seen_radius: Annotated[Array, "m", Value("m", "the same as robots see them; 0 for returns of a lidar")]
    obstacle_extent: Annotated[
        Array, "m", "p", Value("m", "half the upright box around the center of each; 0 for spheres")
    ]
    shaped: Annotated[bool, Value("1", "whether some obstacle is no sphere")]
    nearest_within: Annotated[
        float, Value("m", "from here on the box around a shape will do for its nearest point")
    ]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        return {name: getattr(setup, name) for name in cls.__annotations__}


class ObstacleSignals(Fields):
    """Where obstacles are."""

    obstacle_position: Annotated[Array, "m", "p", Recorded("m", "center of each obstacle")]


class ObstacleState(Fields):
    """What each robot, and last the target, sees of each obstacle, where some are no spheres."""

    obstacle_point: Annotated[Array, "seen*m", "p", Value("m", "nearest point, of a sphere its center")]
    obstacle_gap: Annotated[Array, "seen*m", Value("m", "from a center to its surface, negative inside")]
    obstacle_velocity: Annotated[Array, "m", "p", Value("m/s", "of each center")]


@merged
def obstacles_seen(robot: int, plan: Plan, state: State) -> Array:
    """Where a robot finds each obstacle: its center, or if it is no sphere its nearest point, shape (m, p).

    With a lidar, the nearest return. Distances to obstacles are those to these points less
    `plan.seen_radius`, which is 0 for all that are no spheres, and for returns; those of the target are less
    `plan.obstacle_radius`.

    Args:
        robot: From 0; the number of robots for the target.
        plan: Gives the obstacles.
        state: Gives where they are.
    """
    m = plan.obstacle_radius.shape[0]
    if plan.lidar_rays.shape[0] > 0 and robot < state.q.shape[0]:
        return state.lidar_point[robot * m : (robot + 1) * m]
    if plan.shaped:
        return state.obstacle_point[robot * m : (robot + 1) * m]
    return state.obstacle_position


@inlined
def obstacle_places(i: int, j: int, plan: Plan, state: State) -> Vec:
    """Where robots i to i + 7 find obstacle j [m]; as `obstacles_seen`."""
    m = plan.obstacle_radius.shape[0]
    if plan.shaped or plan.lidar_rays.shape[0] > 0:
        robots = least(lane_numbers() + float(i), float(state.q.shape[0] - 1))
        row = robots * float(m) + float(j)
        if plan.lidar_rays.shape[0] > 0:
            return rows_from(state, state.lidar_point, row)
        return rows_from(state, state.obstacle_point, row)
    return one_row(state, state.obstacle_position[j])


@inlined
def obstacle_speed(j: int, plan: Plan, state: State) -> Vec:
    """Return the velocity of an obstacle [m/s]: 0 with a lidar, which does not measure it."""
    return where(plan.lidar_rays.shape[0] > 0, 0.0, numbers_at(state, state.obstacle_velocity, j))
