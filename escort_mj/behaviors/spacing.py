"""Spread over a circle from what each robot knows of its two neighbors: half the angle between them."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.wish import Wish, across, look_at_target, square_of
from escort_mj.knowledge.belief import target_place
from escort_mj.knowledge.teammates import mate_at, places_of, teammate_place
from escort_mj.native.lanes import WIDTH, everywhere, load_rows, root, row_of, set_row, stack_rows, where
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State

Array = NDArray[np.float64]

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

    def wish_lanes(self, i: int, plan: Plan, state: State, x: Array, wish: Array, at: int) -> Wish:
        """Return the task across the way to the target: half the difference of both angles, as a way."""
        _find_middles(i, plan, state)
        p = state.q.shape[1]
        look_at_target(i, plan, state, x)
        square, rows = square_of(x, 0, p), stack_rows(p)
        weight = where(square > 0.0, 1.0 / square, 0.0)
        load_rows(state.wished_velocity, i, rows)
        inward = everywhere(0.0)
        for k in range(p):
            set_row(wish, at + k, self.gain * row_of(rows, k))
            inward = inward + self.gain * row_of(rows, k) * row_of(x, k)
        for k in range(p):
            set_row(wish, at + k, row_of(wish, at + k) - inward * weight * row_of(x, k))
        return across(weight, root(square_of(wish, at, p)) / self.gain)


@on_demand
def _find_middles(i: int, plan: Plan, state: State) -> None:
    """Write the ways of robots i to i + 7 to the middles between their neighbors: `wished_velocity` [m]."""
    (n, p), heard = state.q.shape, state.link_from.shape[0] > 0
    for robot in range(i, min(i + WIDTH, n)):
        center, wished, q = target_place(robot, plan, state), state.wished_velocity[robot], state.q_measured
        x, y = q[robot, 0] - center[0], q[robot, 1] - center[1]
        own, nearest, farthest = math.atan2(y, x), TURN, 0.0
        for k in range(p):
            wished[k] = 0.0
        someone = False
        for place in range(places_of(state)):
            j, age = mate_at(robot, place, plan, state)
            if j < 0:
                continue
            square = 0.0
            for k in range(p):
                square += (q[robot, k] - teammate_place(robot, place, age, k, state)) ** 2
            gap = math.sqrt(square) - plan.robot_radius[robot] - plan.robot_radius[j]
            if not heard and gap > plan.sensing_robots:
                continue
            across = teammate_place(robot, place, age, 0, state) - center[0]
            ahead = math.atan2(teammate_place(robot, place, age, 1, state) - center[1], across) - own
            if ahead < 0.0:
                ahead += TURN
            if ahead >= TURN:
                ahead -= TURN
            nearest, farthest, someone = min(nearest, ahead), max(farthest, ahead), True
        if someone:
            off = 0.5 * (nearest + farthest - TURN)
            wished[0], wished[1] = -off * y, off * x
