"""Flee: straight away from the nearest robot."""

from typing import Annotated, Literal

from pydantic import Field

from escort_mj.native.vectors import Vec, norm
from escort_mj.policies.body import Body
from escort_mj.policies.policy import Policy


class Flee(Policy):
    """Move straight away from the nearest robot while one is within sight."""

    policy: Literal["flee"] = "flee"
    sight: Annotated[float, Field(gt=0.0, le=1e6)] = 5.0
    """Distance between centers within which a robot is seen [m]."""

    def velocity(self, r: Body) -> Vec:
        """Return the velocity away from the nearest robot."""
        away = r.q - r.robot(r.nearest)
        return self.speed * away / norm(away) if 0.0 < norm(away) <= self.sight else 0.0 * away

    def acts(self, r: Body) -> bool:
        """Return whether a robot is within sight."""
        return 0.0 < norm(r.q - r.robot(r.nearest)) <= self.sight
