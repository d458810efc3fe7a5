"""Stay in the range of teammates, so that the graph of who hears whom stays in one piece."""

from typing import Literal

from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, along
from escort_mj.components.parameters import Distance
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import everywhere
from escort_mj.native.vectors import Vec, dot, norm, where


class Connect(Behavior):
    """Stay within `distance` of the teammates that hold the team together.

    These are a robot's neighbors in the relative neighborhood graph (Toussaint 1980) of the robots that it
    knows of: two robots are neighbors unless a third one is closer to both than they are to each other. This
    graph contains the minimum spanning tree, so the team stays connected as long as no link of the graph
    breaks. Only the farthest of these neighbors attracts the robot, and only beyond `distance`.
    """

    behavior: Literal["connect"] = "connect"
    distance: Distance
    """Distance between centers beyond which a neighbor attracts the robot [m]; use less than the radio's
    range."""
    gain: PositiveFloat = 2.0
    """Gain of the distance beyond `distance` [1/s]."""

    def task(self, r: Robots) -> Task:
        """Return the task along the way to the farthest neighbor: back to the distance."""
        way = _farthest_neighbor(r)
        apart = norm(way)
        strained = apart > self.distance
        beyond = where(strained, apart - self.distance, 0.0)
        weight = where(strained, 1.0 / (apart * apart), 0.0)
        on, value = where(strained, 1.0, everywhere(0.0)), -0.5 * apart * apart
        return along(way, weight, where(strained, self.gain * beyond / apart, 0.0) * way, on, beyond, value)


@inlined
def _farthest_neighbor(r: Robots) -> Vec:
    """Return the way of each robot to its farthest neighbor in the graph; 0 where it has none [m]."""
    farthest, longest = 0.0 * r.q, everywhere(-1.0)
    for place in range(r.places):
        mate = r.mate(place)
        way = mate.position - r.q
        apart, between = dot(way, way), everywhere(0.0)
        for another in range(r.places):
            third = r.mate(another)
            if another != place:
                nearer, beside = third.position - r.q, third.position - mate.position
                lies_between = third.known & (dot(nearer, nearer) < apart) & (dot(beside, beside) < apart)
                between = where(lies_between, 1.0, between)
        farther = mate.known & (between < 0.5) & (apart > longest)
        longest = where(farther, apart, longest)
        farthest = where(farther, way, farthest)
    return farthest
