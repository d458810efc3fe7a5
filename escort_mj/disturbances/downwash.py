"""Air that rotors push down, on the robots below."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.disturbances.disturbance import Disturbance, Robots
from escort_mj.native.vectors import Vec, dot, unit_axis, where

FARTHEST = 10.0  # m, to the side
NARROWEST = 1e-12  # m^2, where the published width passes 0


class Downwash(Disturbance):
    """Push each robot down that is below others, along the last axis.

    The formula and its numbers, for Crazyflies, are those of gym-pybullet-drones (Panerati et al., IROS
    2021): h below a robot and d beside its axis, the force is a exp(-(d / b)^2 / 2) with
    a = strength (R / (4 h))^2 and b = widening h + width, where R is the propeller's radius.
    """

    sees_others: ClassVar[bool] = True
    disturbance: Literal["downwash"] = "downwash"
    strength: NonNegativeFloat = 2267.18
    """Force at a quarter of the propeller's radius below a robot, by the formula [N]."""
    propeller_radius: PositiveFloat = 0.0231348
    """Radius of the propellers [m]."""
    widening: float = 0.16
    """Growth of the width with the height [1]."""
    width: float = -0.11
    """Width at the height 0, by the formula [m]."""
    nearest: PositiveFloat = 0.5
    """Height below which the force grows no further [m]."""

    def force(self, r: Robots) -> Vec:
        """Return the sum of what all robots above push."""
        push = 0.0 * r.radius
        for place in range(r.places):
            mate = r.mate(place)
            way = mate.position - r.q
            above, aside = way[-1], dot(way, way) - way[-1] * way[-1]
            height = np.maximum(above, self.nearest)
            deviation = self.widening * height + self.width
            peak = self.strength * np.square(self.propeller_radius / (4.0 * height))
            felt = peak * np.exp(-0.5 * aside / (deviation * deviation + NARROWEST))
            push = push + where(mate.known & (above > 0.0) & (aside < FARTHEST**2), felt, 0.0)
        return -push * unit_axis(r.q, -1)
