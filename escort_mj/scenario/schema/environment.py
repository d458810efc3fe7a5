"""The mission's surroundings: floor, slope, and the medium that everything moves in."""

import math
from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat

from escort_mj.components.parameters import Parameters, Vector

STEEPEST = math.radians(60.0)


class Floor(Parameters):
    """Floor of planar missions."""

    friction: NonNegativeFloat = 1.0
    """Coefficient of sliding friction [1]."""
    rolling_friction: NonNegativeFloat = 0.0
    """Coefficient of rolling friction: the lever arm of the normal force [m]."""


class Slope(Parameters):
    """A tilted floor. The x and y axes stay parallel to the floor: gravity is tilted instead of the world."""

    angle: Annotated[float, Field(ge=0.0, le=STEEPEST)] = 0.0
    """Angle to the horizontal [rad]."""
    direction: Annotated[float, Field(ge=-10.0, le=10.0)] = 0.0
    """Downhill direction: angle from the x axis toward y [rad]."""


class Medium(Parameters):
    """Medium with MuJoCo's drag model for ellipsoids, without buoyancy."""

    largest: ClassVar[float] = 2e4

    density: NonNegativeFloat = 0.0
    """Density [kg/m^3]; air 1.2, water 1000."""
    viscosity: NonNegativeFloat = 0.0
    """Dynamic viscosity [Pa s]; air 1.8e-5, water 1e-3."""
    wind: Annotated[Vector, Field(min_length=2, max_length=3)] | None = None
    """Velocity of the medium, one number per axis [m/s]; null: at rest."""


class Environment(Parameters):
    """Floor, slope and medium."""

    floor: Floor = Floor.model_construct()
    """Floor, in planar missions."""
    slope: Slope = Slope.model_construct()
    """Slope of the floor, in planar missions; with a slope, gravity acts on every kind of robot."""
    medium: Medium = Medium.model_construct()
    """Medium in which the bodies move; none by default."""


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
