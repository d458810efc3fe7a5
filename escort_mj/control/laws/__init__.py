"""The inner-loop laws, one file each. A new one is its file and one line here."""

from escort_mj.control.laws.apd_smc import ApdSmc
from escort_mj.control.laws.asmc import Asmc
from escort_mj.control.laws.pd_smc import PdSmc

LAWS = (ApdSmc, Asmc, PdSmc)
LawParameters = ApdSmc | Asmc | PdSmc

__all__ = ["LAWS", "ApdSmc", "Asmc", "LawParameters", "PdSmc"]
