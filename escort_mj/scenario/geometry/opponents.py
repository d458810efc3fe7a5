"""Opponents as bodies: where each starts, and what it wants."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from escort_mj.scenario.geometry.obstacle_body import Body
from escort_mj.scenario.geometry.trajectory import target_trajectory
from escort_mj.scenario.schema.obstacle_tables import Motion
from escort_mj.scenario.schema.opponents import Opponents
from escort_mj.scenario.schema.scenario import Scenario

STARTS = 2  # stream of random numbers beside those of positions, with the same seed
Array = NDArray[np.float64]


def opponent_bodies(scenario: Scenario) -> Iterator[Body]:
    """Yield the opponents of a scenario, in the order in which traces number them."""
    random = np.random.Generator(np.random.Philox([scenario.seed, STARTS]))
    center = target_trajectory(scenario).position(0.0)
    for index, group in enumerate(scenario.opponents):
        for number in range(group.count):
            start = _start(group, number, center, random)
            yield Body(
                name=f"{group.name}_{number + 1}",
                group="obstacles",
                shape="sphere",
                size=(group.radius,),
                position=start,
                bounding_radius=group.radius,
                path=("opponents", index),
                motion=Motion(position=tuple(map(float, start))),
                drive=group.body,
                color="orange",
                policy=group.policy,
            )


def _start(group: Opponents, number: int, center: Array, random: np.random.Generator) -> Array:
    """Return where one starts, shape (p,) [m]."""
    if group.positions is not None:
        return np.array(group.positions[min(number, len(group.positions) - 1)], dtype=float)
    while True:  # uniform in directions: of what is drawn in the cube, what is in the ball
        drawn = 2.0 * random.random(len(center)) - 1.0
        square = float(drawn @ drawn)
        if 1e-4 < square <= 1.0:
            return np.asarray(center + group.distance / np.sqrt(square) * drawn)
