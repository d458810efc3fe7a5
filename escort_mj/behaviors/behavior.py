"""Base of behaviors: what one asks of each robot by itself."""

from typing import Any, ClassVar, Literal

from escort_mj.behaviors.robots import Robots
from escort_mj.components.equations import Equations
from escort_mj.components.views import BEHAVIOR_OUTPUTS, BehaviorView
from escort_mj.native.values import names_of


class Behavior(Equations):
    """What velocity each robot is to have, and which directions that takes.

    A subclass has a key `behavior` with its name, parameters, and the equation `task(self, r)`, which returns
    what `keep`, `keep_distance`, `across`, `move` or `both` make; or, with `limits: ClassVar[bool] = True`,
    what `at_least` makes. Kernels evaluate it for eight robots at once.
    """

    method: ClassVar[str] = "task"
    asks: ClassVar[tuple[str, ...]] = ("task",)
    reads: ClassVar[tuple[tuple[str, str], ...]] = tuple((name, name) for name in names_of(Robots))
    keeps: ClassVar[str] = ""
    view: ClassVar[type] = BehaviorView
    outputs: ClassVar[tuple[str, ...]] = BEHAVIOR_OUTPUTS
    answers: ClassVar[str | None] = ""
    gives: ClassVar[str] = "robot {} a velocity"
    limits: ClassVar[bool] = False
    """Whether what it asks is an inequality."""
    frame: ClassVar[Literal["target", "world"]] = "target"
    """Whether what it asks is relative to the target's motion, or not."""
    chases: ClassVar[bool] = False
    """Whether it needs a target although what it asks is not relative to the target's motion."""
    avoids: ClassVar[bool] = False
    """Whether it keeps robots away from something, and asks nothing of those that are far from it."""
    spreads: ClassVar[bool] = False
    """Whether it spreads the team evenly around the target."""

    behavior: str

    def task(self, r: Robots) -> Any:
        """Return the task.

        Args:
            r: The robots, and what they know: `q`, `target`, `radius` and more.
        """
        raise NotImplementedError

    @property
    def looks_within(self) -> float:
        """Distance from which on it makes no difference to it by how much an obstacle is farther [m]."""
        return 0.0

    @property
    def bids(self) -> bool:
        """Whether robots bid for the places that it gives them."""
        return False

    @property
    def guards(self) -> bool:
        """Whether it sends robots against opponents."""
        return False

    @property
    def convergence(self) -> float:
        """How fast it brings its error to 0 [1/s]: its `gain`, or 0 where none says so."""
        gain = getattr(self, "gain", 0.0)
        return float(gain) if isinstance(gain, int | float) else 0.0
