"""The mission's surroundings: floor, slope, and the medium that everything moves in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat

from escort_mj.components.parameters import Parameters
from escort_mj.scenario.schema.fields import Vector

STEEPEST = math.radians(60.0)


class Floor(Parameters):
    """The floor of planar missions, on which balls roll."""

    friction: NonNegativeFloat = 1.0
    """Coefficient of sliding friction [1]."""
    rolling_friction: NonNegativeFloat = 0.0
    """Coefficient of rolling friction: the arm of the normal force against rolling [m]."""


class Slope(Parameters):
    """A floor that is not level. Coordinates are along the floor: gravity is tilted, not the world."""

    angle: Annotated[float, Field(ge=0.0, le=STEEPEST)] = 0.0
    """Angle to the horizontal [rad]."""
    direction: Annotated[float, Field(ge=-10.0, le=10.0)] = 0.0
    """Where downhill is: angle from the x axis towards y [rad]."""


class Medium(Parameters):
    """What the bodies move in: MuJoCo's drag on ellipsoids, without buoyancy."""

    density: NonNegativeFloat = 0.0
    """Density [kg/m^3]; air 1.2, water 1000."""
    viscosity: NonNegativeFloat = 0.0
    """Dynamic viscosity [Pa s]; air 1.8e-5, water 1e-3."""
    wind: Annotated[Vector, Field(min_length=2, max_length=3)] | None = None
    """Velocity of the medium [m/s], one number per axis; null: still."""


class Environment(Parameters):
    """What surrounds the mission."""

    floor: Floor = Floor()
    """The floor, where axes is 2."""
    slope: Slope = Slope()
    """How the floor is tilted, where axes is 2; with a slope gravity is on for every kind of robot."""
    medium: Medium = Medium()
    """What the bodies move in; nothing by default."""


def tilted(gravity: Sequence[float], slope: Slope) -> NDArray[np.float64]:
    """Gravity in the frame of the floor, whose x and y axes lie along the slope, shape (3,) [m/s^2].

    Args:
        gravity: On level ground [m/s^2]; it is turned about the level line, towards downhill (Rodrigues).
        slope: The slope.
    """
    g = np.array(gravity, dtype=float)
    if slope.angle == 0.0:
        return g
    level = np.array([-math.sin(slope.direction), math.cos(slope.direction), 0.0])
    sine, cosine = -math.sin(slope.angle), math.cos(slope.angle)
    return np.asarray(g * cosine + np.cross(level, g) * sine + level * (level @ g) * (1.0 - cosine))
