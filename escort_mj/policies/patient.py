"""Patient: circle the team until there is a gap, then go straight in."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from escort_mj.components.equations import Memory
from escort_mj.native.vectors import Vec, dot, norm, quarter_turn
from escort_mj.policies.body import Body
from escort_mj.policies.directions import NEAR
from escort_mj.policies.policy import Policy

GAIN = 1.0  # 1/s, of the distance from the circle


class Patient(Policy):
    """Circle the target in the plane of the first two axes until no robot is in front, then go straight in.

    A robot is in front if, seen from the target, its direction differs from the body's by less than `gap`.
    Once the body has decided to go in, it does not turn back.
    """

    seeks: ClassVar[bool] = True
    runs: ClassVar[Memory] = Memory("1", "1 once it goes in")
    policy: Literal["patient"] = "patient"
    distance: Annotated[float, Field(gt=0.0, le=1e6)] = 6.0
    """Distance from the target at which the body circles [m]."""
    gap: Annotated[float, Field(gt=0.0, le=math.pi)] = 0.7
    """Angle between the body and the nearest robot, seen from the target, above which the body goes in [rad].
    """

    def runs_next(self, r: Body) -> float:
        """Return whether it goes in: since it was on the circle and no robot was in front."""
        away, nearest = r.q - r.target, -math.inf
        far = max(norm(away), NEAR)
        for k in range(r.robots):
            way = r.robot(k) - r.target
            nearest = max(nearest, dot(way, away) / (far * max(norm(way), NEAR)))
        goes = abs(far - self.distance) < 0.1 * self.distance and nearest < math.cos(self.gap)
        return 1.0 if goes else r.runs

    def velocity(self, r: Body) -> Vec:
        """Return the velocity around the target, or toward it."""
        away = r.q - r.target
        far = max(norm(away), NEAR)
        around = self.speed * (quarter_turn(away) / far)
        wish = around - GAIN * (far - self.distance) * away / far
        if r.runs > 0.0:
            wish = -self.speed * away / far
        return self.speed / max(norm(wish), self.speed) * wish

    def acts(self, r: Body) -> bool:
        """Return whether it goes in."""
        return r.runs > 0.0
