"""Burst: wait, then dash through the largest gap."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from escort_mj.components.equations import Memory
from escort_mj.native.kernels import inlined
from escort_mj.native.vectors import Vec
from escort_mj.policies.body import Body
from escort_mj.policies.directions import freest
from escort_mj.policies.policy import Policy

IN_ANGLE = 1


class Burst(Policy):
    """Rest for a while, dash straight through the middle of the largest gap between robots, and repeat.

    The largest gap is the one that spans the largest angle, seen from the body. The direction is chosen at
    the start of each dash, with a resolution of one degree in the plane and about four degrees in space, and
    does not change during the dash.
    """

    dashes: ClassVar[Memory] = Memory("1", "1 during a dash")
    since: ClassVar[Memory] = Memory("s", "time at which the dash or the rest began")
    direction: ClassVar[Memory] = Memory("1", "direction of the last dash", vector=True)
    policy: Literal["burst"] = "burst"
    wait: Annotated[float, Field(ge=0.0, le=1e6)] = 5.0
    """Waiting time before each dash [s]."""
    dash: Annotated[float, Field(gt=0.0, le=1e6)] = 5.0
    """Duration of each dash [s]."""

    def dashes_next(self, r: Body) -> float:
        """Return whether the body dashes now."""
        return 1.0 if _begins(r, self.wait, self.dash) else 0.0 if _ends(r, self.dash) else r.dashes

    def since_next(self, r: Body) -> float:
        """Return since when."""
        return r.time if _begins(r, self.wait, self.dash) or _ends(r, self.dash) else r.since

    def direction_next(self, r: Body) -> Vec:
        """Return the direction."""
        return freest(r, IN_ANGLE) if _begins(r, self.wait, self.dash) else r.direction

    def velocity(self, r: Body) -> Vec:
        """Return the velocity of the dash, or 0."""
        return self.speed * r.dashes * r.direction

    def acts(self, r: Body) -> bool:
        """Return whether it dashes."""
        return r.dashes > 0.0


@inlined
def _ends(r: Any, dash: float) -> bool:
    """Whether a dash ends now."""
    return r.dashes > 0.0 and r.time >= r.since + dash


@inlined
def _begins(r: Any, wait: float, dash: float) -> bool:
    """Whether a dash begins now."""
    rests_since = r.time if _ends(r, dash) else r.since
    return (r.dashes == 0.0 or _ends(r, dash)) and r.time >= rests_since + wait
