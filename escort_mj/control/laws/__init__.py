"""The laws of the inner loop, one file each: any file here that defines one is found."""

from escort_mj.control.found import found_in
from escort_mj.control.laws.apd_smc import ApdSmc
from escort_mj.control.laws.asmc import Asmc
from escort_mj.control.laws.computed_torque import ComputedTorque
from escort_mj.control.laws.law import Law
from escort_mj.control.laws.pd import Pd
from escort_mj.control.laws.pd_smc import PdSmc
from escort_mj.control.laws.super_twisting import SuperTwisting

LAWS: tuple[type[Law], ...] = found_in(__name__, __path__, Law)

__all__ = ["LAWS", "ApdSmc", "Asmc", "ComputedTorque", "Law", "Pd", "PdSmc", "SuperTwisting"]
