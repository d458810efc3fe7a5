"""Burst: wait, then dash through the largest gap."""

from typing import Annotated, Any, Literal

from pydantic import Field

from escort_mj.policies.directions import write_freest
from escort_mj.policies.policy import ACTS, RESTS, Policy, PolicyView

DASHING, SINCE, DIRECTION = 0, 1, 2  # what is kept
IN_ANGLE = 1


class Burst(Policy):
    """Rest for a while, dash straight through the middle of the largest gap between robots, and repeat.

    The largest gap is the one that spans the largest angle, seen from the body. The direction is chosen at
    the start of each dash, with a resolution of one degree in the plane and about four degrees in space, and
    does not change during the dash.
    """

    policy: Literal["burst"] = "burst"
    wait: Annotated[float, Field(ge=0.0, le=1e6)] = 5.0
    """Waiting time before each dash [s]."""
    dash: Annotated[float, Field(gt=0.0, le=1e6)] = 5.0
    """Duration of each dash [s]."""

    def velocity(self: Any, view: PolicyView, body: int) -> int:
        """Write the velocity of the dash, or 0."""
        time, kept, p = view.time[0], view.mover_memory[body], view.q.shape[1]
        if kept[DASHING] > 0.0 and time >= kept[SINCE] + self.dash:
            kept[DASHING], kept[SINCE] = 0.0, time
        if kept[DASHING] == 0.0 and time >= kept[SINCE] + self.wait:
            kept[DASHING], kept[SINCE] = 1.0, time
            write_freest(view.mover_position[body], view.q, IN_ANGLE, kept[DIRECTION : DIRECTION + p])
        for k in range(p):
            view.mover_wish[body, k] = self.speed * kept[DASHING] * kept[DIRECTION + k]
        return ACTS if kept[DASHING] > 0.0 else RESTS
