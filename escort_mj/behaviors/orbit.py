"""Circle the target at a given rate: the even figure of `vertices`, which turns."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from escort_mj.behaviors.vertices import Vertices
from escort_mj.behaviors.wish import Wish
from escort_mj.native.lanes import row_of, set_row
from escort_mj.plan import Plan, State

Array = NDArray[np.float64]

toward_vertex = Vertices.wish_lanes


class Orbit(Vertices):
    """Spread the robots evenly, as `vertices` does, and let them circle the target.

    With q the position of the robot and c that of the target, the behavior adds rate * A (q - c) to the
    velocity that `vertices` demands. A is the quarter turn in the plane of the first two axes, so the added
    motion is a rigid rotation and the formation stays even. Robots on the axis of rotation stay there.
    """

    behavior: Literal["orbit"] = "orbit"  # type: ignore[assignment]
    rate: Annotated[float, Field(ge=-100.0, le=100.0)] = 0.2
    """Angular rate, counterclockwise from the first axis to the second [rad/s]."""

    def wish_lanes(self, i: int, plan: Plan, state: State, x: Array, wish: Array, at: int) -> Wish:
        """Return the task of `vertices` with the rotation added: it is across q - c, as the task is."""
        found: Wish = toward_vertex(self, i, plan, state, x, wish, at)
        set_row(wish, at, row_of(wish, at) - self.rate * row_of(x, 1))
        set_row(wish, at + 1, row_of(wish, at + 1) + self.rate * row_of(x, 0))
        return found
