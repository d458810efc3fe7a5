"""Gains that fit a scenario's robots: what the rule of `laws.gains` needs, read off the scenario."""

from __future__ import annotations

import math
from typing import NamedTuple

from escort_mj.laws import Law
from escort_mj.laws.gains import LAWS_WITH_A_RULE, Rate, Robot, gains_of, rate_of
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


def law_of(scenario: Scenario, team: int | None) -> Law:
    """Return the law of a team, from 0; None for the scenario's own."""
    return (None if team is None else scenario.teams[team].controller) or scenario.controller


def proposal(scenario: Scenario, team: int | None = None) -> Proposal | None:
    """Return gains for a law and its robots; None where the law has no rule, or robots have servos.

    All these robots have the same gains: those of the robot that allows the least m a.

    Args:
        scenario: The mission.
        team: Whose law, from 0; None for the scenario's own.
    """
    law = str(law_of(scenario, team).law)
    robots = placed(scenario)
    each = [(index, _robot(scenario, robots, index)) for index in _members(scenario, team)]
    pushed = [(index, robot) for index, robot in each if robot is not None]
    if law not in LAWS_WITH_A_RULE or not pushed:
        return None
    index, robot = min(pushed, key=lambda pair: pair[1].mass * rate_of(law, pair[1]).value)
    rate = rate_of(law, robot)
    return Proposal(law, gains_of(law, robot, rate.value), index + 1, robot, rate)


def _members(scenario: Scenario, team: int | None) -> list[int]:
    """Return the robots that may have a team's law, from 0: all, where robots change over."""
    own = [
        robot - 1
        for number, each in enumerate(scenario.teams)
        if number == team or (team is None and each.controller is None)
        for robot in each.robots
    ]
    changing = any(each.demand for each in scenario.teams)
    return own if own and not changing else [*range(robot_count(scenario))]


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
