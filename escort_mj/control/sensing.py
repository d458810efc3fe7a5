"""What the robots' sensors make of the truth, in the numbers that the controller is told."""

from __future__ import annotations

from typing import NamedTuple


class Channel(NamedTuple):
    """One kind of measurement.

    Attributes:
        noise: Radius of the ball from which an error is drawn at every step [m or m/s].
    """

    noise: float = 0.0


class Sensors(NamedTuple):
    """Every channel; plain ones show the truth.

    Attributes:
        position: Robots' own positions.
        velocity: Robots' own velocities.
    """

    position: Channel = Channel()
    velocity: Channel = Channel()
