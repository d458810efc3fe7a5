"""Checks of positions: their dimension, their number, and that nothing stands inside something else."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import ScenarioError
from escort_mj.scenario.checks.obstacles import check_drive
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.geometry.obstacles import Body
from escort_mj.scenario.geometry.placement import Placement
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario

Array = NDArray[np.float64]

FARTHEST = 1e5  # m from its center that a placement allows
MOST_OVERLAPS = 20  # reported at once


def check_gravity(mission: Mission) -> Iterator[Finding]:
    """Gravity pulls where there is physics of three axes, and wind blows along all of them."""
    scenario = mission.scenario
    axes, wind = scenario.axes, scenario.environment.medium.wind
    if wind is not None and len(wind) != axes:
        yield Finding(
            ("environment", "medium", "wind"), f"found {len(wind)} numbers; expected {axes}, as axes says"
        )
    gravity = scenario.physics.gravity
    if axes > 3 and gravity is not None and any(gravity):
        yield Finding(
            ("physics", "gravity"),
            f"found {list(gravity)} m/s^2 in {axes} axes; gravity pulls along x, y, z only: give "
            "uncertainty.disturbance instead, one force per axis",
        )


def check_body(mission: Mission) -> Iterator[Finding]:
    """A target that can be bumped has axes to be bumped along, and a drive that the timestep can follow."""
    scenario = mission.scenario
    target = scenario.target
    if target is None or target.drive is None:
        return
    if scenario.axes > 3:
        key = "body" if target.policy is None else "policy"
        yield Finding(
            ("target", key), f"found in {scenario.axes} axes; expected 2 or 3: there the target is kinematic"
        )
    yield from check_drive(scenario, target.drive, ("target", "body"))


def check_around(mission: Mission) -> Iterator[Finding]:
    """Robots that are placed around the target by chance find themselves within what placement allows."""
    scenario = mission.scenario
    if scenario.robots.positions is not None or scenario.robots.placement is not None:
        return
    radii: list[tuple[Path, float | None]] = [
        (("teams", i, "radius"), t.radius) for i, t in enumerate(scenario.teams)
    ]
    for path, radius in [(("mission", "radius"), scenario.mission.radius), *radii]:
        if radius is not None and 2.0 * radius > FARTHEST:
            words = (
                f"found {radius:g} m; expected at most {0.5 * FARTHEST:g} m, or robots.positions or placement"
            )
            yield Finding(path, words)


def check_clearance(mission: Mission) -> Iterator[Finding]:
    """Nothing overlaps at the start, and there is room for robots that are placed at random."""
    scenario = mission.scenario
    target = mission.target.position(0.0)
    radius = -math.inf if scenario.target is None else scenario.target.radius
    for body in mission.obstacles:
        gap = float(body.gaps(target[np.newaxis])[0]) - radius
        if gap < 0.0:
            yield Finding(
                (*body.path, "position"), f"{_the(body)}overlaps the target by {-gap:.3g} m at the start"
            )
    try:
        robots = mission.team
    except ScenarioError as error:
        yield from (Finding(("robots", "placement"), fault.message) for fault in error.faults)
        return
    yield from _overlaps(mission, robots, np.linalg.norm(robots.position - target, axis=1) - radius)


def _overlaps(mission: Mission, robots: Placement, to_target: Array) -> Iterator[Finding]:
    """Pairs of which one is a robot and which overlap at the start, given their gaps to the target [m]."""
    obstacles, count = mission.obstacles, len(robots.radius)
    others = np.array([*(body.gaps(robots.position) for body in obstacles), to_target]).T
    reported = 0
    for robot in range(count):
        distance = np.linalg.norm(robots.position[robot + 1 :] - robots.position[robot], axis=1)
        gap = np.concatenate([distance - robots.radius[robot + 1 :], others[robot]]) - robots.radius[robot]
        for place in np.flatnonzero(gap < 0.0):
            reported += 1
            if reported > MOST_OVERLAPS:
                return
            other = robot + 1 + int(place)
            mover, fixed = (other, robot) if other < count else (robot, other)
            bodies = (*(body.path for body in obstacles), ("target",))
            yield Finding(
                _position_path(mission.scenario, mover),
                f"robot {mover + 1} overlaps {_body(obstacles, fixed, count)} "
                f"by {-gap[place]:.3g} m at the start",
                related=((*bodies[fixed - count], "position"),) if fixed >= count else (),
            )


def _body(obstacles: Sequence[Body], index: int, count: int) -> str:
    if index < count:
        return f"robot {index + 1}"
    if index - count < len(obstacles):
        return obstacles[index - count].name
    return "the target"


def _the(body: Body) -> str:
    """Which part of a wall, or which of the clutter; what stands alone in the file needs no name."""
    return "" if body.path[0] == "obstacles" else f"{body.name} "


def _position_path(scenario: Scenario, robot: int) -> Path:
    for index, override in enumerate(scenario.robots.overrides):
        if override.robot == robot + 1 and (override.position or override.radius):
            return ("robots", "overrides", index)
    return ("robots", "positions", robot) if scenario.robots.positions else ("robots", "placement")
