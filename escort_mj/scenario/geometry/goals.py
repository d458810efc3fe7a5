"""The waypoints of robots with goals: as given, mirrored, or drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from escort_mj.behaviors import Behavior, Goal
from escort_mj.components.random_placement import RandomPlacement
from escort_mj.scenario.geometry.placement import Array, Placement, draw_places
from escort_mj.scenario.schema.scenario import Scenario

STREAM = 2  # of random numbers, beside those of positions and of the gains of motors, with the same seed


def goals_of(
    scenario: Scenario, robots: Placement, behaviors: Sequence[Behavior]
) -> tuple[tuple[Array, ...], ...]:
    """Return the waypoints of each robot, of each behavior `goal`, shape (waypoints, p) [m].

    Args:
        scenario: A checked scenario.
        robots: Its team.
        behaviors: Of all its phases.

    Raises:
        ScenarioError: If there is no room for goals that are drawn.
    """
    return tuple(_goals(scenario, robots, goal) for goal in behaviors if isinstance(goal, Goal))


def _goals(scenario: Scenario, robots: Placement, goal: Goal) -> tuple[Array, ...]:
    if goal.goals == "opposite":
        return tuple((2.0 * robots.position.mean(axis=0) - robots.position)[:, np.newaxis])
    if isinstance(goal.goals, RandomPlacement):
        random = np.random.Generator(np.random.Philox([scenario.seed, STREAM]))
        points = np.full(robots.position.shape, np.nan)
        draw_places(scenario, goal.goals, random, points, robots.radius, "goal")
        return tuple(points[:, np.newaxis])
    return tuple(np.array(entry, dtype=float).reshape(-1, scenario.axes) for entry in goal.goals)
