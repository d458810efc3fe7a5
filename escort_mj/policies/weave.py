"""Weave: toward the target in a wavy line."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from escort_mj.native.vectors import Vec, norm, of_numbers
from escort_mj.policies.body import Body
from escort_mj.policies.directions import NEAR
from escort_mj.policies.policy import Policy


class Weave(Policy):
    """Move toward the target, swinging from side to side in the plane of the first two axes."""

    seeks: ClassVar[bool] = True
    policy: Literal["weave"] = "weave"
    angle: Annotated[float, Field(gt=0.0, le=1.5)] = 0.8
    """Largest angle between the motion and the straight line to the target [rad]."""
    period: Annotated[float, Field(gt=0.0, le=1e3)] = 4.0
    """Time from one side to the other and back [s]."""

    def velocity(self, r: Body) -> Vec:
        """Return the velocity along the wavy line."""
        way, turn = r.target - r.q, self.angle * math.sin(2.0 * math.pi * r.time / self.period)
        x = math.cos(turn) * way[0] - math.sin(turn) * way[1]
        y = math.sin(turn) * way[0] + math.cos(turn) * way[1]
        return self.speed / max(norm(way), NEAR) * of_numbers(way, x, y, way[-1])
