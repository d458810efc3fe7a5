"""The laws of the inner loop, one file each: any file here that defines one is found."""

from escort_mj.components.found import found_in
from escort_mj.laws.apd_smc import ApdSmc
from escort_mj.laws.asmc import Asmc
from escort_mj.laws.computed_torque import ComputedTorque
from escort_mj.laws.law import Law
from escort_mj.laws.pd import Pd
from escort_mj.laws.pd_smc import PdSmc
from escort_mj.laws.super_twisting import SuperTwisting

LAWS: tuple[type[Law], ...] = found_in(__name__, __path__, Law)

__all__ = ["LAWS", "ApdSmc", "Asmc", "ComputedTorque", "Law", "Pd", "PdSmc", "SuperTwisting"]
