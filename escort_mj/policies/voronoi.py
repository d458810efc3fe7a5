"""Voronoi: along the longest free way, within the points that no robot reaches first."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from escort_mj.components.equations import Memory
from escort_mj.native.vectors import Vec
from escort_mj.policies.body import Body
from escort_mj.policies.directions import freest
from escort_mj.policies.policy import Policy

IN_CELL = 2


class Voronoi(Policy):
    """Move in the direction in which the body's own Voronoi cell extends farthest, or is unbounded.

    The cell contains the points that are closer to the body than to any robot: those that it reaches first if
    no robot is faster (Zhou, Zhang, Ding, Huang, Stipanovic, Tomlin, Automatica 2016, 72, 64-72). The
    direction is chosen again after each `interval`.
    """

    until: ClassVar[Memory] = Memory("s", "time of the next choice")
    direction: ClassVar[Memory] = Memory("1", "direction chosen", vector=True)
    policy: Literal["voronoi"] = "voronoi"
    wait: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    """Waiting time before the body moves [s]."""
    interval: Annotated[float, Field(ge=0.0, le=1e3)] = 0.1
    """Time between choices [s]."""

    def until_next(self, r: Body) -> float:
        """Return the time of the next choice."""
        return r.time + self.interval if r.time >= max(r.until, self.wait) else r.until

    def direction_next(self, r: Body) -> Vec:
        """Return the direction of the longest way."""
        return freest(r, IN_CELL) if r.time >= max(r.until, self.wait) else r.direction

    def velocity(self, r: Body) -> Vec:
        """Return the velocity along the longest way."""
        return self.speed * r.direction

    def acts(self, r: Body) -> bool:
        """Return whether it has waited."""
        return r.time >= self.wait
