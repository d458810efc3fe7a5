"""Follow: behind another body, as a trailer."""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, PositiveFloat, PrivateAttr

from escort_mj.components.component import Derived
from escort_mj.native.vectors import Vec, dot, norm
from escort_mj.policies.body import Body
from escort_mj.policies.directions import NEAR
from escort_mj.policies.policy import Leader, Policy


class Follow(Policy):
    """Follow a leader at a distance, as if towed.

    With y the vector from the body to the leader, u = y / abs(y) and w the leader's velocity, the desired
    velocity is (u . w + gain (abs(y) - distance)) u. The body thus falls in behind the leader, and makes way
    if the leader comes closer.
    """

    python_only: ClassVar[frozenset[str]] = Policy.python_only | {"leader"}
    policy: Literal["follow"] = "follow"
    leader: str = "robot_1"
    """Name of the leader, as in verdicts: `robot_1` and so on, `target`, or the name of an obstacle, of a
    team's target or of an opponent."""
    distance: Annotated[float, Field(gt=0.0, le=1e6)] = 2.0
    """Distance to keep between centers [m]."""
    gain: PositiveFloat = 2.0
    """Gain of the deviation from `distance` [1/s]."""
    _place: int = PrivateAttr(default=0)

    @Derived
    def place(self) -> float:
        """Return which body the leader is: robots come first, then the target, then obstacles."""
        return self._place

    @property
    def follows(self) -> Leader:
        """Return which body it follows."""
        return Leader(self.leader, self.distance)

    def among(self, bodies: Sequence[str]) -> Self:
        """Return it in a mission with bodies of these names."""
        found = self.model_copy()
        found._place = bodies.index(self.leader)
        return found

    def velocity(self, r: Body) -> Vec:
        """Return the velocity along the line to the leader."""
        place, pace = r.target, r.target_velocity
        leader = int(self.place)
        if leader < r.robots:
            place, pace = r.robot(leader), r.robot_velocity(leader)
        elif leader > r.robots:
            place, pace = r.obstacle(leader - r.robots - 1), r.obstacle_velocity(leader - r.robots - 1)
        way = place - r.q
        far = norm(way)
        rate = dot(way, pace) / max(far, NEAR) + self.gain * (far - self.distance)
        return min(max(rate, -self.speed), self.speed) / max(far, NEAR) * way
