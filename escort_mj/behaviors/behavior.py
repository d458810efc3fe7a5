"""Base of behaviors: what one asks of each robot by itself, in NumPy and in the native loop."""

from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors.task import Situation, Task, resolve_all
from escort_mj.components.component import Component
from escort_mj.components.views import ACROSS, BEHAVIOR_OUTPUTS, NOTHING, BehaviorView

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Behavior(Component):
    """What velocity each robot is to have, and which directions that takes.

    A subclass has a key `behavior` with its name, parameters, and one of two ways to be written:

    - robot by robot, as plugins are: `wish` or `wish_kernel` or both, called with itself (in the compiled
      form: with its parameters' numbers), a `BehaviorView`, and which robot it is, from 0; it returns
      `ALONG`, `ACROSS` or `NOTHING`;
    - as those that ship are: `team_tasks`, the whole team at once in NumPy, and `wish_lanes`, eight robots
      at once in the native loop.
    """

    method: ClassVar[str] = "wish"
    view: ClassVar[type] = BehaviorView
    outputs: ClassVar[tuple[str, ...]] = BEHAVIOR_OUTPUTS
    answers: ClassVar[str | None] = "ALONG, ACROSS or NOTHING"
    gives: ClassVar[str] = "robot {} a wish"
    frame: ClassVar[Literal["target", "world"]] = "target"
    """Whether what it asks is relative to the target's motion, or not."""
    chases: ClassVar[bool] = False
    """Whether it needs a target although what it asks is not relative to the target's motion."""
    avoids: ClassVar[bool] = False
    """Whether it keeps robots away from something, and asks nothing of those that are far from it."""
    spreads: ClassVar[bool] = False
    """Whether it spreads the team evenly around the target."""

    behavior: str

    @property
    def guards(self) -> bool:
        """Whether it sends robots against opponents."""
        return False

    @property
    def convergence(self) -> float:
        """How fast it brings its error to 0 [1/s]: its `gain`, or 0 where none says so."""
        gain = getattr(self, "gain", 0.0)
        return float(gain) if isinstance(gain, int | float) else 0.0

    def team_tasks(self, now: Situation) -> tuple[Task, ...]:
        """Return its tasks, summed up where there are several; by default robot by robot, from `wish`."""
        return _tasks_by_robot(self, now)

    def asked(self, now: Situation) -> tuple[Task, ...]:
        """Return `team_tasks`, found once."""
        return now.once((id(self), "asked"), lambda: self.team_tasks(now))

    def resolved(self, now: Situation) -> tuple[Array, Array]:
        """Return velocity and null space of its tasks, see `resolve_all`."""
        return now.once((id(self), "resolved"), lambda: resolve_all(self.asked(now)))

    def active(self, now: Situation) -> Mask:
        """Return which robots it asks for anything, shape (n,)."""
        return np.ones(len(now.q), dtype=bool)

    def error(self, now: Situation) -> Array:
        """Return how far each robot is from done, shape (n,) [m]."""
        raise NotImplementedError

    def beside(self, now: Situation, below: Array) -> Array:
        """Return what it adds to its own velocity, shape (n, p) [m/s].

        Args:
            now: The situation.
            below: Velocity wanted by everything of lower priority, shape (n, p) [m/s].
        """
        return np.zeros_like(below)

    def velocity(self, now: Situation) -> Array:
        """Return what it wishes by itself, shape (n, p) [m/s]."""
        return self.resolved(now)[0].reshape(now.q.shape)


def _tasks_by_robot(behavior: Any, now: Situation) -> tuple[Task, ...]:
    """Ask a behavior that is written robot by robot."""
    (n, p), setup = now.q.shape, now.setup
    jacobian, rate = np.zeros((n, p, n, p)), np.zeros((n, p))
    for i in range(n):
        seen = BehaviorView(
            setup.timestep, setup.radius, setup.max_speed, np.array([now.time]), now.q, now.v,
            now.c[i], now.c_dot[i], setup.robot_radius, now.team.lost.astype(float), setup.obstacle_position,
            setup.obstacle_radius, np.zeros(p), np.zeros(p), np.zeros(1),
        )  # fmt: skip
        taken = behavior.wish(seen, i)
        if taken == NOTHING:
            continue
        unit = seen.wish_direction / np.linalg.norm(seen.wish_direction)
        along = np.outer(unit, unit)
        jacobian[i, :, i] = np.eye(p) - along if taken == ACROSS else along
        rate[i] = seen.wish_velocity
    return (Task(jacobian.reshape(n * p, n * p), rate.ravel()),)
