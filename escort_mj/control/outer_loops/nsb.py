"""Null-space-based composition, the paper's outer loop: `compose` of `control/nsb.py` and nothing else."""

from typing import ClassVar, Literal

from escort_mj.control.outer_loops.outer_loop import OuterLoop


class Nsb(OuterLoop):
    """Behaviors in strict priority: each acts only in the null space of those above it (paper eq. 2)."""

    title: ClassVar[str] = "NSB"
    loop: Literal["nsb"] = "nsb"
