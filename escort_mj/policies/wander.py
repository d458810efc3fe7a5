"""Wander: from one random place to the next."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from escort_mj.components.equations import Memory
from escort_mj.native.kernels import inlined
from escort_mj.native.vectors import Vec, dot, norm
from escort_mj.policies.body import Body
from escort_mj.policies.directions import NEAR
from escort_mj.policies.policy import Policy

ARRIVED = 0.05  # of the reach


class Wander(Policy):
    """Move from one random place to the next, in a box around the start."""

    drawn: ClassVar[Memory] = Memory("1", "how many places it has drawn")
    place: ClassVar[Memory] = Memory("m", "the last of them", vector=True)
    policy: Literal["wander"] = "wander"
    reach: Annotated[float, Field(gt=0.0, le=1e6)] = 5.0
    """Half the edge length of the box, which is centered on the start [m]."""

    def drawn_next(self, r: Body) -> float:
        """Return one more where the body has arrived, and at first."""
        return r.drawn + 1.0 if _arrived(r, ARRIVED * self.reach) else r.drawn

    def place_next(self, r: Body) -> Vec:
        """Return another place there."""
        if not _arrived(r, ARRIVED * self.reach):
            return r.place
        return r.start + self.reach * r.random(int(r.drawn) + 1)

    def velocity(self, r: Body) -> Vec:
        """Return the velocity toward the place."""
        way = r.place - r.q
        return self.speed * way / max(norm(way), NEAR)


@inlined
def _arrived(r: Any, near: float) -> bool:
    """Whether a body is so near to its place, or has none yet."""
    way = r.place - r.q
    return r.drawn == 0.0 or dot(way, way) <= near**2
