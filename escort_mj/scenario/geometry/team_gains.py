"""Gains that fit a scenario's robots: what the rule of `laws.gains` needs, read off the scenario."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from escort_mj.laws import Law
from escort_mj.laws.gains import LAWS_WITH_A_RULE, Rate, Robot, gains_of, rate_of
from escort_mj.scenario.findings import Path
from escort_mj.scenario.geometry.placement import Placement, gravity_of, robot_count
from escort_mj.scenario.geometry.placement import team as placed
from escort_mj.scenario.schema.scenario import Scenario, Uncertainty

STEPS = 1.5  # delay of a controller that samples, in steps: it holds its force for one


class Proposal(NamedTuple):
    """Gains that fit robots with the same law.

    Attributes:
        law: Name of the law.
        gains: Values by key.
        robot: Number of the robot that they are made for: the one that allows the least force per speed.
        about: What it is like.
        rate: Of the velocity loop, and what limits it.
    """

    law: str
    gains: dict[str, float]
    robot: int
    about: Robot
    rate: Rate


def owners(scenario: Scenario) -> Iterator[Path]:
    """Yield whose laws there are: the mission's, where some robots have it, those of teams and of robots."""
    if not scenario.teams or any(each.controller is None for each in scenario.teams):
        yield ()
    yield from (("teams", k) for k, each in enumerate(scenario.teams) if each.controller is not None)
    overrides = enumerate(scenario.robots.overrides)
    yield from (("robots", "overrides", k) for k, each in overrides if each.controller is not None)


def law_of(scenario: Scenario, owner: Path = ()) -> Law:
    """Return the law of an owner, see `owners`."""
    table: Any = scenario
    for key in owner:
        table = table[key] if isinstance(key, int) else getattr(table, key)
    law: Law = table.controller or scenario.controller
    return law


def proposal(scenario: Scenario, owner: Path = ()) -> Proposal | None:
    """Return gains for a law and its robots; None where the law has no rule, or robots have servos.

    All these robots have the same gains: those of the robot that allows the least m a.

    Args:
        scenario: The mission.
        owner: Whose law, see `owners`.
    """
    law = str(law_of(scenario, owner).law)
    robots = placed(scenario)
    each = [(index, _robot(scenario, robots, index)) for index in _members(scenario, owner)]
    pushed = [(index, robot) for index, robot in each if robot is not None]
    if law not in LAWS_WITH_A_RULE or not pushed:
        return None
    index, robot = min(pushed, key=lambda pair: pair[1].mass * rate_of(law, pair[1]).value)
    rate = rate_of(law, robot)
    return Proposal(law, gains_of(law, robot, rate.value), index + 1, robot, rate)


def _members(scenario: Scenario, owner: Path) -> list[int]:
    """Return the robots that may have an owner's law, from 0: all, where robots change over."""
    overrides = scenario.robots.overrides
    if owner[:1] == ("robots",):
        return [overrides[int(owner[-1])].robot - 1]
    team = owner[-1] if owner else None
    own = [
        robot - 1
        for number, each in enumerate(scenario.teams)
        if number == team or (team is None and each.controller is None)
        for robot in each.robots
    ]
    changing = any(each.demand for each in scenario.teams)
    found = own if own and not changing else [*range(robot_count(scenario))]
    apart = {each.robot - 1 for each in overrides if each.controller is not None}
    return [robot for robot in found if robot not in apart] or found


def _robot(scenario: Scenario, robots: Placement, index: int) -> Robot | None:
    """Return what the rule needs of a robot; None where its own servos make the force."""
    kind, mass, radius = robots.kind[index], float(robots.mass[index]), float(robots.radius[index])
    sensing, step = scenario.sensing, scenario.physics.timestep
    delay = STEPS * step + robots.actuators[index].lag
    delay += max(sensing.position.late, sensing.velocity.late)
    limit, effective = float(robots.force_limit[index]), kind.effective_mass(mass)
    gravity = gravity_of(scenario)
    craft = kind.craft(mass, radius, gravity, robots.height)
    drive = kind.drive_model(mass, radius)
    if drive is not None:
        if not drive.pushes:
            return None
        axes = slice(0, min(scenario.axes, 3))
        effective, limit = min(drive.effective_mass[axes]), min(limit, *drive.limits[axes])
        if craft is None and math.isfinite(drive.bandwidth):
            delay += 1.0 / drive.bandwidth
    if craft is not None:
        loops = (craft.damping_x, craft.stiffness_x), (craft.damping_y, craft.stiffness_y)
        delay += max((damping / stiffness for damping, stiffness in loops if stiffness > 0.0), default=0.0)
    noise, speed_noise = (each.deviation(scenario.axes) for each in (sensing.position, sensing.velocity))
    most = scenario.mission.max_speed or math.inf
    disturbed = scenario.uncertainty != Uncertainty() or not kind.flies
    return Robot(effective, delay, limit, noise, speed_noise, most, kind.swing(gravity), disturbed)
