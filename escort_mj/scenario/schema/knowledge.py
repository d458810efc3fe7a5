"""What robots know by themselves: the tables `knowledge` and `communication`."""

from pydantic import NonNegativeFloat

from escort_mj.components.parameters import Parameters
from escort_mj.estimators import Predict
from escort_mj.knowledge.sight import TargetSight
from escort_mj.scenario.schema.fields import Estimator

DERIVATIVES = ("position", "velocity", "acceleration")


class InitialKnowledge(Parameters):
    """Standard deviations of the errors in each robot's initial knowledge of the target."""

    position: NonNegativeFloat = 0.0
    """Standard deviation of the position, per axis [m]."""
    velocity: NonNegativeFloat = 0.0
    """Standard deviation of the velocity, per axis [m/s]."""
    acceleration: NonNegativeFloat = 0.0
    """Standard deviation of the acceleration, per axis [m/s^2]; for estimators whose model contains an
    acceleration."""


class Knowledge(Parameters):
    """What robots know about the target: what they see and, with `communication`, what they hear."""

    target: TargetSight = TargetSight.model_construct()
    """How robots measure the target."""
    estimator: Estimator = Predict.model_construct()
    """How each robot estimates the target from what it sees and hears: a name, or a table with parameters."""
    initial: InitialKnowledge = InitialKnowledge.model_construct()
    """Accuracy of what robots know of the target at the start, or when they change teams."""
