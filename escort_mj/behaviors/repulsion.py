"""Spread by repulsion (Coulomb, as in the Thomson problem of remark 1), seen from the target."""

from typing import ClassVar, Literal

from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.robots import Robots
from escort_mj.behaviors.task import Task, across, inverse_square, speed_error
from escort_mj.native.lanes import everywhere, greatest, root
from escort_mj.native.vectors import dot, norm, where

SAME = 1e-24  # squared distance of two directions that differ by rounding only: neither way leads apart


class Repulsion(Behavior):
    """Spread the robots evenly: seen from the target, the others' directions repel that of each robot."""

    spreads: ClassVar[bool] = True

    behavior: Literal["repulsion"] = "repulsion"
    gain: PositiveFloat = 0.8
    """Gain of the repulsion [1/s]; the speed is at most gain times radius."""

    def task(self, r: Robots) -> Task:
        """Return the task across the way to the target: down the Coulomb energy of the directions."""
        x = r.q - r.target
        weight, push, team = inverse_square(x), 0.0 * r.q, everywhere(1.0)
        unit = root(weight) * x
        for place in range(r.places):
            mate = r.mate(place)
            way = mate.position - r.target
            apart = unit - root(inverse_square(way)) * way
            square = dot(apart, apart)
            repels = mate.seen & (square > SAME) & (dot(way, way) > 0.0)
            push = push + where(repels, 1.0 / (square * root(square)), 0.0) * apart
            team = where(mate.seen, team + 1.0, team)
        push = (push - (dot(push, x) * weight) * x) / team
        fastest = where(weight > 0.0, self.gain * r.radius / greatest(norm(push), 1.0), 0.0)
        velocity = where(fastest > 0.0, fastest * push, 0.0)
        return across(x, velocity, speed_error(velocity, self.gain))
