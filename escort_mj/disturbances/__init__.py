"""The disturbances, one file each: any file here that defines one is found."""

from escort_mj.components.found import found_in
from escort_mj.disturbances.disturbance import Disturbance
from escort_mj.disturbances.expressions import Expressions

DISTURBANCES: tuple[type[Disturbance], ...] = found_in(__name__, __path__, Disturbance)

__all__ = ["DISTURBANCES", "Disturbance", "Expressions"]
