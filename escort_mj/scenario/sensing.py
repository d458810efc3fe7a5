"""The table `sensing`: what robots measure, and how well."""

from __future__ import annotations

from pydantic import NonNegativeFloat

from escort_mj.control.parameters import Parameters
from escort_mj.control.sensing import Channel, Sensors


class Sensor(Parameters):
    """What one kind of measurement makes of the truth."""

    noise: NonNegativeFloat = 0.0
    """Radius of the ball from which an error is drawn uniformly, anew at every step [m or m/s]."""


class Sensing(Parameters):
    """What robots measure; without anything said, the truth."""

    position: Sensor = Sensor()
    """Robots' own positions [m]."""
    velocity: Sensor = Sensor()
    """Robots' own velocities [m/s]."""


def sensors(sensing: Sensing) -> Sensors:
    """The channels in the controller's numbers."""
    return Sensors(*(Channel(sensor.noise) for sensor in (sensing.position, sensing.velocity)))
