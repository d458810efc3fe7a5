"""Radios, one file each: how messages pass between robots. Any file that has one is found."""

from escort_mj.components.found import found_in
from escort_mj.radios.periodic import Periodic
from escort_mj.radios.radio import Radio

RADIOS: tuple[type[Radio], ...] = found_in(__name__, __path__, Radio)

__all__ = ["RADIOS", "Periodic", "Radio"]
