"""Follow: behind another body, as a trailer."""

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, PositiveFloat, PrivateAttr

from escort_mj.components.component import Component
from escort_mj.native.vectors import Vec, dot, norm
from escort_mj.policies.body import Body
from escort_mj.policies.directions import NEAR
from escort_mj.policies.policy import Policy


class Follow(Policy):
    """Follow a leader at a distance, as if towed.

    With y the vector from the body to the leader, u = y / abs(y) and w the leader's velocity, the desired
    velocity is (u . w + gain (abs(y) - distance)) u. The body thus falls in behind the leader, and makes way
    if the leader comes closer.
    """

    python_only: ClassVar[frozenset[str]] = Component.python_only | {"leader"}
    policy: Literal["follow"] = "follow"
    leader: str = "robot_1"
    """Name of the leader, as in verdicts: `robot_1` and so on, `target`, or the name of an obstacle, of a
    team's target or of an opponent."""
    distance: Annotated[float, Field(gt=0.0, le=1e6)] = 2.0
    """Distance to keep between centers [m]."""
    gain: PositiveFloat = 2.0
    """Gain of the deviation from `distance` [1/s]."""
    _place: int = PrivateAttr(default=0)  # of the leader: robots come first, then the target, then obstacles

    @classmethod
    def numbers(cls) -> dict[str, type]:
        """Return what kernels read: also which body the leader is."""
        return super().numbers() | {"place": int}

    def packed(self, setup: Any = None) -> dict[str, float]:
        """Return its parameters as numbers."""
        return {
            "speed": self.speed, "distance": self.distance, "gain": self.gain, "place": float(self._place),
        }  # fmt: skip

    def among(self, bodies: Sequence[str]) -> Self:
        """Return it in a mission with bodies of these names."""
        found = self.model_copy()
        found._place = bodies.index(self.leader)
        return found

    def velocity(self, r: Body) -> Vec:
        """Return the velocity along the line to the leader."""
        place, pace = r.target, r.target_velocity
        if self.place < r.robots:
            place, pace = r.robot(int(self.place)), r.robot_velocity(int(self.place))
        elif self.place > r.robots:
            j = int(self.place) - r.robots - 1
            place, pace = r.obstacle(j), r.obstacle_velocity(j)
        way = place - r.q
        far = norm(way)
        rate = dot(way, pace) / max(far, NEAR) + self.gain * (far - self.distance)
        return min(max(rate, -self.speed), self.speed) / max(far, NEAR) * way
