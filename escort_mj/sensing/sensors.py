"""What the robots' sensors make of the truth, in the numbers that the controller is told."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.plan import SENSOR_SIZE

Array = NDArray[np.float64]


class Channel(NamedTuple):
    """One kind of measurement: the truth, `delay` steps old, plus bias and noise, rounded; or nothing new.

    Attributes:
        noise: Radius of the ball from which an error is drawn at every step [m or m/s].
        bias: Constant error of each robot, shape (n, p), or of the target, shape (1, p) [m or m/s];
            None: none.
        delay: Age of what is measured, in physics steps.
        dropout: Probability per step that nothing arrives and the last value stays.
        resolution: Step to whose multiples values are rounded [m or m/s]; 0: none.
    """

    noise: float = 0.0
    bias: Array | None = None
    delay: int = 0
    dropout: float = 0.0
    resolution: float = 0.0

    @property
    def is_perfect(self) -> bool:
        """Whether it shows the truth."""
        return self.bias is None and not any((self.noise, self.delay, self.dropout, self.resolution))


class Sensors(NamedTuple):
    """Every channel; plain ones show the truth.

    Attributes:
        position: Robots' own positions.
        velocity: Robots' own velocities.
        target_position: The target's position, measured once for the team.
        target_velocity: The target's velocity, likewise.
        robots: How far robots see each other, surface to surface [m].
        obstacles: How far robots see obstacles, likewise [m].
    """

    position: Channel = Channel()
    velocity: Channel = Channel()
    target_position: Channel = Channel()
    target_velocity: Channel = Channel()
    robots: float = math.inf
    obstacles: float = math.inf

    @property
    def channels(self) -> tuple[Channel, Channel, Channel, Channel]:
        """Robots' positions and velocities, then the target's."""
        return self.position, self.velocity, self.target_position, self.target_velocity


# Columns of a channel in the plan
NOISE, DELAY, DROPOUT, RESOLUTION, BIAS, PAST = range(SENSOR_SIZE)
NO_BIAS = -1.0


def sensor_table(sensors: Sensors, count: int, axes: int) -> tuple[Array, Array, int]:
    """The channels as the kernels read them.

    Args:
        sensors: Every channel.
        count: Number of robots, n.
        axes: p.

    Returns:
        A row per channel, shape (4, SENSOR_SIZE): its numbers, its first row in the biases (NO_BIAS for none)
        and its first row in the memory of the past; the biases, shape (rows, p); and the rows of that memory.
    """
    table, biases, past = np.zeros((4, SENSOR_SIZE)), [np.zeros((0, axes))], 0
    for row, channel, bodies in zip(table, sensors.channels, (count, count, 1, 1), strict=True):
        row[:BIAS] = channel.noise, channel.delay, channel.dropout, channel.resolution
        row[BIAS], row[PAST] = NO_BIAS, past
        if channel.bias is not None:
            row[BIAS] = sum(map(len, biases))
            biases.append(np.asarray(channel.bias))
        if channel.delay:
            past += (channel.delay + 1) * bodies
    return table, np.concatenate(biases), past
