"""Weave: toward the target in a wavy line."""

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from escort_mj.policies.policy import ACTS, Policy, PolicyView

NEAR = 1e-9  # m


class Weave(Policy):
    """Move toward the target, swinging from side to side in the plane of the first two axes."""

    seeks: ClassVar[bool] = True
    policy: Literal["weave"] = "weave"
    angle: Annotated[float, Field(gt=0.0, le=1.5)] = 0.8
    """Largest angle between the motion and the straight line to the target [rad]."""
    period: Annotated[float, Field(gt=0.0, le=1e3)] = 4.0
    """Time from one side to the other and back [s]."""

    def velocity(self: Any, view: PolicyView, body: int) -> int:
        """Write the velocity along the wavy line."""
        p, square = view.q.shape[1], 0.0
        turn = self.angle * math.sin(2.0 * math.pi * view.time[0] / self.period)
        for k in range(p):
            way = view.target_position[k] - view.mover_position[body, k]
            view.mover_wish[body, k] = way
            square += way * way
        x, y = view.mover_wish[body, 0], view.mover_wish[body, 1]
        view.mover_wish[body, 0] = math.cos(turn) * x - math.sin(turn) * y
        view.mover_wish[body, 1] = math.sin(turn) * x + math.cos(turn) * y
        for k in range(p):
            view.mover_wish[body, k] *= self.speed / max(math.sqrt(square), NEAR)
        return ACTS
