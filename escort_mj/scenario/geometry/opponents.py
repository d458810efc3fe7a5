"""Opponents as bodies: where each starts, and what it wants."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import Fault, ScenarioError
from escort_mj.scenario.geometry.obstacle_body import Body, clear_of
from escort_mj.scenario.geometry.teams import team_center
from escort_mj.scenario.geometry.trajectory import target_trajectory
from escort_mj.scenario.schema.obstacle_tables import Motion
from escort_mj.scenario.schema.opponents import Opponents
from escort_mj.scenario.schema.scenario import Scenario

TRIES = 1000
LEAST = 1e-4  # squared length of what gives a direction
STARTS = 2  # stream of random numbers beside those of positions, with the same seed
Array = NDArray[np.float64]


def opponent_bodies(scenario: Scenario, placed: Sequence[Body]) -> Iterator[Body]:
    """Yield the opponents of a scenario, in the order in which traces number them.

    Args:
        scenario: The scenario.
        placed: What stands in the way already.

    Raises:
        ScenarioError: If there is no room for a random start.
    """
    random = np.random.Generator(np.random.Philox([scenario.seed, STARTS]))
    center, bodies = target_trajectory(scenario).position(0.0), [*placed]
    if scenario.teams:
        center = np.mean([team_center(scenario, team.name) for team in scenario.teams], axis=0)
    for index, group in enumerate(scenario.opponents):
        for number, name in enumerate(group.names):
            if group.positions is not None:
                start = np.array(group.positions[min(number, len(group.positions) - 1)], dtype=float)
            else:
                start = _drawn(group, index, center, random, bodies)
            body = Body(
                name=name,
                group="obstacles",
                shape="sphere",
                size=(group.radius,),
                position=start,
                bounding_radius=group.radius,
                path=("opponents", index),
                motion=Motion(position=tuple(map(float, start))),
                drive=group.body,
                color="purple",
                policy=group.policy,
            )
            bodies.append(body)
            yield body


def _drawn(
    group: Opponents, index: int, center: Array, random: np.random.Generator, bodies: Sequence[Body]
) -> Array:
    """Return a random start that is clear of other bodies, shape (p,) [m]."""
    for _ in range(TRIES):  # uniform in directions: of what is drawn in the cube, what is in the ball
        drawn = 2.0 * random.random(len(center)) - 1.0
        square = float(drawn @ drawn)
        start = center + group.distance / np.sqrt(max(square, LEAST)) * drawn
        if LEAST < square <= 1.0 and clear_of(bodies, start[None], group.radius).all():
            return np.asarray(start)
    words = f"found no free place for {group.count} opponents at {group.distance:g} m; give a larger distance"
    raise ScenarioError([Fault(words, f"opponents[{index}].distance")])
