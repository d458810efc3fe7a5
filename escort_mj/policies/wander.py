"""Wander: from one random place to the next."""

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from escort_mj.numerics.gaussian import POLICY, fractions
from escort_mj.policies.policy import ACTS, Policy, PolicyView

DRAWN, PLACE = 0, 1  # what is kept
ARRIVED = 0.05  # of the reach


class Wander(Policy):
    """Move from one random place to the next, in a box around the start."""

    policy: Literal["wander"] = "wander"
    reach: Annotated[float, Field(gt=0.0, le=1e6)] = 5.0
    """Half the edge length of the box, which is centered on the start [m]."""

    def velocity(self: Any, view: PolicyView, body: int) -> int:
        """Write the velocity toward the place."""
        kept, p, square = view.mover_memory[body], view.q.shape[1], 0.0
        for k in range(p):
            square += (kept[PLACE + k] - view.mover_position[body, k]) ** 2
        if kept[DRAWN] == 0.0 or square <= (ARRIVED * self.reach) ** 2:
            kept[DRAWN] += 1.0
            a, b, c, _ = fractions(view.seed, 1, POLICY, body, int(kept[DRAWN]))
            square = 0.0
            for k in range(p):
                drawn = a if k == 0 else (b if k == 1 else c)
                kept[PLACE + k] = view.mover_start[body, k] + self.reach * (2.0 * drawn - 1.0)
                square += (kept[PLACE + k] - view.mover_position[body, k]) ** 2
        for k in range(p):
            way = kept[PLACE + k] - view.mover_position[body, k]
            view.mover_wish[body, k] = self.speed * way / max(math.sqrt(square), 1e-9)
        return ACTS
