"""Ways to make one velocity of a robot's behaviors, one file each. A new one: its file and one line here."""

from escort_mj.control.outer_loops.barrier_filter import BarrierFilter
from escort_mj.control.outer_loops.nsb import Nsb
from escort_mj.control.outer_loops.potential_field import PotentialField

OUTER_LOOPS = (Nsb, PotentialField, BarrierFilter)
POTENTIAL_FIELD, BARRIER_FILTER = OUTER_LOOPS.index(PotentialField), OUTER_LOOPS.index(BarrierFilter)
OuterLoop = Nsb | PotentialField | BarrierFilter

__all__ = ["OUTER_LOOPS", "BarrierFilter", "Nsb", "OuterLoop", "PotentialField"]
