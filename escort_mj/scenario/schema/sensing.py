"""The table `sensing`: what robots measure, how well, and how far they see (docs/sensing.md)."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.parameters import Parameters, Radius, one_of
from escort_mj.scenario.schema.fields import one_of_kinds
from escort_mj.sensing.sensors import Sensors, own_of
from escort_mj.sensors import QUANTITIES, SENSORS, Lidar, Plain, Sensor

Array = NDArray[np.float64]

NAMES = ("position", "velocity", "target_position", "target_velocity")


def sensor_of(quantity: str, members: Sequence[type[Sensor]]) -> Any:
    """Return the type of what measures a quantity: one of the sensors that can."""
    fitting = [member for member in members if quantity in member.measures]
    if quantity == "heading":
        return one_of_kinds(fitting) | None if fitting else None
    return one_of_kinds(fitting, "plain")


if TYPE_CHECKING:
    OfPosition: TypeAlias = Sensor
    OfVelocity: TypeAlias = Sensor
    OfTargetPosition: TypeAlias = Sensor
    OfTargetVelocity: TypeAlias = Sensor
    OfHeading: TypeAlias = Sensor | None
    OfObstacles: TypeAlias = Lidar | None
else:
    OfPosition, OfVelocity, OfTargetPosition, OfTargetVelocity, OfHeading = (
        one_of(Sensor, partial(sensor_of, quantity), SENSORS) for quantity in QUANTITIES
    )
    OfObstacles = one_of_kinds([Lidar], "lidar") | None


class SensingRadius(Parameters):
    """Detection range of the robots, measured surface to surface; robots ignore bodies beyond it."""

    robots: Radius | None = None
    """Range at which robots detect each other [m]; null: unlimited."""
    obstacles: Radius | None = None
    """Range at which robots detect obstacles [m]; null: unlimited."""


class Sensing(Parameters):
    """Sensors; quantities that a scenario does not list here are measured without error."""

    position: OfPosition = Plain.model_construct()
    """The robots' own positions [m]."""
    velocity: OfVelocity = Plain.model_construct()
    """The robots' own velocities [m/s]."""
    target_position: OfTargetPosition = Plain.model_construct()
    """The target's position [m], measured once for the whole team."""
    target_velocity: OfTargetVelocity = Plain.model_construct()
    """The target's velocity [m/s], measured once for the whole team."""
    heading: OfHeading = None
    """The robots' own headings in the plane of the first two axes [rad], which are only recorded; null: not
    measured."""
    radius: SensingRadius = SensingRadius.model_construct()
    """Range at which robots detect obstacles and each other."""
    lidar: OfObstacles = None
    """Lidar on each robot, which replaces knowledge of the obstacles' shapes; null: no lidar, and robots know
    the shapes."""

    @property
    def channels(self) -> tuple[Sensor, Sensor, Sensor, Sensor]:
        """The sensors in the order of NAMES."""
        return self.position, self.velocity, self.target_position, self.target_velocity

    @property
    def own(self) -> dict[str, Sensor]:
        """The sensors that are not plain, by what they measure."""
        return own_of(self)


def sensors(sensing: Sensing) -> Sensors:
    """Return the sensors of a mission."""
    sight = sensing.radius
    return Sensors(
        *sensing.channels,
        np.inf if sight.robots is None else sight.robots,
        np.inf if sight.obstacles is None else sight.obstacles,
        sensing.lidar,
        sensing.heading,
    )
