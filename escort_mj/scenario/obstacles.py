"""Every fixed or moving body that stands in a mission's way, resolved from the scenario."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.scenario.findings import Path
from escort_mj.scenario.schema import Scenario

Array = NDArray[np.float64]
Shape = Literal["sphere"]
Group = Literal["obstacles", "walls"]


class Body(NamedTuple):
    """One obstacle or a part of a wall.

    Attributes:
        name: As given, or numbered.
        group: What verdicts and contacts count it among.
        shape: Of its one geom.
        size: Numbers of the shape, as MuJoCo has them: half-sizes and radii [m].
        position: Center at the start, shape (p,) [m].
        bounding_radius: Of the smallest sphere around `position` that holds all of it [m].
        path: Where the scenario says it.
    """

    name: str
    group: Group
    shape: Shape
    size: tuple[float, ...]
    position: Array
    bounding_radius: float
    path: Path


def obstacles_of(scenario: Scenario) -> tuple[Body, ...]:
    """Every obstacle and wall of a scenario, in the order in which traces number them."""
    return tuple(
        Body(
            name=obstacle.name or f"obstacle_{index + 1}",
            group="obstacles",
            shape=obstacle.shape,
            size=(obstacle.radius,),
            position=np.array(obstacle.position, dtype=float),
            bounding_radius=obstacle.radius,
            path=("obstacles", index),
        )
        for index, obstacle in enumerate(scenario.obstacles)
    )
