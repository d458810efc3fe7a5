"""The table `sensing`: what robots measure, how well, and how far they see (docs/sensing.md)."""

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PlainValidator, PositiveFloat, TypeAdapter, WithJsonSchema
from pydantic_core import PydanticCustomError

from escort_mj.components.parameters import Parameters, Radius, Vector
from escort_mj.scenario.schema.knowledge import steps_of
from escort_mj.sensing.lidar import LidarSensor as LidarRays
from escort_mj.sensing.lidar import even_rays
from escort_mj.sensing.sensors import Channel, Sensors

Array = NDArray[np.float64]

NAMES = ("position", "velocity", "target_position", "target_velocity")
RAYS = {2: 72, 3: 500}
"""Rays of a lidar by the number of axes, if nothing else is said."""
LARGEST = 1e6  # bias [m or m/s]
_vector = TypeAdapter(Vector)


def _bias(value: Any) -> float | tuple[float, ...]:
    """A radius, or one number per axis."""
    items = value if isinstance(value, list | tuple) else [value]
    least = -LARGEST if items is value else 0.0
    for item in items:
        if isinstance(item, bool) or not isinstance(item, int | float) or not least <= item <= LARGEST:
            raise PydanticCustomError("bias_type", "a radius or a list of numbers")
    numbers = tuple(float(item) for item in items)
    return numbers if items is value else numbers[0]


Bias = Annotated[
    float | Vector,
    PlainValidator(_bias),
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": 0}, _vector.json_schema()]}),
]
"""A constant error: the radius of a ball to draw it from, or the error itself."""


class Sensor(Parameters):
    """Errors in the measurement of one quantity."""

    noise: NonNegativeFloat = 0.0
    """Radius of the ball from which an error is drawn uniformly at every step [m or m/s]."""
    bias: Bias = 0.0
    """Constant error [m or m/s]: one number per axis, the same for all robots, or the radius of the ball from
    which an error is drawn uniformly for each robot."""
    delay: NonNegativeFloat = 0.0
    """Delay of the measurement [s], a whole number of physics steps."""
    dropout: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Probability per step that the measurement is lost and the previous value is kept [1]."""
    resolution: Annotated[float, Field(ge=1e-9, le=1e6)] | None = None
    """Resolution to which values are rounded [m or m/s]; null: no rounding."""


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

    position: Sensor = Sensor()
    """The robots' own positions [m]."""
    velocity: Sensor = Sensor()
    """The robots' own velocities [m/s]."""
    target_position: Sensor = Sensor()
    """The target's position [m], measured once for the whole team."""
    target_velocity: Sensor = Sensor()
    """The target's velocity [m/s], measured once for the whole team."""
    radius: SensingRadius = SensingRadius()
    """Range at which robots detect obstacles and each other."""
    lidar: Lidar | None = None
    """Lidar on each robot, which replaces knowledge of the obstacles' shapes; null: no lidar, and robots know
    the shapes."""

    @property
    def channels(self) -> tuple[Sensor, Sensor, Sensor, Sensor]:
        """The sensors in the order of NAMES."""
        return self.position, self.velocity, self.target_position, self.target_velocity


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
    )


def _lidar(lidar: Lidar, timestep: float, axes: int) -> LidarRays:
    """What a lidar does, in the controller's numbers."""
    rays, every = even_rays(ray_count(lidar, axes), axes), steps_of(lidar.rate, timestep)
    return LidarRays(rays, lidar.range, every, lidar.noise, lidar.record)


def ray_count(lidar: Lidar, axes: int) -> int:
    """Return the number of rays of a lidar."""
    return lidar.rays or RAYS[2 if axes == 2 else 3]


def _biases(sensor: Sensor, seed: int, number: int, bodies: int, axes: int) -> Array | None:
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
