"""Breach: toward the point of a perimeter that the defenders reach last."""

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from escort_mj.native.kernels import stack_memory, vector_at
from escort_mj.policies.directions import count_of, write_direction
from escort_mj.policies.policy import ACTS, Policy, PolicyView

UNTIL, AIM = 0, 1  # what is kept
AXES = 3
NEAR = 1e-9  # m


class Breach(Policy):
    """Move to the point on a perimeter around the target where the body's lead over the robots is largest.

    The perimeter is a circle or a sphere. Robots are assumed to move along the perimeter, the shorter way
    around. The lead at a point is the time that the nearest robot needs to get there minus the time that the
    body needs; points on the far side of the perimeter, as seen from the body, are left out. Moving to the
    point of largest lead is the intruder's best response in perimeter defense (Shishika, Kumar, Local-game
    decomposition for multiplayer perimeter-defense problem, CDC 2018), apart from the resolution of one
    degree in the plane and about four degrees in space. Inside the perimeter, the body goes straight for the
    target.
    """

    seeks: ClassVar[bool] = True
    policy: Literal["breach"] = "breach"
    perimeter: Annotated[float, Field(gt=0.0, le=1e6)] = 5.0
    """Radius of the perimeter around the target [m]."""
    rival_speed: Annotated[float, Field(gt=0.0, le=1e6)] = 1.0
    """Assumed speed of the robots along the perimeter [m/s]."""
    interval: Annotated[float, Field(ge=0.0, le=1e3)] = 0.1
    """Time between choices [s]."""

    def velocity(self: Any, view: PolicyView, body: int) -> int:
        """Write the velocity toward the point."""
        kept, p = view.mover_memory[body], view.q.shape[1]
        if view.time[0] >= kept[UNTIL]:
            kept[UNTIL] = view.time[0] + self.interval
            tried, most = vector_at(stack_memory(), AXES)[:p], -math.inf
            for k in range(p):
                kept[AIM + k] = 0.0
            for c in range(count_of(p)):
                write_direction(c, tried)
                out = own = 0.0
                for k in range(p):
                    away = view.mover_position[body, k] - view.target_position[k]
                    out += tried[k] * away
                    own += (self.perimeter * tried[k] - away) ** 2
                if out < self.perimeter:
                    continue
                nearest = -1.0
                for i in range(view.q.shape[0]):
                    along = square = 0.0
                    for k in range(p):
                        way = view.q[i, k] - view.target_position[k]
                        along += tried[k] * way
                        square += way * way
                    nearest = max(nearest, along / max(math.sqrt(square), NEAR))
                arc = math.acos(min(nearest, 1.0)) * self.perimeter
                ahead = arc / self.rival_speed - math.sqrt(own) / self.speed
                if ahead > most:
                    most = ahead
                    for k in range(p):
                        kept[AIM + k] = self.perimeter * tried[k]
        square = 0.0
        for k in range(p):
            away = view.mover_position[body, k] - view.target_position[k]
            view.mover_wish[body, k] = kept[AIM + k] - away
            square += view.mover_wish[body, k] ** 2
        for k in range(p):
            view.mover_wish[body, k] *= self.speed / max(math.sqrt(square), NEAR)
        return ACTS
