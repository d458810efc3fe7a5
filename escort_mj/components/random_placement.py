"""Random places in a ball, of robots at their start or of their goals."""

from pydantic import NonNegativeFloat

from escort_mj.components.parameters import Parameters, Radius, Vector


class RandomPlacement(Parameters):
    """Uniformly distributed positions in a ball (in the plane, a disc), drawn with the scenario's seed."""

    within: Radius
    """Radius of the ball [m]."""
    center: Vector | None = None
    """Center of the ball [m]; null: the initial position of the target or, without a target, the origin."""
    least_gap: NonNegativeFloat = 1.0
    """Minimum surface-to-surface distance between robots, and from robots to obstacles and the target [m]."""
