"""What the robots' sensors make of the truth, in the numbers that the controller is given."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

import numpy as np

from escort_mj.components.component import block_at, number_of, reader
from escort_mj.components.mission import axis_names
from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Recorded, Value
from escort_mj.native.kernels import inlined
from escort_mj.plan import Plan
from escort_mj.sensors import EQUATED, QUANTITIES, Lidar, Plain, Sensor

CHANNELS = 4
NO_BIAS = -1.0
HEADING = "heading"


class SensorParameters(Fields):
    """The sensors as kernels read them: of robots' positions and velocities, then of the target's."""

    sensor_place: Annotated[
        Array, CHANNELS, Value("1", "where the block of each plain sensor in `parameters` begins")
    ]
    sensor_delay: Annotated[Array, CHANNELS, Value("1", "age of what is measured, in physics steps")]
    sensor_bias: Annotated[Array, CHANNELS, Value("1", "first row of the channel in `bias`; -1 for none")]
    sensor_past: Annotated[Array, CHANNELS, Value("1", "first row of the channel in `past`")]
    bias: Annotated[Array, "biased", "p", Value("m or m/s", "constant errors")]
    perfect: Annotated[bool, Value("1", "whether what is measured is the truth")]
    own_sensor: Annotated[Array, "own_sensors", Value("1", "place in EQUATED; their number for a plugin's")]
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
        delays = [steps_late(sensor, setup.timestep) for sensor in sensors.channels]
        for number, bodies in enumerate((setup.count, setup.count, 1, 1)):
            bias = bias_of(sensors.channels[number], setup.seed, number, bodies, setup.axes)
            starts.append(NO_BIAS if bias is None else sum(map(len, biases)))
            pasts.append(past)
            if bias is not None:
                biases.append(bias)
            past += _rows_of_past(delays[number], bodies)
        own, first, firsts = sensors.own, 0, []
        for quantity, each in own.items():
            firsts.append(first)
            width = 1 if quantity == HEADING else setup.axes
            first += (quantity == HEADING) + width * len(each.memories())
        return {
            "sensor_place": sensors.plain,
            "own_sensor": [number_of(each, EQUATED) for each in own.values()],
            "own_sensor_place": [*own.values()],
            "own_quantity": [list(QUANTITIES).index(quantity) for quantity in own],
            "own_memories": [len(each.memories()) for each in own.values()],
            "own_first": firsts,
            "sensor_delay": delays,
            "sensor_bias": starts,
            "sensor_past": pasts,
            "bias": np.concatenate(biases),
            "perfect": all(sensor.is_perfect for sensor in sensors.channels),
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


read_plain = reader(Plain)


@inlined
def plain_at(channel: int, plan: Plan) -> Any:
    """Return the parameters of the plain sensor of a channel; those of none, which is perfect, for others."""
    return read_plain(block_at(int(plan.sensor_place[channel]), plan), 0)


class Sensors(NamedTuple):
    """The sensors of each robot, and how far robots see.

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

    position: Sensor = Plain.model_construct()
    velocity: Sensor = Plain.model_construct()
    target_position: Sensor = Plain.model_construct()
    target_velocity: Sensor = Plain.model_construct()
    robots: float = math.inf
    obstacles: float = math.inf
    lidar: Lidar | None = None
    heading: Sensor | None = None

    @property
    def own(self) -> dict[str, Sensor]:
        """Sensors of other kinds than the plain one, by what they measure."""
        return own_of(self)

    @property
    def plain(self) -> list[Plain]:
        """The plain sensors of the channels; perfect ones where there are others."""
        return [sensor if isinstance(sensor, Plain) else Plain() for sensor in self.channels]

    @property
    def channels(self) -> tuple[Sensor, Sensor, Sensor, Sensor]:
        """Robots' positions and velocities, then the target's."""
        return self.position, self.velocity, self.target_position, self.target_velocity


def own_of(measured: Any) -> dict[str, Sensor]:
    """Return the sensors that are not plain, by what they measure: one attribute for each of QUANTITIES."""
    found = {name: getattr(measured, name) for name in QUANTITIES}
    return {name: sensor for name, sensor in found.items() if not isinstance(sensor, Plain | None)}


def steps_late(sensor: Sensor, timestep: float) -> int:
    """Return how old what a sensor measures is, in physics steps."""
    return round(sensor.delay / timestep) if isinstance(sensor, Plain) else 0


def bias_of(sensor: Sensor, seed: int, number: int, bodies: int, axes: int) -> Array | None:
    """Return constant errors of a channel, shape (bodies, axes); None where there are none.

    Drawn in the cube around the ball and kept if inside: plain arithmetic, equal bits everywhere.
    """
    if not isinstance(sensor, Plain) or sensor.bias == 0.0:
        return None
    if not isinstance(sensor.bias, float):
        return np.tile(sensor.bias, (bodies, 1))
    drawn = np.zeros((bodies, axes))
    for body in range(bodies):  # each from a stream of its own: more robots change no other robot's
        random = np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, number, body])))
        offset = np.ones(axes)
        while offset @ offset > 1.0:
            offset = 2.0 * random.random(axes) - 1.0
        drawn[body] = sensor.bias * offset
    return drawn


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


def rows_of_past(sensors: Sensors, count: int, timestep: float) -> int:
    """Return how many rows `past` has for a number of robots."""
    delays = [steps_late(sensor, timestep) for sensor in sensors.channels]
    return sum(map(_rows_of_past, delays, (count, count, 1, 1)))


def _rows_of_past(delay: int, bodies: int) -> int:
    """Return how many rows of `past` a channel has, by its delay in steps."""
    return (delay + 1) * bodies if delay else 0
