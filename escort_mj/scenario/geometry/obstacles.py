"""Every fixed or moving body that stands in a mission's way, resolved from the scenario."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from escort_mj.scenario.geometry.clutter import drawn
from escort_mj.scenario.geometry.obstacle_body import NO_VERTICES, Body
from escort_mj.scenario.geometry.opponents import opponent_bodies
from escort_mj.scenario.geometry.shapes import bounding_radius, in_space, quaternion
from escort_mj.scenario.geometry.teams import team_targets
from escort_mj.scenario.geometry.trajectory import trajectory
from escort_mj.scenario.geometry.walls import wall_boxes
from escort_mj.scenario.schema.obstacle_tables import SPHERE_RADIUS, Drive, Motion, Obstacle
from escort_mj.scenario.schema.scenario import Scenario

Array = NDArray[np.float64]

SIZES = {"box": 3, "ellipsoid": 3, "cylinder": 2, "capsule": 2}
"""How many numbers the size of a shape has."""


def obstacles_of(scenario: Scenario) -> tuple[Body, ...]:
    """Every obstacle, wall, opponent and team's target of a scenario, as traces number them.

    Raises:
        ScenarioError: If clutter is asked for and there is no room for it.
    """
    return _resolved(scenario)


def fixed_obstacles(scenario: Scenario) -> tuple[Body, ...]:
    """Obstacles and walls that the scenario places itself: all but the clutter."""
    return (*_obstacles(scenario), *wall_boxes(scenario))


@lru_cache(maxsize=16)
def _resolved(scenario: Scenario) -> tuple[Body, ...]:
    placed = fixed_obstacles(scenario)
    placed = (*placed, *drawn(scenario, placed))
    placed = (*placed, *team_targets(scenario))
    return (*placed, *opponent_bodies(scenario, placed))


def _obstacles(scenario: Scenario) -> Iterator[Body]:
    for index, obstacle in enumerate(scenario.obstacles):
        size, vertices = sizes(obstacle, scenario.axes, scenario.robots.height)
        motion = obstacle.motion or Motion(position=obstacle.position)
        yield Body(
            name=obstacle.name or f"obstacle_{index + 1}",
            group="obstacles",
            shape=obstacle.shape,
            size=size,
            position=trajectory(motion, scenario.axes).position(0.0),
            bounding_radius=bounding_radius(obstacle.shape, size, vertices),
            path=("obstacles", index),
            orientation=quaternion(obstacle.orientation),
            vertices=vertices,
            motion=obstacle.motion,
            drive=(obstacle.body or Drive()) if obstacle.motion is not None else None,
            color=obstacle.color,
        )


def sizes(obstacle: Obstacle, axes: int, height: float) -> tuple[tuple[float, ...], Array]:
    """The numbers of a shape as MuJoCo has them, and the corners of a mesh, with what may be left out.

    Args:
        obstacle: As the scenario has it.
        axes: p.
        height: Of the robots' centers in a planar mission: half of what is left out is high [m].
    """
    if obstacle.shape == "sphere":
        return (obstacle.radius or SPHERE_RADIUS,), NO_VERTICES
    if obstacle.shape == "mesh":
        vertices = np.array(obstacle.vertices, dtype=float)
        if vertices.shape[1] == 2:  # the outline of a prism
            low, high = in_space(vertices), in_space(vertices)
            low[:, 2], high[:, 2] = -height, height
            vertices = np.concatenate([low, high])
        return (), vertices
    size = obstacle.size or ()
    if axes == 2 and len(size) == SIZES[obstacle.shape] - 1:
        size = (*size, height)
    return size, NO_VERTICES


__all__ = ["Body", "fixed_obstacles", "obstacles_of"]
