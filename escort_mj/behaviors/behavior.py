"""Base of behaviors: what one asks of each robot by itself."""

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.component import Component
from escort_mj.components.views import BEHAVIOR_OUTPUTS, BehaviorView

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Behavior(Component):
    """What velocity each robot is to have, and which directions that takes.

    A subclass has a key `behavior` with its name, parameters, and one of two ways to be written:

    - robot by robot, as plugins are: `wish`, called with itself (compiled: with its parameters' numbers), a
      `BehaviorView`, and which robot it is, from 0; it returns `ALONG`, `ACROSS` or `NOTHING`;
    - as those that ship are: `task`, called with `Robots`, eight at once; it returns a `Task`.
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
