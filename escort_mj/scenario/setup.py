"""From a checked scenario to what the controller is told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import Behavior, Chords, Formation, Surface
from escort_mj.behaviors.formation import ALONG
from escort_mj.components.rays import KINDS
from escort_mj.components.setup import Frame, FunctionOfTime, Mover, Shape
from escort_mj.control.setup import Setup
from escort_mj.numerics.formation import Arrangement, arrange
from escort_mj.numerics.reform import Reforming, reforming
from escort_mj.numerics.thomson import Figure, even_figure, even_points, nearest_edges
from escort_mj.policies import Policy
from escort_mj.scenario.geometry.bodies import bodies_of
from escort_mj.scenario.geometry.goals import goals_of
from escort_mj.scenario.geometry.obstacles import Body
from escort_mj.scenario.geometry.placement import Placement
from escort_mj.scenario.geometry.shapes import extent, hull, rotation_matrix
from escort_mj.scenario.geometry.teams import team_center
from escort_mj.scenario.geometry.trajectory import (
    Trajectory,
    disturbance_trajectory,
    trajectory,
)
from escort_mj.scenario.schema.expressions import Expression
from escort_mj.scenario.schema.knowledge import DERIVATIVES, Knowledge
from escort_mj.scenario.schema.obstacle_tables import Drive, Motion
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.scenario.schema.sensing import sensors


def controller_setup(
    scenario: Scenario, robots: Placement, obstacles: Sequence[Body], target: FunctionOfTime
) -> Setup:
    """What the controller is told about a mission, but for the formation.

    Args:
        scenario: A checked scenario.
        robots: Its team.
        obstacles: What stands in the way.
        target: Where its target is.
    """
    return Setup(
        timestep=scenario.physics.timestep,
        seed=scenario.seed,
        behaviors=scenario.mission.behaviors,
        law=scenario.laws[0],
        **_laws(scenario, robots),
        outer=scenario.mission.outer,
        radius=scenario.mission.radius,
        target_feedforward=scenario.mission.target_feedforward,
        max_speed=scenario.mission.max_speed or math.inf,
        goals=goals_of(scenario, robots, all_behaviors(scenario)),
        formations=_formations(scenario),
        radii=tuple(
            Trajectory((Expression(scenario.mission.radius if each.radius is None else each.radius),))
            for each in all_behaviors(scenario)
            if isinstance(each, Surface) and each.has_own_radius
        ),
        obstacle_position=np.array([body.position for body in obstacles]).reshape(-1, scenario.axes),
        obstacle_radius=np.array(
            [body.bounding_radius if body.is_sphere else 0.0 for body in obstacles], dtype=float
        ),
        robot_radius=robots.radius,
        force_limit=robots.force_limit,
        mass=robots.mass,
        target_radius=scenario.target.radius if scenario.target is not None else None,
        sensing=sensors(scenario.sensing),
        target=target,
        **_knowledge(scenario),
        disturbance=disturbance_trajectory(scenario),
        disturbances=tuple(each for each in scenario.uncertainty.disturbances if not each.of_time),
        failures=scenario.robots.failures,
        phases=scenario.mission.supervisor,
        trigger=scenario.mission.trigger,
        movers=_movers(scenario, obstacles),
        opponents=scenario.opponents,
        teams=scenario.teams,
        driven=any(kind.driven for kind in robots.kind),
        shaped=any(not body.is_sphere for body in obstacles),
        extents=_extents(scenario.axes, obstacles),
        shapes=_shapes(scenario, obstacles),
        expected_distances=tuple(x for one in scenario.expect for x in one.exact_distances()),
    )


def _laws(scenario: Scenario, robots: Placement) -> dict[str, Any]:
    """Return the laws that differ, and which of them teams and robots have; nothing where all have one."""
    if len(scenario.laws) == 1:
        return {}
    own = np.full(len(robots.mass), -1)
    for each in scenario.robots.overrides:
        if each.controller is not None:
            own[each.robot - 1] = scenario.laws.index(each.controller)
    teams = tuple(scenario.laws.index(law) for law in scenario.team_laws)
    return {"laws": scenario.laws, "team_laws": teams, "own_laws": tuple(own.tolist())}


def with_formation(setup: Setup, scenario: Scenario, robots: Placement) -> Setup:
    """Return a setup with the formation that its behaviors keep, where they keep one."""
    center = setup.target.position(0.0)
    return replace(
        setup,
        arrangement=_arrangement(scenario, robots, center),
        figure=_figure(scenario, robots, center),
        reforming=_reforming(scenario, robots),
    )


def _knowledge(scenario: Scenario) -> dict[str, Any]:
    """Return what robots see, hear and make of it, where they know no more than that."""
    knowledge, communication = scenario.knowledge, scenario.communication
    if knowledge is None and communication is None:
        return {}
    knowledge = knowledge or Knowledge()
    return {
        "sight": knowledge.target,
        "radio": communication,
        "estimator": knowledge.estimator,
        "start_deviation": tuple(getattr(knowledge.initial, name) for name in DERIVATIVES),
    }


def _extents(axes: int, obstacles: Sequence[Body]) -> NDArray[np.float64] | None:
    """Return half the upright boxes around the centers of obstacles, 0 for spheres [m]; None if all are."""
    if all(body.is_sphere for body in obstacles):
        return None
    corners = [np.array(extent(body.solid)) - body.solid.center for body in obstacles]
    return np.array(
        [
            0.0 * body.position if body.is_sphere else np.abs(both).max(axis=0)[:axes]
            for body, both in zip(obstacles, corners, strict=True)
        ]
    )


def _shapes(scenario: Scenario, obstacles: Sequence[Body]) -> tuple[Shape, ...]:
    """Return obstacles as lines and rays meet them, where that matters and some are no spheres."""
    knowledge, radio = scenario.knowledge, scenario.communication
    looking = (knowledge is not None and knowledge.target.hidden) or scenario.sensing.lidar is not None
    met = looking or (radio is not None and radio.blocked)
    if not met or all(body.is_sphere for body in obstacles):
        return ()
    return tuple(
        Shape(
            KINDS[body.shape],
            np.pad(body.size, (0, 3 - len(body.size))),
            rotation_matrix(body.orientation),
            body.lift,
            body.bounding_radius,
            hull(tuple(map(tuple, body.vertices)))[1] if body.shape == "mesh" else np.zeros((0, 4)),
        )
        for body in obstacles
    )


def _movers(scenario: Scenario, obstacles: Sequence[Body]) -> tuple[Mover, ...]:
    """Obstacles that move, and a target that can be bumped, in this order."""
    driven: list[tuple[Motion, Drive, int, Policy | None]] = [
        (body.motion, body.drive, index, body.policy)
        for index, body in enumerate(obstacles)
        if body.motion is not None and body.drive is not None
    ]
    target = scenario.target
    if target is not None and target.drive is not None:
        driven.append((target, target.drive, -1, target.policy))
    names = bodies_of(scenario).names
    return tuple(
        Mover(
            trajectory(motion, scenario.axes),
            drive.mass_of(policy),
            drive.force_limit or math.inf,
            drive.gain,
            index,
            policy and policy.among(names),
        )
        for motion, drive, index, policy in driven
    )


def _formations(scenario: Scenario) -> tuple[Frame, ...]:
    """Frames of the formations, in the order of their phases."""
    found = []
    for behavior in all_behaviors(scenario):
        if not isinstance(behavior, Formation):
            continue
        way = Motion(
            position=behavior.position, waypoints=behavior.waypoints, interpolation=behavior.interpolation
        )
        along = behavior.heading == ALONG
        heading = 0.0 if along else behavior.heading
        turned = [Expression(f"cos({heading})"), Expression(f"sin({heading})"), Expression(behavior.scale)]
        function = Trajectory((*trajectory(way, scenario.axes).components, *turned))
        found.append(Frame(np.array(behavior.offsets, dtype=float), function, along, behavior.follows))
    return tuple(found)


def all_behaviors(scenario: Scenario) -> list[Behavior]:
    """Every behavior of every phase."""
    mission = scenario.mission
    return [*mission.behaviors, *(behavior for phase in mission.supervisor for behavior in phase.behaviors)]


def _arrangement(scenario: Scenario, robots: Placement, center: np.ndarray) -> Arrangement | None:
    """Places for the chords behavior, where the mission has it."""
    for behavior in all_behaviors(scenario):
        if isinstance(behavior, Chords):
            return arrange(robots.position, center, scenario.mission.radius, behavior.order)
    return None


def _figure(scenario: Scenario, robots: Placement, center: np.ndarray) -> Figure | None:
    """The even figure for the vertices behavior, where the mission has it."""
    if not _keeps_vertices(scenario):
        return None
    if any(behavior.bids for behavior in all_behaviors(scenario)):
        points = even_points(len(robots.position), scenario.axes)
        return Figure(points, *nearest_edges(points))
    if not scenario.teams:
        return even_figure(robots.position, center)
    vertices, edges, lengths = np.zeros_like(robots.position), [], []
    for each in scenario.teams:
        members = np.array(each.robots) - 1
        figure = even_figure(robots.position[members], team_center(scenario, each.name))
        vertices[members] = figure.vertices
        edges.append(np.sort(members[figure.edges], axis=1))
        lengths.append((each.radius or scenario.mission.radius) / scenario.mission.radius * figure.lengths)
    return Figure(vertices, np.concatenate(edges), np.concatenate(lengths))


def _reforming(scenario: Scenario, robots: Placement) -> Reforming | None:
    """Figures of fewer robots, where some fail or change over to another team."""
    losses = len(scenario.robots.failures)
    if scenario.teams and (losses or any(team.demand for team in scenario.teams)):
        losses = len(robots.mass) - 1  # a team may have any number of robots
    if not losses or not _keeps_vertices(scenario):
        return None
    return reforming(len(robots.mass), scenario.axes, losses)


def _keeps_vertices(scenario: Scenario) -> bool:
    return any(behavior.uses_vertices for behavior in all_behaviors(scenario))
