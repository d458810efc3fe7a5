"""What winds have in common: where they blow, and their drag."""

import math
from typing import Annotated, Any

from pydantic import Field

from escort_mj.disturbances.disturbance import Disturbance, Robots
from escort_mj.native.kernels import inlined
from escort_mj.native.vectors import Vec, norm, quarter_turn, unit_axis


class Wind(Disturbance):
    """Base of winds: a robot has the drag of a ball of its radius, see `drag`."""

    density: Annotated[float, Field(ge=0.0, le=2e4)] = 1.2
    """Density of the air [kg/m^3]."""
    drag_coefficient: Annotated[float, Field(ge=0.0, le=1e3)] = 0.47
    """Drag coefficient, with the cross section of a ball of the robot's radius [1]."""


@inlined
def drag(self: Any, r: Robots, wind: Vec) -> Vec:
    """Return the drag in a wind [N]: rho C_d A |w| w / 2 with the relative wind w.

    Args:
        self: A `Wind`.
        r: The robots.
        wind: Velocity of the air at each robot [m/s].
    """
    relative = wind - r.v
    area = math.pi * r.radius * r.radius
    return 0.5 * self.density * self.drag_coefficient * area * norm(relative) * relative


@inlined
def toward(x: Vec, heading: float) -> Vec:
    """Return the unit vector at an angle [rad] from the first axis toward the second one.

    Args:
        x: A vector with as many axes.
        heading: The angle.
    """
    ahead = unit_axis(x, 0)
    return math.cos(heading) * ahead + math.sin(heading) * quarter_turn(ahead)
