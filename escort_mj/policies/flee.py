"""Flee: straight away from the nearest robot."""

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from escort_mj.policies.policy import ACTS, RESTS, Policy, PolicyView


class Flee(Policy):
    """Move straight away from the nearest robot while one is within sight."""

    policy: Literal["flee"] = "flee"
    sight: Annotated[float, Field(gt=0.0, le=1e6)] = 5.0
    """Distance between centers within which a robot is seen [m]."""

    def velocity(self: Any, view: PolicyView, body: int) -> int:
        """Write the velocity away from the nearest robot."""
        n, p = view.q.shape
        nearest, least = 0, math.inf
        for i in range(n):
            square = 0.0
            for k in range(p):
                square += (view.mover_position[body, k] - view.q[i, k]) ** 2
            if square < least:
                nearest, least = i, square
        alarmed = 0.0 < least <= self.sight * self.sight
        for k in range(p):
            way = view.mover_position[body, k] - view.q[nearest, k]
            view.mover_wish[body, k] = self.speed * way / math.sqrt(least) if alarmed else 0.0
        return ACTS if alarmed else RESTS
