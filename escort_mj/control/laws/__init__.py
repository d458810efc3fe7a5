"""The inner-loop laws, one file each. A new one is its file and one line here."""

from escort_mj.control.laws.apd_smc import ApdSmc
from escort_mj.control.laws.asmc import Asmc
from escort_mj.control.laws.computed_torque import ComputedTorque
from escort_mj.control.laws.pd import Pd
from escort_mj.control.laws.pd_smc import PdSmc
from escort_mj.control.laws.super_twisting import SuperTwisting

LAWS = (ApdSmc, Asmc, PdSmc, Pd, ComputedTorque, SuperTwisting)
LawParameters = ApdSmc | Asmc | PdSmc | Pd | ComputedTorque | SuperTwisting

__all__ = ["LAWS", "ApdSmc", "Asmc", "ComputedTorque", "LawParameters", "Pd", "PdSmc", "SuperTwisting"]
