"""Avoid: toward the target, past the robots in between."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from escort_mj.components.equations import Memory
from escort_mj.native.kernels import inlined
from escort_mj.native.vectors import Vec, dot, norm
from escort_mj.policies.body import Body
from escort_mj.policies.directions import NEAR, count_of, direction
from escort_mj.policies.policy import Policy

BLOCKED = 2.0  # more than directions can differ in their cosines


class Avoid(Policy):
    """Move past all robots within sight, in the direction that deviates least from the line to the target.

    A direction leads past a robot if it points away from the robot, or if a straight line in this direction
    passes the robot's center at a distance of at least `berth`. If no direction leads past all robots, the
    body heads straight for the target. The direction is chosen again after each `interval`, with a resolution
    of one degree in the plane and about four degrees in space.
    """

    seeks: ClassVar[bool] = True
    until: ClassVar[Memory] = Memory("s", "time of the next choice")
    direction: ClassVar[Memory] = Memory("1", "direction chosen", vector=True)
    policy: Literal["avoid"] = "avoid"
    sight: Annotated[float, Field(gt=0.0, le=1e6)] = 3.0
    """Distance between centers within which a robot is seen [m]."""
    berth: Annotated[float, Field(gt=0.0, le=1e6)] = 1.0
    """Distance from a robot's center that is sufficient for passing the robot [m]."""
    interval: Annotated[float, Field(ge=0.0, le=1e3)] = 0.1
    """Time between choices [s]."""

    def until_next(self, r: Body) -> float:
        """Return the time of the next choice."""
        return r.time + self.interval if r.time >= r.until else r.until

    def direction_next(self, r: Body) -> Vec:
        """Return the direction past the robots that is nearest to the line to the target."""
        if r.time < r.until:
            return r.direction
        straight = (r.target - r.q) / max(norm(r.target - r.q), NEAR)
        found, most = straight, -math.inf
        for k in range(count_of(r) + 1):
            tried = direction(k, r) if k < count_of(r) else straight
            value = dot(tried, straight) - (BLOCKED if _is_blocked(tried, r, self.berth, self.sight) else 0.0)
            if value > most:
                found, most = tried, value
        return found

    def velocity(self, r: Body) -> Vec:
        """Return the velocity past the robots."""
        return self.speed * r.direction


@inlined
def _is_blocked(tried: Vec, r: Body, berth: float, sight: float) -> bool:
    """Whether a direction leads past some robot within sight nearer than the berth."""
    found = False
    for k in range(r.robots):
        way = r.robot(k) - r.q
        along, square = dot(tried, way), dot(way, way)
        found |= along > 0.0 and square - along * along < berth**2 and square < sight**2
    return found
