"""Avoid: toward the target, past the robots in between."""

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from escort_mj.native.kernels import stack_memory, vector_at
from escort_mj.policies.directions import count_of, write_direction
from escort_mj.policies.policy import ACTS, Policy, PolicyView

UNTIL, DIRECTION = 0, 1  # what is kept
BLOCKED = 2.0  # more than directions can differ in their cosines
AXES = 3


class Avoid(Policy):
    """Move past all robots within sight, in the direction that deviates least from the line to the target.

    A direction leads past a robot if it points away from the robot, or if a straight line in this direction
    passes the robot's center at a distance of at least `berth`. If no direction leads past all robots, the
    body heads straight for the target. The direction is chosen again after each `interval`, with a resolution
    of one degree in the plane and about four degrees in space.
    """

    seeks: ClassVar[bool] = True
    policy: Literal["avoid"] = "avoid"
    sight: Annotated[float, Field(gt=0.0, le=1e6)] = 3.0
    """Distance between centers within which a robot is seen [m]."""
    berth: Annotated[float, Field(gt=0.0, le=1e6)] = 1.0
    """Distance from a robot's center that is sufficient for passing the robot [m]."""
    interval: Annotated[float, Field(ge=0.0, le=1e3)] = 0.1
    """Time between choices [s]."""

    def velocity(self: Any, view: PolicyView, body: int) -> int:
        """Write the velocity past the robots."""
        kept, p = view.mover_memory[body], view.q.shape[1]
        if view.time[0] >= kept[UNTIL]:
            kept[UNTIL] = view.time[0] + self.interval
            tried, straight = vector_at(stack_memory(), AXES)[:p], vector_at(stack_memory(), AXES)[:p]
            far = 0.0
            for k in range(p):
                straight[k] = view.target_position[k] - view.mover_position[body, k]
                far += straight[k] * straight[k]
            for k in range(p):
                straight[k] /= max(math.sqrt(far), 1e-9)
            most = -math.inf
            for c in range(count_of(p) + 1):
                if c < count_of(p):
                    write_direction(c, tried)
                for k in range(p if c == count_of(p) else 0):
                    tried[k] = straight[k]
                value, blocked = 0.0, False
                for k in range(p):
                    value += tried[k] * straight[k]
                for i in range(view.q.shape[0]):
                    along = square = 0.0
                    for k in range(p):
                        way = view.q[i, k] - view.mover_position[body, k]
                        along += tried[k] * way
                        square += way * way
                    aside = square - along * along
                    blocked |= along > 0.0 and aside < self.berth**2 and square < self.sight**2
                value -= BLOCKED if blocked else 0.0
                if value > most:
                    most = value
                    for k in range(p):
                        kept[DIRECTION + k] = tried[k]
        for k in range(p):
            view.mover_wish[body, k] = self.speed * kept[DIRECTION + k]
        return ACTS
