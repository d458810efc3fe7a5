"""Voronoi: along the longest free way, within the points that no robot reaches first."""

from typing import Annotated, Any, Literal

from pydantic import Field

from escort_mj.policies.directions import write_freest
from escort_mj.policies.policy import ACTS, RESTS, Policy, PolicyView

UNTIL, DIRECTION = 0, 1  # what is kept
IN_CELL = 2


class Voronoi(Policy):
    """Move in the direction in which the body's own Voronoi cell extends farthest, or is unbounded.

    The cell contains the points that are closer to the body than to any robot: those that it reaches first if
    no robot is faster (Zhou, Zhang, Ding, Huang, Stipanovic, Tomlin, Automatica 2016, 72, 64-72). The
    direction is chosen again after each `interval`.
    """

    policy: Literal["voronoi"] = "voronoi"
    wait: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    """Waiting time before the body moves [s]."""
    interval: Annotated[float, Field(ge=0.0, le=1e3)] = 0.1
    """Time between choices [s]."""

    def velocity(self: Any, view: PolicyView, body: int) -> int:
        """Write the velocity along the longest way."""
        kept, p = view.mover_memory[body], view.q.shape[1]
        if view.time[0] < self.wait:
            for k in range(p):
                view.mover_wish[body, k] = 0.0
            return RESTS
        if view.time[0] >= kept[UNTIL]:
            kept[UNTIL] = view.time[0] + self.interval
            write_freest(view.mover_position[body], view.q, IN_CELL, kept[DIRECTION : DIRECTION + p])
        for k in range(p):
            view.mover_wish[body, k] = self.speed * kept[DIRECTION + k]
        return ACTS
