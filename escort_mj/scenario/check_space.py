"""Checks of positions: their dimension, their number, and that nothing stands inside something else."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import ScenarioError
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.obstacles import Body, obstacles_of
from escort_mj.scenario.placement import Team, team
from escort_mj.scenario.schema import Scenario
from escort_mj.scenario.trajectory import target_trajectory

Array = NDArray[np.float64]

MOST_OVERLAPS = 20  # reported at once


def check_dimensions(scenario: Scenario) -> Iterator[Finding]:
    """Every vector has one number per axis, and gravity pulls where there is physics of three axes."""
    axes, target, robots = scenario.axes, scenario.target, scenario.robots
    vectors: list[tuple[Path, Sequence[Any] | None]] = [
        (("target", "position"), target.position),
        *((("target", "waypoints", i, "position"), w.position) for i, w in enumerate(target.waypoints or ())),
        *((("robots", "positions", i), position) for i, position in enumerate(robots.positions or ())),
        *((("robots", "velocities", i), velocity) for i, velocity in enumerate(robots.velocities or ())),
        *((("robots", "overrides", i, "position"), o.position) for i, o in enumerate(robots.overrides)),
        (("robots", "placement", "center"), robots.placement.center if robots.placement else None),
        *((("obstacles", i, "position"), obstacle.position) for i, obstacle in enumerate(scenario.obstacles)),
        (("uncertainty", "disturbance"), scenario.uncertainty.disturbance),
    ]
    for path, vector in vectors:
        if vector is not None and len(vector) != axes:
            yield Finding(path, f"found {len(vector)} numbers; expected {axes}, as axes says")
    gravity = scenario.physics.gravity
    if axes > 3 and gravity is not None and any(gravity):
        yield Finding(
            ("physics", "gravity"),
            f"found {list(gravity)} m/s^2 in {axes} axes; gravity pulls along x, y, z only: give "
            "uncertainty.disturbance instead, one force per axis",
        )


def check_obstacle_names(scenario: Scenario) -> Iterator[Finding]:
    """No two obstacles of one name, and none with a name that the world has for something else."""
    seen: dict[str, int] = {}
    for index, body in enumerate(obstacles_of(scenario)):
        name = body.name
        if name in ("target", "world") or re.fullmatch(r"robot_\d+|.*_shadow_\d+", name):
            yield Finding(("obstacles", index, "name"), f"found {name}; robots, target and world have theirs")
        if name in seen:
            yield Finding(("obstacles", index, "name"), f"found {name} again; obstacles[{seen[name]}] has it")
        seen.setdefault(name, index)


def check_clearance(scenario: Scenario) -> Iterator[Finding]:
    """Nothing overlaps at the start, and there is room for robots that are placed at random."""
    target = target_trajectory(scenario).position(0.0)
    for body in obstacles_of(scenario):
        gap = float(np.linalg.norm(body.position - target)) - body.bounding_radius - scenario.target.radius
        if gap < 0.0:
            yield Finding((*body.path, "position"), f"overlaps the target by {-gap:.3g} m at the start")
    try:
        robots = team(scenario)
    except ScenarioError as error:
        yield from (Finding(("robots", "placement"), fault.message) for fault in error.faults)
        return
    yield from _overlaps(scenario, robots, target)


def _overlaps(scenario: Scenario, robots: Team, target: Array) -> Iterator[Finding]:
    """Pairs of which one is a robot and which overlap at the start."""
    obstacles = obstacles_of(scenario)
    position = np.vstack([robots.position, *(body.position for body in obstacles), target])
    radius = np.array([*robots.radius, *(body.bounding_radius for body in obstacles), scenario.target.radius])
    reported = 0
    for robot in range(len(robots.radius)):
        distance = np.linalg.norm(position[robot + 1 :] - position[robot], axis=1)
        gap = distance - radius[robot + 1 :] - radius[robot]
        for other in np.flatnonzero(gap < 0.0) + robot + 1:
            reported += 1
            if reported > MOST_OVERLAPS:
                return
            mover, fixed = (other, robot) if other < len(robots.radius) else (robot, other)
            yield Finding(
                _position_path(scenario, int(mover)),
                f"robot {mover + 1} overlaps {_body(obstacles, int(fixed), len(robots.radius))} "
                f"by {-gap[other - robot - 1]:.3g} m at the start",
                related=(("obstacles", int(fixed) - len(robots.radius), "position"),),
            )


def _body(obstacles: Sequence[Body], index: int, count: int) -> str:
    if index < count:
        return f"robot {index + 1}"
    if index - count < len(obstacles):
        return obstacles[index - count].name
    return "the target"


def _position_path(scenario: Scenario, robot: int) -> Path:
    for index, override in enumerate(scenario.robots.overrides):
        if override.robot == robot + 1 and (override.position or override.radius):
            return ("robots", "overrides", index)
    return ("robots", "positions", robot) if scenario.robots.positions else ("robots", "placement")
