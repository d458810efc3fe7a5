"""Stay in the range of teammates, so that the graph of who hears whom stays in one piece."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.wish import Wish, along, square_of
from escort_mj.knowledge.teammates import mate_at, places_of, teammate_place
from escort_mj.native.lanes import WIDTH, everywhere, load_rows, root, row_of, set_row, stack_rows, where
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State

Array = NDArray[np.float64]


class Connect(Behavior):
    """Stay within `distance` of the teammates that hold the team together.

    These are a robot's neighbors in the relative neighborhood graph (Toussaint 1980) of the robots that it
    knows of: two robots are neighbors unless a third one is closer to both than they are to each other. This
    graph contains the minimum spanning tree, so the team stays connected as long as no link of the graph
    breaks. Only the farthest of these neighbors attracts the robot, and only beyond `distance`.
    """

    behavior: Literal["connect"] = "connect"
    distance: PositiveFloat
    """Distance between centers beyond which a neighbor attracts the robot [m]; use less than the radio's
    range."""
    gain: PositiveFloat = 2.0
    """Gain of the distance beyond `distance` [1/s]."""

    def wish_lanes(self, i: int, plan: Plan, state: State, x: Array, wish: Array, at: int) -> Wish:
        """Return the task along the way to the farthest neighbor: back to the distance."""
        _find_strained(i, plan, state)
        p = state.q.shape[1]
        rows = stack_rows(p)
        load_rows(state.wished_direction, i, rows)
        square = square_of(rows, 0, p)
        apart = root(square)
        strained = apart > self.distance
        speed = where(strained, self.gain * (apart - self.distance) / apart, 0.0)
        for k in range(p):
            set_row(x, k, row_of(rows, k))
            set_row(wish, at + k, speed * row_of(rows, k))
        active = where(strained, 1.0, everywhere(0.0))
        return along(where(strained, 1.0 / square, 0.0), active, where(strained, apart - self.distance, 0.0))


@on_demand
def _find_strained(i: int, plan: Plan, state: State) -> None:
    """Write the ways of robots i to i + 7 to their farthest neighbors: `wished_direction` [m]."""
    n, p = state.q.shape
    places = places_of(state)
    for robot in range(i, min(i + WIDTH, n)):
        way, longest = state.wished_direction[robot], -1.0
        for k in range(p):
            way[k] = 0.0
        for one in range(places):
            mate, age = mate_at(robot, one, plan, state)
            if mate < 0:
                continue
            own, between = 0.0, False
            for k in range(p):
                own += (teammate_place(robot, one, age, k, state) - state.q_measured[robot, k]) ** 2
            for other in range(places):
                third, old = mate_at(robot, other, plan, state)
                if other == one or third < 0:
                    continue
                nearer, beside = 0.0, 0.0
                for k in range(p):
                    place = teammate_place(robot, other, old, k, state)
                    nearer += (place - state.q_measured[robot, k]) ** 2
                    beside += (place - teammate_place(robot, one, age, k, state)) ** 2
                between = between or max(nearer, beside) < own
            if not between and own > longest:
                longest = own
                for k in range(p):
                    way[k] = teammate_place(robot, one, age, k, state) - state.q_measured[robot, k]
