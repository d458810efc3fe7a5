"""Straight: toward the target on the shortest way."""

from typing import ClassVar, Literal

from escort_mj.native.vectors import Vec, norm
from escort_mj.policies.body import Body
from escort_mj.policies.directions import NEAR
from escort_mj.policies.policy import Policy


class Straight(Policy):
    """Move straight toward the target, whatever is in between."""

    seeks: ClassVar[bool] = True
    policy: Literal["straight"] = "straight"

    def velocity(self, r: Body) -> Vec:
        """Return the velocity toward the target."""
        way = r.target - r.q
        return self.speed * way / max(norm(way), NEAR)
