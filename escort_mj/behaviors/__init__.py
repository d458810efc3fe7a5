"""The behaviors of null-space-based control, one file each: any file here that defines one is found."""

from escort_mj.behaviors.avoid_obstacles import AvoidObstacles
from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.chords import Chords
from escort_mj.behaviors.formation import Formation
from escort_mj.behaviors.goal import Goal, Headed
from escort_mj.behaviors.intercept import Intercept
from escort_mj.behaviors.learned import LearnedBehavior
from escort_mj.behaviors.repulsion import Repulsion
from escort_mj.behaviors.surface import Surface
from escort_mj.behaviors.vertices import Vertices
from escort_mj.components.found import found_in

BEHAVIORS: tuple[type[Behavior], ...] = found_in(__name__, __path__, Behavior)

__all__ = [
    "BEHAVIORS",
    "AvoidObstacles",
    "Behavior",
    "Chords",
    "Formation",
    "Goal",
    "Headed",
    "Intercept",
    "LearnedBehavior",
    "Repulsion",
    "Surface",
    "Vertices",
]
