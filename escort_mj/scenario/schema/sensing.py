"""The table `sensing`: what robots measure, how well, and how far they see (docs/sensing.md)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat

from escort_mj.components.parameters import Parameters, Radius
from escort_mj.scenario.schema.fields import one_of_kinds
from escort_mj.scenario.schema.knowledge import steps_of
from escort_mj.sensing.lidar import LidarSensor as LidarRays
from escort_mj.sensing.lidar import even_rays
from escort_mj.sensing.sensors import Channel, Sensors
from escort_mj.sensors import QUANTITIES, SENSORS, Plain, Sensor

Array = NDArray[np.float64]

NAMES = ("position", "velocity", "target_position", "target_velocity")
RAYS = {2: 72, 3: 500}
"""Rays of a lidar by the number of axes, if nothing else is said."""


def sensor_of(quantity: str, members: Sequence[type[Sensor]]) -> Any:
    """Return the type of what measures a quantity: one of the sensors that can."""
    fitting = [member for member in members if quantity in member.measures]
    if quantity == "heading":
        return one_of_kinds(fitting, "sensor") | None if fitting else None
    return one_of_kinds(fitting, "sensor", "plain")


if TYPE_CHECKING:
    OfPosition: TypeAlias = Sensor
    OfVelocity: TypeAlias = Sensor
    OfTargetPosition: TypeAlias = Sensor
    OfTargetVelocity: TypeAlias = Sensor
    OfHeading: TypeAlias = Sensor | None
else:
    OfPosition, OfVelocity, OfTargetPosition, OfTargetVelocity, OfHeading = (
        sensor_of(quantity, SENSORS) for quantity in QUANTITIES
    )


class SensingRadius(Parameters):
    """Detection range of the robots, measured surface to surface; robots ignore bodies beyond it."""

    robots: Radius | None = None
    """Range at which robots detect each other [m]; null: unlimited."""
    obstacles: Radius | None = None
    """Range at which robots detect obstacles [m]; null: unlimited."""


class Lidar(Parameters):
    """Rays from the center of each robot that measure the distance to the first obstacle or wall."""

    rays: Annotated[int, Field(ge=8, le=4096)] | None = None
    """Number of rays, spread evenly over a circle in the plane and over a sphere in space; null: 72 in the
    plane and 500 in space."""
    range: Radius = 10.0
    """Largest distance that a ray measures [m]."""
    noise: NonNegativeFloat = 0.0
    """Standard deviation of the normally distributed error of each distance [m]."""
    rate: PositiveFloat | None = None
    """Scans per second [1/s], a whole number of physics steps apart; null: at every step."""
    record: bool = False
    """Whether to record `lidar_range`, the distance along each ray."""


class Sensing(Parameters):
    """Sensors; quantities that a scenario does not list here are measured without error."""

    position: OfPosition = Plain()
    """The robots' own positions [m]."""
    velocity: OfVelocity = Plain()
    """The robots' own velocities [m/s]."""
    target_position: OfTargetPosition = Plain()
    """The target's position [m], measured once for the whole team."""
    target_velocity: OfTargetVelocity = Plain()
    """The target's velocity [m/s], measured once for the whole team."""
    heading: OfHeading = None
    """The robots' own headings in the plane of the first two axes [rad], which are only recorded; null: not
    measured."""
    radius: SensingRadius = SensingRadius()
    """Range at which robots detect obstacles and each other."""
    lidar: Lidar | None = None
    """Lidar on each robot, which replaces knowledge of the obstacles' shapes; null: no lidar, and robots know
    the shapes."""

    @property
    def channels(self) -> tuple[Sensor, Sensor, Sensor, Sensor]:
        """The sensors in the order of NAMES."""
        return self.position, self.velocity, self.target_position, self.target_velocity

    @property
    def own(self) -> dict[str, Sensor]:
        """The sensors that are not plain, by what they measure."""
        found = {name: getattr(self, name) for name in QUANTITIES}
        return {name: sensor for name, sensor in found.items() if not isinstance(sensor, Plain | None)}


def sensors(sensing: Sensing, timestep: float, seed: int, count: int, axes: int) -> Sensors:
    """What sensors do, in the controller's numbers.

    Args:
        sensing: The table.
        timestep: Physics step [s].
        seed: Draws the biases.
        count: Number of robots.
        axes: Dimension of the space.
    """
    position, velocity, target_position, target_velocity = (
        Channel(
            sensor.noise,
            _biases(sensor, seed, number, bodies, axes),
            round(sensor.delay / timestep),
            sensor.dropout,
            sensor.resolution or 0.0,
        )
        if isinstance(sensor, Plain)
        else Channel(own=sensor)
        for number, (sensor, bodies) in enumerate(zip(sensing.channels, (count, count, 1, 1), strict=True))
    )
    sight, lidar = sensing.radius, sensing.lidar
    return Sensors(
        position,
        velocity,
        target_position,
        target_velocity,
        np.inf if sight.robots is None else sight.robots,
        np.inf if sight.obstacles is None else sight.obstacles,
        None if lidar is None else _lidar(lidar, timestep, axes),
        sensing.heading,
    )


def _lidar(lidar: Lidar, timestep: float, axes: int) -> LidarRays:
    """What a lidar does, in the controller's numbers."""
    rays, every = even_rays(ray_count(lidar, axes), axes), steps_of(lidar.rate, timestep)
    return LidarRays(rays, lidar.range, every, lidar.noise, lidar.record)


def ray_count(lidar: Lidar, axes: int) -> int:
    """Return the number of rays of a lidar."""
    return lidar.rays or RAYS[2 if axes == 2 else 3]


def _biases(sensor: Plain, seed: int, number: int, bodies: int, axes: int) -> Array | None:
    """Constant errors of a channel, shape (bodies, axes); None where there are none.

    Drawn in the cube around the ball and kept if inside: plain arithmetic, equal bits everywhere.
    """
    if not isinstance(sensor.bias, float):
        return np.tile(sensor.bias, (bodies, 1))
    if sensor.bias == 0.0:
        return None
    drawn = np.zeros((bodies, axes))
    for body in range(bodies):  # each from a stream of its own: more robots change no other robot's
        random = np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, number, body])))
        offset = np.ones(axes)
        while offset @ offset > 1.0:
            offset = 2.0 * random.random(axes) - 1.0
        drawn[body] = sensor.bias * offset
    return drawn
