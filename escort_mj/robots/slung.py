"""A sliding mass with a payload that swings below it."""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal
from xml.etree.ElementTree import Element

from pydantic import NonNegativeFloat

from escort_mj.components.parameters import Mass, Radius
from escort_mj.mjcf import set_attributes
from escort_mj.robots.kind import RobotKind

CLEAR_OF_FLOOR = 0.1  # m, that the payload is kept above the floor of planar missions
CABLE = 0.06  # radius of the cable as it is drawn, of the robot's
TOUCHABLE = 1  # contype of what robots, obstacles and target are


class Slung(RobotKind):
    """A sliding mass with a hidden payload that swings below it.

    The mass matrix changes with the swing.
    """

    part: ClassVar[str] = "slung"
    needs_gravity: ClassVar[bool] = True
    passes_floor: ClassVar[bool] = True

    kind: Literal["slung"] = "slung"
    payload: Mass = 0.3
    """Mass of the payload, in addition to the robot's mass [kg]."""
    cable: Radius = 0.8
    """Length of the cable, a massless rod from the robot's center to the payload's center [m]."""
    damping: NonNegativeFloat = 0.02
    """Damping of the swing about each horizontal axis [N m s/rad]."""
    payload_radius: Radius = 0.08
    """Radius of the spherical payload [m]."""
    payload_collides: bool = False
    """Whether the payload can collide; otherwise it passes through other bodies."""

    def coordinates(self, axes: int) -> int:
        """Return one per axis, and two angles of the cable."""
        return axes + 2

    def burden(self) -> float:
        """Return the mass of the payload [kg]."""
        return self.payload

    def height(self, radius: float) -> float:
        """Return a height at which the payload hangs clear of the floor [m]."""
        return max(radius, self.cable + self.payload_radius + CLEAR_OF_FLOOR)

    def swing(self, gravity: Sequence[float]) -> float:
        """Return the frequency of its pendulum where its hull stands still [rad/s]."""
        return math.sqrt(math.hypot(*gravity) / self.cable)

    def shape(self, parts: Mapping[str, Element], radius: float) -> None:
        """Give cable and payload their lengths, mass and damping."""
        for axis in "xy":
            set_attributes(parts[f"payload_swing_{axis}"], damping=self.damping)
        end = [0.0, 0.0, -self.cable]
        set_attributes(parts["payload_ball"], size=self.payload_radius, pos=end, mass=self.payload)
        set_attributes(parts["payload_cable"], size=CABLE * radius, fromto=[0.0, 0.0, 0.0, *end])
        if self.payload_collides:
            set_attributes(parts["payload_ball"], contype=TOUCHABLE, conaffinity=TOUCHABLE)
