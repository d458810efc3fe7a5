"""What robots know by themselves: the tables `knowledge` and `communication`."""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat

from escort_mj.components.parameters import Parameters
from escort_mj.estimators import Predict
from escort_mj.knowledge.sight import MEASURES, NOT_MEASURED, Sight
from escort_mj.radios.radio import Robots, Share
from escort_mj.scenario.schema.fields import Estimator

DERIVATIVES = ("position", "velocity", "acceleration")


class SightNoise(Parameters):
    """Standard deviations of the normally distributed errors with which robots measure the target."""

    position: NonNegativeFloat = 0.0
    """Standard deviation of the position, per axis [m]."""
    velocity: NonNegativeFloat = 0.0
    """Standard deviation of the velocity, per axis [m/s]."""
    range: NonNegativeFloat = 0.0
    """Standard deviation of the distance [m]."""
    bearing: Annotated[float, Field(ge=0.0, le=0.5)] = 0.0
    """Standard deviation of the direction [rad]."""


class Outliers(Parameters):
    """Measurements that are wrong by more than the noise."""

    share: Share
    """Probability of an outlier [1]."""
    size: PositiveFloat
    """Largest additional error of the distance, and of the position per axis [m]."""


class TargetSight(Parameters):
    """How robots measure the target."""

    robots: Robots | None = None
    """Robots, by number, that can see the target (with `teams`: all targets of their team); null: all
    robots."""
    range: PositiveFloat | None = None
    """Distance up to which robots see the target, surface to surface [m]; null: any."""
    field_of_view: Annotated[float, Field(gt=0.0, lt=2.0 * math.pi)] | None = None
    """Opening angle of the cone around a robot's heading in which the robot sees the target [rad]; null: all
    around."""
    hidden: bool = False
    """Whether obstacles and walls hide the target."""
    hidden_by_teammates: bool = False
    """Whether teammates hide the target."""
    rate: PositiveFloat | None = None
    """Looks per second [1/s], a whole number of physics steps apart; null: at every step."""
    measures: Annotated[
        tuple[Literal["position", "velocity", "range", "bearing"], ...], Field(min_length=1)
    ] = (
        "position",
        "velocity",
    )
    """Measured quantities: `position` and `velocity` in the world frame, `range` and `bearing` from the
    robot."""
    noise: SightNoise = SightNoise()
    """Normally distributed errors of the measurements, added to those of `sensing.target_position` and
    `sensing.target_velocity`."""
    dropout: Share = 0.0
    """Probability that a look yields no measurement [1]."""
    outliers: Outliers | None = None
    """Measurements that are wrong by more than the noise; null: none."""


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

    target: TargetSight = TargetSight()
    """How robots measure the target."""
    estimator: Estimator = Predict()
    """How each robot estimates the target from what it sees and hears: a name, or a table with parameters."""
    initial: InitialKnowledge = InitialKnowledge()
    """Accuracy of what robots know of the target at the start, or when they change teams."""


def sight_of(knowledge: Knowledge, timestep: float, count: int) -> Sight:
    """Return how robots see the target, in the controller's numbers.

    Args:
        knowledge: The table.
        timestep: Physics step [s].
        count: Number of robots.
    """
    target = knowledge.target
    noise = [getattr(target.noise, name) if name in target.measures else NOT_MEASURED for name in MEASURES]
    outliers = target.outliers
    return Sight(
        tuple(target.robots is None or robot in target.robots for robot in range(1, count + 1)),
        np.inf if target.range is None else target.range,
        steps_of(target.rate, timestep),
        tuple(noise),
        target.dropout,
        outliers.share if outliers else 0.0,
        outliers.size if outliers else 0.0,
        target.hidden,
        target.hidden_by_teammates,
        np.inf if target.field_of_view is None else target.field_of_view,
    )


def steps_of(rate: float | None, timestep: float) -> int:
    """Return how many physics steps apart events of a rate are; null stands for every step."""
    return 1 if rate is None else max(round(1.0 / (rate * timestep)), 1)
