"""Stay on the circle or sphere around the target (paper eq. 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveFloat

from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.task import Situation, Task, half_squared_distance
from escort_mj.behaviors.wish import Wish, along, keep_distance, look_at_point
from escort_mj.native.lanes import everywhere

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State

Array = NDArray[np.float64]


class Surface(Behavior):
    """Keep each robot at the mission's radius from the target."""

    behavior: Literal["surface"] = "surface"
    gain: PositiveFloat = 0.8
    """Gain of the task error [1/s] (paper: Lambda_3)."""

    def team_tasks(self, now: Situation) -> tuple[Task, ...]:
        """Return eq. 5: sigma = |q - c|^2 / 2 is to become radius^2 / 2."""
        sigma, jacobian = half_squared_distance(now.q, now.c)
        return (Task(jacobian, self.gain * (0.5 * now.setup.radius**2 - sigma)),)

    def error(self, now: Situation) -> Array:
        """Return | |q - c| - radius |."""
        return np.abs(np.linalg.norm(now.q - now.c, axis=1) - now.setup.radius)

    def wish_lanes(self, i: int, plan: Plan, state: State, x: Array, wish: Array, at: int) -> Wish:
        """The same for robots i to i + 7, compiled."""
        look_at_point(i, state.q_measured, state.target_position_measured, x)
        weight, error = keep_distance(state.q.shape[1], plan.radius, self.gain, x, 0, wish, at)
        return along(weight, everywhere(1.0), abs(error))
