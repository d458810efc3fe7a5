"""Stand between an opponent and the target."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, move
from escort_mj.components.parameters import UNLIMITED, Distance
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import everywhere, greatest
from escort_mj.native.vectors import dot, norm, where

NEAR = 1e-9  # m


class Guard(Behavior):
    """Place a robot between each opponent and the target.

    Each approaching opponent is assigned one robot, the most urgent opponent first; the other robots follow
    behaviors of lower priority. With y the vector from
    the target to the opponent and w the opponent's velocity relative to the target, the robot goes to the
    point at `distance` * y / abs(y) from the target and moves with this point, whose velocity relative to the
    target is `distance` * (I - y y^T / abs(y)^2) w / abs(y).
    """

    frame: ClassVar[Literal["target", "world"]] = "world"

    behavior: Literal["guard"] = "guard"
    distance: Distance | None = None
    """Distance from the target at which robots take up position [m]; null: `mission.radius`, or the radius of
    their team."""
    alert: Distance | None = None
    """Distance of an opponent from the target within which robots guard against it [m]; null: any."""
    gain: PositiveFloat = 2.0
    """Gain of the remaining distance [1/s]."""

    @property
    def guards(self) -> bool:
        """Whether it sends robots against opponents."""
        return True

    def task(self: Any, r: Robots) -> Task:
        """Return the task sigma = q of the robots that guard, which takes all directions."""
        active = guarding(self.alert, r)
        y = where(active, r.threat - r.target, 0.0)
        w = where(active, r.threat_velocity - r.target_velocity, 0.0)
        far = greatest(norm(y), NEAR)
        scale = self.distance / far
        if self.distance == UNLIMITED:  # null
            scale = r.radius / far
        way = r.target + scale * y - r.q
        aside = w - (dot(y, w) / (far * far)) * y
        velocity = self.gain * way + r.target_velocity + scale * aside
        left = norm(where(active, way, 0.0))
        return move(velocity, where(active, 1.0, everywhere(0.0)), left)


@inlined
def guarding(alert: float, r: Robots) -> Any:
    """Which robots guard against an opponent near enough to the target.

    Args:
        alert: Distance from the target within which an opponent counts [m].
        r: The robots.
    """
    way = r.threat - r.target
    return r.guards & (dot(way, way) <= alert * alert)
