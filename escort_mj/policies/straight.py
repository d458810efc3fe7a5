"""Straight: toward the target on the shortest way."""

import math
from typing import Any, ClassVar, Literal

from escort_mj.policies.policy import ACTS, Policy, PolicyView

NEAR = 1e-9  # m


class Straight(Policy):
    """Move straight toward the target, whatever is in between."""

    seeks: ClassVar[bool] = True
    policy: Literal["straight"] = "straight"

    def velocity(self: Any, view: PolicyView, body: int) -> int:
        """Write the velocity toward the target."""
        p, square = view.q.shape[1], 0.0
        for k in range(p):
            square += (view.target_position[k] - view.mover_position[body, k]) ** 2
        for k in range(p):
            way = view.target_position[k] - view.mover_position[body, k]
            view.mover_wish[body, k] = self.speed * way / max(math.sqrt(square), NEAR)
        return ACTS
