"""What the controller knows, and where obstacles are at the moment."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.setup import Setup

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SetupNow(Setup):
    """What the controller knows at a moment.

    Attributes:
        obstacle_points: What each robot, and last the target, sees of each obstacle, shape (n + 1, m, p) [m];
            None where all see `obstacle_position`.
        obstacle_velocity: Of the obstacles' centers, shape (m, p) [m/s]; None where all rest.
    """

    obstacle_points: Array | None = None
    obstacle_velocity: Array | None = None

    def obstacles_seen(self) -> Array:
        """What each robot, and last the target, sees of each obstacle, shape (n + 1, m, p) [m]."""
        if self.obstacle_points is not None:
            return self.obstacle_points
        return np.broadcast_to(self.obstacle_position, (self.count + 1, *self.obstacle_position.shape))

    def obstacle_velocities(self) -> Array:
        """Velocities of the obstacles' centers, shape (m, p) [m/s]; 0 with a lidar, which measures none."""
        if self.obstacle_velocity is not None and self.sensing.lidar is None:
            return self.obstacle_velocity
        return np.zeros_like(self.obstacle_position)


def setup_now(setup: Setup, **changes: Any) -> SetupNow:
    """Return what is known of a mission, at a moment."""
    if isinstance(setup, SetupNow) and not changes:
        return setup
    return SetupNow(**{field.name: getattr(setup, field.name) for field in fields(setup)} | changes)


def radius_at(setup: Setup, team: Any, time: float) -> float:
    """Return the distance that a team keeps at a time [s] [m]."""
    return float(
        [team.radius or setup.radius, *(each.radius for each in team.radii if each.after <= time)][-1]
    )
