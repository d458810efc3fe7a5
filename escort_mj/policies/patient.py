"""Patient: circle the team until there is a gap, then go straight in."""

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from escort_mj.policies.policy import ACTS, RESTS, Policy, PolicyView

RUNS = 0  # what is kept
NEAR = 1e-9  # m
GAIN = 1.0  # 1/s, of the distance from the circle


class Patient(Policy):
    """Circle the target in the plane of the first two axes until no robot is in front, then go straight in.

    A robot is in front if, seen from the target, its direction differs from the body's by less than `gap`.
    Once the body has decided to go in, it does not turn back.
    """

    seeks: ClassVar[bool] = True
    policy: Literal["patient"] = "patient"
    distance: Annotated[float, Field(gt=0.0, le=1e6)] = 6.0
    """Distance from the target at which the body circles [m]."""
    gap: Annotated[float, Field(gt=0.0, le=math.pi)] = 0.7
    """Angle between the body and the nearest robot, seen from the target, above which the body goes in [rad].
    """

    def velocity(self: Any, view: PolicyView, body: int) -> int:
        """Write the velocity around the target, or toward it."""
        kept, p, square, nearest = view.mover_memory[body], view.q.shape[1], 0.0, -math.inf
        for k in range(p):
            square += (view.mover_position[body, k] - view.target_position[k]) ** 2
        far = max(math.sqrt(square), NEAR)
        for i in range(view.q.shape[0]):
            along = size = 0.0
            for k in range(p):
                way = view.q[i, k] - view.target_position[k]
                along += way * (view.mover_position[body, k] - view.target_position[k])
                size += way * way
            nearest = max(nearest, along / (far * max(math.sqrt(size), NEAR)))
        if abs(far - self.distance) < 0.1 * self.distance and nearest < math.cos(self.gap):
            kept[RUNS] = 1.0
        asked = 0.0
        for k in range(p):
            away = view.mover_position[body, k] - view.target_position[k]
            other = view.mover_position[body, 1 - k] - view.target_position[1 - k] if k < 2 else 0.0
            around = (-other if k == 0 else other) / far * self.speed
            wish = around - GAIN * (far - self.distance) * away / far
            view.mover_wish[body, k] = -self.speed * away / far if kept[RUNS] > 0.0 else wish
            asked += view.mover_wish[body, k] ** 2
        share = self.speed / max(math.sqrt(asked), self.speed)
        for k in range(p):
            view.mover_wish[body, k] *= share
        return ACTS if kept[RUNS] > 0.0 else RESTS
