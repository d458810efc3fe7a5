"""Water that flows, and its drag."""

from typing import Literal

from pydantic import NonNegativeFloat

from escort_mj.components.parameters import Speed
from escort_mj.disturbances.disturbance import Disturbance, Robots
from escort_mj.disturbances.wind import toward
from escort_mj.native.vectors import Vec, norm


class Current(Disturbance):
    """Drag in a current, linear and quadratic in the relative velocity of the water, whatever its direction.

    The default coefficients are those of the model ship CyberShip II in surge, without the cubic one
    (Skjetne, Smogeli and Fossen, Modeling, Identification and Control 25(1), 2004); in sway, it has
    0.88965 kg/s and 36.47287 kg/m.
    """

    disturbance: Literal["current"] = "current"
    speed: Speed = 0.1
    """Speed of the current [m/s]."""
    heading: float = 0.0
    """Direction toward which it flows at the start: angle from the x axis toward y [rad]."""
    turn_rate: float = 0.0
    """Rate at which this direction turns [rad/s]."""
    linear: NonNegativeFloat = 0.72253
    """Coefficient of the relative velocity [kg/s]."""
    quadratic: NonNegativeFloat = 1.32742
    """Coefficient of the relative velocity times its size [kg/m]."""
    still_water: bool = True
    """Whether the drag in still water acts here, too; false for robots that have it already, as
    `surface_vessel` has: only what the current adds acts."""

    def force(self, r: Robots) -> Vec:
        """Return the drag, or its difference from that in still water."""
        water = self.speed * toward(r.q, self.heading + self.turn_rate * r.time) - r.v
        force = (self.linear + self.quadratic * norm(water)) * water
        return force if self.still_water else force + (self.linear + self.quadratic * norm(r.v)) * r.v
