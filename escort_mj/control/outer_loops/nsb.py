"""Null-space-based composition, the paper's outer loop: its forms are in `control/nsb.py`."""

from typing import ClassVar, Literal

from escort_mj.behaviors import Behavior
from escort_mj.behaviors.task import Situation
from escort_mj.control.nsb import outer_loop
from escort_mj.control.outer_loops.outer_loop import Mask, OuterLoop
from escort_mj.native.fields import Array


class Nsb(OuterLoop):
    """Behaviors in strict priority: each acts only in the null space of those above it (paper eq. 2)."""

    title: ClassVar[str] = "NSB"
    loop: Literal["nsb"] = "nsb"

    def velocities(self, behaviors: tuple[Behavior, ...], now: Situation) -> tuple[Array, Mask]:
        """Return the behaviors composed by priority, and who avoids."""
        return outer_loop(behaviors, now)
