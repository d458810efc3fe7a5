"""A ball that rolls on the floor of planar missions."""

from collections.abc import Sequence
from typing import ClassVar, Literal

from escort_mj.robots.kind import FREE_COORDINATES, RobotKind


class RollingSphere(RobotKind):
    """A ball that rolls on the floor, pushed at its center (`axes: 2`)."""

    part: ClassVar[str] = "rolling_sphere"
    most_axes: ClassVar[int] = 2
    rolls: ClassVar[bool] = True
    needs_gravity: ClassVar[bool] = True

    kind: Literal["rolling_sphere"] = "rolling_sphere"

    def coordinates(self, axes: int) -> int:
        """Return those of a free body."""
        return FREE_COORDINATES

    def effective_mass(self, mass: float) -> float:
        """Return 7/5 of it: a solid ball that rolls also turns [kg]."""
        return 1.4 * mass

    def start_rates(self, velocity: Sequence[float], radius: float) -> tuple[float, ...]:
        """Return those with which it rolls."""
        return (0.0, -velocity[1] / radius, velocity[0] / radius)
