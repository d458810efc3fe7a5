"""Spread over a circle from what each robot knows of its two neighbors: half the angle between them."""

import math
from typing import ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, across, speed_error, without
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import Lanes, everywhere, greatest, least
from escort_mj.native.vectors import quarter_turn, where
from escort_mj.numerics.elementary import arc_tangent

TURN = 2.0 * math.pi


class Spacing(Behavior):
    """Spread the robots evenly over a circle: each moves toward the midpoint between its two neighbors.

    Among the robots that a robot knows of, its neighbors are the next one around the target on either side
    (Marshall, Broucke, Francis 2004; Kim, Sugie 2007). Angles are measured in the plane of the first two
    axes. The behavior assigns no places to robots and needs only the directions of these two neighbors.
    """

    spreads: ClassVar[bool] = True

    behavior: Literal["spacing"] = "spacing"
    gain: PositiveFloat = 0.8
    """Gain of the distance to the midpoint [1/s]."""

    def task(self, r: Robots) -> Task:
        """Return the task across the way to the target: half the difference of both angles, as a way."""
        x = r.q - r.target
        velocity = without(x, (self.gain * _angle_to_middle(r)) * quarter_turn(x))
        return across(x, velocity, speed_error(velocity, self.gain))


@inlined
def _angle_to_middle(r: Robots) -> Lanes:
    """Return the angle of each robot to the middle between its neighbors; 0 where it knows nobody [rad]."""
    x = r.q - r.target
    own, nearest, farthest = arc_tangent(x[1], x[0]), everywhere(TURN), everywhere(0.0)
    for place in range(r.places):
        mate = r.mate(place)
        way = mate.position - r.target
        ahead = arc_tangent(way[1], way[0]) - own
        ahead = where(ahead < 0.0, ahead + TURN, ahead)
        ahead = where(ahead >= TURN, ahead - TURN, ahead)
        nearest = where(mate.seen, least(nearest, ahead), nearest)
        farthest = where(mate.seen, greatest(farthest, ahead), farthest)
    off: Lanes = where(nearest < TURN, 0.5 * (nearest + farthest - TURN), 0.0)
    return off
