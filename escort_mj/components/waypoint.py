"""A point of a way, with its time."""

from pydantic import NonNegativeFloat

from escort_mj.components.parameters import Parameters, Vector


class Waypoint(Parameters):
    """Position of a body at a given time."""

    time: NonNegativeFloat
    """Time [s]."""
    position: Vector
    """Position, one number per axis [m]."""
