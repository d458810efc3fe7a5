"""Go to where the target will be met on its present straight course."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.guard import guarding
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, move
from escort_mj.components.facts import Facts, Misfit
from escort_mj.components.parameters import Distance
from escort_mj.native.lanes import everywhere, greatest, least, root
from escort_mj.native.vectors import dot, where

OPPONENTS = 1  # place of that quarry among the choices


class Intercept(Behavior):
    """Send each robot to where it meets the target if the target keeps its course and speed.

    With s the speed of a robot, y the vector from it to the target and w the target's velocity, the robot
    heads for y + w t with the least t >= 0 for which abs(y + w t) = s t (Apollonius' circle; Isaacs,
    Differential Games, 1965). If the target is faster and no such t exists, the robot heads for the target's
    position at the time of the closest possible approach. Near the target, the robot's velocity relative to
    the target is at most `gain` times the remaining distance, unless the robot would then miss a faster
    target.
    """

    frame: ClassVar[Literal["target", "world"]] = "world"
    chases: ClassVar[bool] = True

    behavior: Literal["intercept"] = "intercept"
    quarry: Literal["target", "opponents"] = "target"
    """What each robot pursues: the target, or the opponent that it guards against."""
    alert: Distance | None = None
    """With `quarry: opponents`: distance from the target within which an opponent is pursued [m]; null:
    any."""
    speed: PositiveFloat | None = None
    """Speed of the robots [m/s], at most `mission.max_speed`; null: `mission.max_speed`."""
    within: Distance = 0.5
    """Center-to-center distance at which a robot has caught the target [m]; it then moves along with the
    target."""
    gain: PositiveFloat = 2.0
    """Gain of the remaining distance [1/s]."""

    def misfits(self, mission: Facts) -> Iterator[Misfit]:
        """Yield a speed that nothing tells."""
        if self.speed is None and mission.max_speed is None:
            yield Misfit("found intercept without a speed; give speed or mission.max_speed")

    @property
    def guards(self) -> bool:
        """Whether it sends robots against opponents."""
        return self.quarry == "opponents"

    def task(self: Any, r: Robots) -> Task:
        """Return the task sigma = q, which takes all directions: the velocity of the interception."""
        active, point, course = r.there, r.target, r.target_velocity
        if self.quarry == OPPONENTS:
            active = guarding(self.alert, r)
            point, course = r.threat, r.threat_velocity
        way, course = where(active, point - r.q, 0.0), where(active, course, 0.0)
        recedes, far, fast = dot(way, course), dot(way, way), dot(course, course)
        speed = min(self.speed, r.max_speed)
        lead = speed * speed - fast
        slack = recedes * recedes + lead * far
        rise = root(greatest(slack, 0.0))
        rate = where(recedes > 0.0, lead / (rise + recedes), where(far > 0.0, (rise - recedes) / far, 0.0))
        parts = where(recedes > 0.0, 1.0, where(slack < 0.0, 1.0, 0.0))
        passes = where(lead < 0.0, parts, 0.0) > 0.5
        distance = root(far)
        left = greatest(distance - self.within, 0.0)
        slowest = where(lead < 0.0, where(far > 0.0, -lead / (rise - recedes), 0.0), 0.0)
        rate = least(greatest(where(far > 0.0, self.gain * left / distance, 0.0), slowest), rate)
        behind = where(passes, -lead, 1.0)
        aside = root(greatest(far * fast - recedes * recedes, 0.0) / behind)
        later = greatest(speed * aside - recedes, 0.0) / where(passes, fast, 1.0)
        closest = way + later * course
        share = speed / root(where(passes, dot(closest, closest), 1.0))
        velocity = where(passes, share * closest, course + rate * way)
        return move(velocity, where(active, 1.0, everywhere(0.0)), where(active, left, 0.0))
