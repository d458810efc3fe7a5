"""Random places in a ball, of robots at their start or of their goals."""

from pydantic import NonNegativeFloat

from escort_mj.components.parameters import Parameters, Radius, Vector


class RandomPlacement(Parameters):
    """Random positions, drawn with the scenario's seed and uniform in a ball (in the plane, a disc)."""

    within: Radius
    """Radius of the ball [m]."""
    center: Vector | None = None
    """Center of the ball [m]; null: the initial position of the target, or the origin without one."""
    least_gap: NonNegativeFloat = 1.0
    """Minimum surface-to-surface distance between robots, and from robots to obstacles and the target [m]."""
