"""Where a mission's axes are in MuJoCo's space: the first three as they are, the others on stages apart.

A robot of more than three axes is several bodies: one moves along x, y, z, its shadows along three further
axes each. Shadows stand on stages beside the mission. A stage of one axis is an abacus with a column for each
robot; on a stage of two axes robots stand one behind another.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHADOW = "_shadow_"  # in the names of bodies that carry a robot's further axes
IN_SPACE = 3  # axes that one body can move along
DIRECTIONS = {1: "z", 2: "xz", 3: "xyz"}  # of a stage, by the number of its axes
THIN = 0.012  # of the mission's radius: rails and bars of an abacus
SPREAD = {1: "x", 2: "y"}  # where robots are set apart
THIN = 0.012  # of the mission's radius: rails and bars of an abacus
APART = 3.0  # radii of a robot from one column to the next, at least
DEPTH = 0.5  # of the mission's radius from the first robot to the last where they stand one behind another


class Stage(NamedTuple):
    """Where some axes of the mission are.

    Attributes:
        number: 0 for the mission's own place; its bodies' geoms are of this group, to be shown or hidden.
        first: First of its axes, from 0.
        directions: World direction of each of its axes, out of `xyz`.
        origin: Where all of its coordinates are zero, shape (3,) [m].
        step: From one robot to the next, shape (3,) [m].
        low: Lower corner of what happens here, shape (3,) [m].
        high: Upper corner, shape (3,) [m].
    """

    number: int
    first: int
    directions: str
    origin: Array
    step: Array
    low: Array
    high: Array

    @property
    def suffix(self) -> str:
        """What the names of its bodies end with: nothing in the mission's own place."""
        return f"{SHADOW}{self.number}" if self.number else ""

    @property
    def axes(self) -> slice:
        """Its axes among the mission's."""
        return slice(self.first, self.first + len(self.directions))

    @property
    def places(self) -> list[int]:
        """World coordinate of each of its axes, from 0."""
        return ["xyz".index(direction) for direction in self.directions]

    @property
    def is_abacus(self) -> bool:
        """Whether it shows a single axis."""
        return len(self.directions) == 1

    def place(self, position: Array, robot: float = 0.0) -> Array:
        """Where something is drawn, shape (3,) [m].

        Args:
            position: In the mission, shape (p,) [m].
            robot: Steps from the middle of the team; 0 for what is no robot.
        """
        point = self.origin + robot * self.step
        point[self.places] += position[self.axes]
        return point

    def place_at(self, height: float, robot: float) -> Array:
        """A point of a robot's column at a height, shape (3,) [m]."""
        point = self.origin + robot * self.step
        point[2] = height
        return point

    def width(self, count: int) -> float:
        """How far the columns of so many robots reach [m]."""
        return float(np.linalg.norm(self.step)) * count


def robot_steps(count: int) -> Array:
    """Steps from the middle of the team to each of so many robots, shape (count,)."""
    return np.arange(count, dtype=np.float64) - 0.5 * (count - 1)


def corners(stages: Sequence[Stage]) -> tuple[Array, Array]:
    """Lower and upper corner of the box around all stages, shape (3,) each [m]."""
    lows, highs = np.array([stage.low for stage in stages]), np.array([stage.high for stage in stages])
    return lows.min(axis=0), highs.max(axis=0)


def stages_of(
    low: Array, high: Array, height: float, radius: float, robot_radius: float, count: int
) -> list[Stage]:
    """The stages of a mission: its own place first, then one for every three further axes, along +x.

    Args:
        low: Lower corner of the mission, shape (p,) [m].
        high: Upper corner, shape (p,) [m].
        height: Of a planar mission [m].
        radius: Distance to keep from the target [m].
        robot_radius: Radius of the largest robot [m].
        count: Number of robots.
    """
    own = len(low[:IN_SPACE])
    above = np.full(IN_SPACE - own, height)
    origin = np.array([0.0, 0.0, height if own < IN_SPACE else 0.0])
    box = np.append(low[:own], above), np.append(high[:own], above)
    stages = [Stage(0, 0, "xyz"[:own], origin, np.zeros(3), *box)]
    for number, first in enumerate(range(IN_SPACE, len(low), IN_SPACE), 1):
        axes = len(low[first : first + IN_SPACE])
        directions, step = DIRECTIONS[axes], np.zeros(3)
        half = np.zeros(3)
        places = ["xyz".index(direction) for direction in directions]
        half[places] = (high - low)[first : first + axes] / 2
        if axes < IN_SPACE:
            across = "xyz".index(SPREAD[axes])
            step[across] = (
                DEPTH * radius / count if axes > 1 else max(2.0 * radius / count, APART * robot_radius)
            )
            half[across] = step[across] * count / 2 + robot_radius
        half = np.maximum(half, robot_radius)
        center = (stages[0].low + stages[0].high) / 2
        center[0] = stages[-1].high[0] + radius + half[0]
        origin = center.copy()
        origin[places] -= (high + low)[first : first + axes] / 2
        stages.append(Stage(number, first, directions, origin, step, center - half, center + half))
    return stages
