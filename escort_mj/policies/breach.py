"""Breach: toward the point of a perimeter that the defenders reach last."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from escort_mj.components.equations import Memory
from escort_mj.native.kernels import inlined
from escort_mj.native.vectors import Vec, dot, norm
from escort_mj.policies.body import Body
from escort_mj.policies.directions import NEAR, count_of, direction
from escort_mj.policies.policy import Policy


class Breach(Policy):
    """Move to the point on a perimeter around the target where the body's lead over the robots is largest.

    The perimeter is a circle or a sphere. Robots are assumed to move along the perimeter, the shorter way
    around. The lead at a point is the time that the nearest robot needs to get there minus the time that the
    body needs; points on the far side of the perimeter, as seen from the body, are left out. Moving to the
    point of largest lead is the intruder's best response in perimeter defense (Shishika, Kumar, Local-game
    decomposition for multiplayer perimeter-defense problem, CDC 2018), apart from the resolution of one
    degree in the plane and about four degrees in space. Inside the perimeter, the body goes straight for the
    target.
    """

    seeks: ClassVar[bool] = True
    until: ClassVar[Memory] = Memory("s", "time of the next choice")
    aim: ClassVar[Memory] = Memory("m", "way from the target to the point", vector=True)
    policy: Literal["breach"] = "breach"
    perimeter: Annotated[float, Field(gt=0.0, le=1e6)] = 5.0
    """Radius of the perimeter around the target [m]."""
    rival_speed: Annotated[float, Field(gt=0.0, le=1e6)] = 1.0
    """Assumed speed of the robots along the perimeter [m/s]."""
    interval: Annotated[float, Field(ge=0.0, le=1e3)] = 0.1
    """Time between choices [s]."""

    def until_next(self, r: Body) -> float:
        """Return the time of the next choice."""
        return r.time + self.interval if r.time >= r.until else r.until

    def aim_next(self, r: Body) -> Vec:
        """Return the way from the target to the point of largest lead; none inside the perimeter."""
        if r.time < r.until:
            return r.aim
        away = r.q - r.target
        found, most = 0.0 * away, -math.inf
        for k in range(count_of(r)):
            tried = direction(k, r)
            if dot(tried, away) < self.perimeter:
                continue
            arc = math.acos(min(_nearest_cosine(tried, r), 1.0)) * self.perimeter
            ahead = arc / self.rival_speed - norm(self.perimeter * tried - away) / self.speed
            if ahead > most:
                found, most = self.perimeter * tried, ahead
        return found

    def velocity(self, r: Body) -> Vec:
        """Return the velocity toward the point."""
        way = r.aim - (r.q - r.target)
        return self.speed / max(norm(way), NEAR) * way


@inlined
def _nearest_cosine(tried: Vec, r: Body) -> float:
    """Return the cosine of the angle to the nearest robot, as seen from the target."""
    found = -1.0
    for k in range(r.robots):
        way = r.robot(k) - r.target
        found = max(found, dot(tried, way) / max(norm(way), NEAR))
    return found
