"""Thrust that rotors gain near the ground."""

from typing import Literal

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.disturbances.disturbance import Disturbance, Robots
from escort_mj.native.vectors import Vec, unit_axis

LOWEST = 0.5  # radii, down to which the formula holds


class GroundEffect(Disturbance):
    """Lift each robot along the last axis by what its rotor gains near the ground.

    The thrust at the height z is that of free air times 1 / (1 - (R / (4 z))^2), with the rotor's radius R
    (Cheeseman and Bennett, ARC R&M 3021, 1955). Heights below R / 2 count as R / 2.
    """

    disturbance: Literal["ground_effect"] = "ground_effect"
    thrust: NonNegativeFloat = 9.81
    """Thrust of the rotor in free air, as a rule the robot's weight [N]."""
    rotor_radius: PositiveFloat = 0.1
    """Radius of the rotor [m]."""
    ground: float = 0.0
    """Last coordinate of the ground [m]."""
    offset: float = 0.0
    """Height of the rotor above the robot's center [m]."""

    def force(self, r: Robots) -> Vec:
        """Return the gain."""
        height = np.maximum(r.q[-1] + self.offset - self.ground, LOWEST * self.rotor_radius)
        share = np.square(self.rotor_radius / (4.0 * height))
        return self.thrust * share / (1.0 - share) * unit_axis(r.q, -1)
