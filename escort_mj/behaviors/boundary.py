"""Stay on one side of a line or plane, whatever else is asked."""

from typing import ClassVar, Literal

from pydantic import NonNegativeFloat, PositiveFloat

from escort_mj.behaviors.behavior import Behavior, Plane
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Inequality, at_least
from escort_mj.components.parameters import Vector
from escort_mj.native.vectors import dot, norm


class Boundary(Behavior):
    """Keep each robot out of the half-space behind a line (in the plane) or a plane (in space).

    With the unit vector m along `normal`, h = m . (q - point) - margin - the robot's radius is not to become
    negative: a robot approaches the boundary at most at rate * h, slows down before it and does not
    cross it.
    """

    frame: ClassVar[Literal["target", "world"]] = "world"
    limits: ClassVar[bool] = True

    behavior: Literal["boundary"] = "boundary"
    point: Vector
    """A point on the line or plane [m]."""
    normal: Vector
    """A vector of any length that points to the side on which robots stay [1]."""
    margin: NonNegativeFloat = 0.1
    """Distance that a robot's surface keeps from the boundary [m]."""
    rate: PositiveFloat = 2.0
    """Share of the remaining distance that a robot may use up per second [1/s]."""

    def border(self) -> Plane:
        """Return the boundary."""
        return Plane(self.point, self.normal)

    def task(self, r: Robots) -> Inequality:
        """Return the inequality m . (q - point) >= margin + radius."""
        normal = r.vector(self.normal)
        m = normal / norm(normal)
        return at_least(dot(m, r.q - r.vector(self.point)), self.margin + r.robot_radius, m, self.rate)
