"""What the robots' sensors make of the truth, in the numbers that the controller is given."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

import numpy as np

from escort_mj.components.component import number_of
from escort_mj.components.mission import axis_names
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Recorded, Value
from escort_mj.sensing.lidar import LidarSensor
from escort_mj.sensors import QUANTITIES, SENSORS, Sensor

CHANNELS = 4
NO_BIAS = -1.0
HEADING = "heading"


class SensorParameters(Fields):
    """The sensors as kernels read them: of robots' positions and velocities, then of the target's."""

    sensor_noise: Annotated[Array, CHANNELS, Value("m or m/s", "radius of the ball of errors")]
    sensor_delay: Annotated[Array, CHANNELS, Value("1", "age of what is measured, in physics steps")]
    sensor_dropout: Annotated[Array, CHANNELS, Value("1", "probability that nothing arrives in a step")]
    sensor_resolution: Annotated[Array, CHANNELS, Value("m or m/s", "step of the values; 0 for none")]
    sensor_bias: Annotated[Array, CHANNELS, Value("1", "first row of the channel in `bias`; -1 for none")]
    sensor_past: Annotated[Array, CHANNELS, Value("1", "first row of the channel in `past`")]
    bias: Annotated[Array, "biased", "p", Value("m or m/s", "constant errors")]
    perfect: Annotated[bool, Value("1", "whether what is measured is the truth")]
    own_sensor: Annotated[Array, "own_sensors", Value("1", "place in SENSORS of those not plain")]
    own_sensor_place: Annotated[Array, "own_sensors", Value("1", "where its block in `parameters` begins")]
    own_quantity: Annotated[Array, "own_sensors", Value("1", "place in QUANTITIES of what it measures")]
    own_memories: Annotated[Array, "own_sensors", Value("1", "how many numbers of its own it keeps")]
    own_first: Annotated[Array, "own_sensors", Value("1", "its first row of `readings`")]
    sensing_robots: Annotated[float, Value("m", "how far robots see each other, surface to surface")]
    sensing_obstacles: Annotated[float, Value("m", "how far robots see obstacles, likewise")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        sensors, biases, past = setup.sensing, [np.zeros((0, setup.axes))], 0
        starts, pasts = [], []
        for channel, bodies in zip(sensors.channels, (setup.count, setup.count, 1, 1), strict=True):
            starts.append(NO_BIAS if channel.bias is None else sum(map(len, biases)))
            pasts.append(past)
            if channel.bias is not None:
                biases.append(np.asarray(channel.bias))
            past += _rows_of_past(channel, bodies)
        own, first, firsts = sensors.own, 0, []
        for quantity, each in own.items():
            firsts.append(first)
            width = 1 if quantity == HEADING else setup.axes
            first += (quantity == HEADING) + width * len(each.memories())
        return {
            "own_sensor": [number_of(each, SENSORS) for each in own.values()],
            "own_quantity": [list(QUANTITIES).index(quantity) for quantity in own],
            "own_memories": [len(each.memories()) for each in own.values()],
            "own_first": firsts,
            "sensor_noise": [channel.noise for channel in sensors.channels],
            "sensor_delay": [channel.delay for channel in sensors.channels],
            "sensor_dropout": [channel.dropout for channel in sensors.channels],
            "sensor_resolution": [channel.resolution for channel in sensors.channels],
            "sensor_bias": starts,
            "sensor_past": pasts,
            "bias": np.concatenate(biases),
            "perfect": all(channel.is_perfect for channel in sensors.channels),
            "sensing_robots": sensors.robots,
            "sensing_obstacles": sensors.obstacles,
        }


class SensorSignals(Fields):
    """What the sensors show."""

    q_measured: Annotated[Array, "n", "p", Recorded("m", "measured position, used by the law")]
    v_measured: Annotated[Array, "n", "p", Recorded("m/s", "measured velocity, used by the law")]
    target_position_measured: Annotated[
        Array, "p", Recorded("m", "measured position of the target, used by the law")
    ]
    target_velocity_measured: Annotated[
        Array, "p", Recorded("m/s", "measured velocity of the target, used by the law")
    ]


class ReadingSignals(Fields):
    """What sensors of other kinds than the plain one show beside the above, and keep of their own."""

    readings: Annotated[
        Array, "readings", "n", Recorded("1", "what sensors show and keep; units in `reading_unit`")
    ]


class SensorState(Fields):
    """What sensors remember, and what is asked of one along one axis."""

    sensor_truth: Annotated[Array, "measuring", Value("1", "true values of all robots")]
    sensor_normals: Annotated[Array, 2, "measuring", Value("1", "random numbers, mean 0, variance 1")]
    sensor_drawn: Annotated[Array, 2, Value("1", "those of one robot")]
    sensor_draw: Annotated[Array, "measuring", Value("1", "random numbers, uniform in [0, 1)")]
    sensor_memory: Annotated[Array, "sensor_memories", "measuring", Value("1", "the sensor's own numbers")]
    sensor_memory_next: Annotated[Array, "sensor_memories", "measuring", Value("1", "what becomes of these")]
    sensor_shown: Annotated[Array, "measuring", Value("1", "what the sensor says: measured values")]

    past: Annotated[
        Array,
        "past",
        "p",
        Value("m or m/s", "the truth of late: delay + 1 rows per body and channel"),
    ]


class Channel(NamedTuple):
    """One kind of measurement: the truth, `delay` steps old, plus bias and noise, rounded; or nothing new.

    Attributes:
        noise: Radius of the ball from which an error is drawn at every step [m or m/s].
        bias: Constant error of each robot, shape (n, p), or of the target, shape (1, p) [m or m/s];
            None: none.
        delay: Age of what is measured, in physics steps.
        dropout: Probability per step that nothing arrives and the last value stays.
        resolution: Step to whose multiples values are rounded [m or m/s]; 0: none.
        own: A sensor of another kind, which measures in place of all that.
    """

    noise: float = 0.0
    bias: Array | None = None
    delay: int = 0
    dropout: float = 0.0
    resolution: float = 0.0
    own: Sensor | None = None

    @property
    def is_perfect(self) -> bool:
        """Whether it shows the truth."""
        plain = self.bias is None and self.own is None
        return plain and not any((self.noise, self.delay, self.dropout, self.resolution))

    def variance(self, axes: int) -> float:
        """Return the variance of noise and rounding, per axis [m^2 or m^2/s^2]."""
        if self.own is not None:
            return self.own.deviation(axes) ** 2
        return self.noise * self.noise / (axes + 2.0) + self.resolution * self.resolution / 12.0


class Sensors(NamedTuple):
    """Every channel; plain ones show the truth.

    Attributes:
        position: Robots' own positions.
        velocity: Robots' own velocities.
        target_position: The target's position, measured once for the team.
        target_velocity: The target's velocity, likewise.
        robots: How far robots see each other, surface to surface [m].
        obstacles: How far robots see obstacles, likewise [m].
        lidar: By which robots know obstacles; None where they know their shapes.
        heading: Robots' own headings; None where they are not measured.
    """

    position: Channel = Channel()
    velocity: Channel = Channel()
    target_position: Channel = Channel()
    target_velocity: Channel = Channel()
    robots: float = math.inf
    obstacles: float = math.inf
    lidar: LidarSensor | None = None
    heading: Sensor | None = None

    @property
    def own(self) -> dict[str, Sensor]:
        """Sensors of other kinds than the plain one, by what they measure."""
        measured = (*(channel.own for channel in self.channels), self.heading)
        return {name: own for name, own in zip(QUANTITIES, measured, strict=True) if own is not None}

    @property
    def channels(self) -> tuple[Channel, Channel, Channel, Channel]:
        """Robots' positions and velocities, then the target's."""
        return self.position, self.velocity, self.target_position, self.target_velocity


def readings_of(own: Mapping[str, Sensor], axes: int) -> dict[str, str]:
    """Return what is recorded of sensors that are not plain: names, and units.

    Args:
        own: By what they measure.
        axes: Dimension of the space.
    """
    found: dict[str, str] = {}
    for quantity, sensor in own.items():
        along = [f".{axis}" for axis in axis_names(axes)]
        if quantity == HEADING:
            along, found[HEADING] = [""], QUANTITIES[HEADING]
        for name, memory in sensor.memories().items():
            found |= dict.fromkeys((f"{quantity}.{name}{axis}" for axis in along), memory.unit)
    return found


def rows_of_past(sensors: Sensors, count: int) -> int:
    """Return how many rows `past` has for a number of robots."""
    return sum(map(_rows_of_past, sensors.channels, (count, count, 1, 1)))


def _rows_of_past(channel: Channel, bodies: int) -> int:
    """Return how many rows of `past` a channel has."""
    return (channel.delay + 1) * bodies if channel.delay else 0
