"""The kinds of robots, one file each: any file here that defines one is found."""

from escort_mj.components.found import found_in
from escort_mj.robots.kind import RobotKind
from escort_mj.robots.point_mass import PointMass

KINDS: tuple[type[RobotKind], ...] = tuple(
    sorted(found_in(__name__, __path__, RobotKind), key=lambda kind: len(kind.model_fields))
)
"""Simplest first: by their number of parameters, then by name."""

__all__ = ["KINDS", "PointMass", "RobotKind"]
