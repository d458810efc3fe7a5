"""Outer loops, one file each: how behaviors become one velocity. Any file here that defines one is found."""

from escort_mj.components.found import found_in
from escort_mj.control.outer_loops.barrier_filter import BarrierFilter
from escort_mj.control.outer_loops.nsb import Nsb
from escort_mj.control.outer_loops.outer_loop import OuterLoop
from escort_mj.control.outer_loops.potential_field import PotentialField
from escort_mj.control.outer_loops.set_based import SetBased

OUTER_LOOPS: tuple[type[OuterLoop], ...] = found_in(__name__, __path__, OuterLoop)

__all__ = ["OUTER_LOOPS", "BarrierFilter", "Nsb", "OuterLoop", "PotentialField", "SetBased"]
