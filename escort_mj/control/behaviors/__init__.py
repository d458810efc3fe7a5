"""The behaviors of null-space-based control, one file each. A new one is its file and one line here."""

from escort_mj.control.behaviors.avoid_obstacles import AvoidObstacles
from escort_mj.control.behaviors.chords import Chords
from escort_mj.control.behaviors.repulsion import Repulsion
from escort_mj.control.behaviors.surface import Surface
from escort_mj.control.behaviors.vertices import Vertices

BEHAVIORS = (AvoidObstacles, Chords, Vertices, Repulsion, Surface)
BehaviorParameters = AvoidObstacles | Chords | Vertices | Repulsion | Surface

__all__ = ["BEHAVIORS", "AvoidObstacles", "BehaviorParameters", "Chords", "Repulsion", "Surface", "Vertices"]
