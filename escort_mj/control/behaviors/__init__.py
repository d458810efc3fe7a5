"""The behaviors of null-space-based control, one file each: any file here that defines one is found."""

from escort_mj.control.behaviors.avoid_obstacles import AvoidObstacles
from escort_mj.control.behaviors.behavior import Behavior
from escort_mj.control.behaviors.chords import Chords
from escort_mj.control.behaviors.repulsion import Repulsion
from escort_mj.control.behaviors.surface import Surface
from escort_mj.control.behaviors.vertices import Vertices
from escort_mj.control.found import found_in

BEHAVIORS: tuple[type[Behavior], ...] = found_in(__name__, __path__, Behavior)

__all__ = ["BEHAVIORS", "AvoidObstacles", "Behavior", "Chords", "Repulsion", "Surface", "Vertices"]
