"""A lidar on each robot: `sensing.lidar` has its kernel."""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat

from escort_mj.components.parameters import Radius
from escort_mj.native.fields import Array
from escort_mj.sensors.sensor import Sensor

RAYS = {2: 72, 3: 500}
"""Rays of a lidar by the number of axes, if nothing else is said."""


class Lidar(Sensor):
    """Rays from the center of each robot that measure the distance to the first obstacle or wall."""

    measures: ClassVar[tuple[str, ...]] = ("obstacles",)
    python_only: ClassVar[frozenset[str]] = Sensor.python_only | {"rays", "record"}
    sensor: Literal["lidar"] = "lidar"
    rays: Annotated[int, Field(ge=8, le=4096)] | None = None
    """Number of rays, spread evenly over a circle in the plane and over a sphere in space; null: 72 in the
    plane and 500 in space."""
    range: Radius = 10.0
    """Largest distance that a ray measures [m]."""
    noise: NonNegativeFloat = 0.0
    """Standard deviation of the normally distributed error of each distance [m]."""
    rate: PositiveFloat | None = None
    """Scans per second [1/s], a whole number of physics steps apart; null: at every step."""
    record: bool = False
    """Whether to record `lidar_range`, the distance along each ray."""

    def count(self, axes: int) -> int:
        """Return the number of rays."""
        return self.rays or RAYS[2 if axes == 2 else 3]

    def directions(self, axes: int) -> Array:
        """Return unit vectors along the rays in the world's axes, shape (k, p)."""
        return even_rays(self.count(axes), axes)


def even_rays(count: int, axes: int) -> Array:
    """Return unit vectors evenly around in the plane, or in a golden spiral over the sphere, shape (k, p)."""
    number: Array = np.arange(count, dtype=float)
    if axes == 2:
        turn = 2.0 * np.pi * number / count
        return np.column_stack([np.cos(turn), np.sin(turn)])
    height, turn = 1.0 - (2.0 * number + 1.0) / count, np.pi * (3.0 - math.sqrt(5.0)) * number
    across = np.sqrt(1.0 - height * height)
    return np.column_stack([across * np.cos(turn), across * np.sin(turn), height])
