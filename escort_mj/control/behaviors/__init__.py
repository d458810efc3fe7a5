"""The behaviors of null-space-based control, one file each. A new one is its file and one line here."""

from escort_mj.control.behaviors.avoid_obstacles import AvoidObstacles
from escort_mj.control.behaviors.chords import Chords
from escort_mj.control.behaviors.surface import Surface

BEHAVIORS = (AvoidObstacles, Chords, Surface)
BehaviorParameters = AvoidObstacles | Chords | Surface

__all__ = ["BEHAVIORS", "AvoidObstacles", "BehaviorParameters", "Chords", "Surface"]
