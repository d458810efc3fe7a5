"""A rolling ball with a mass off its center."""

from collections.abc import Iterator, Mapping
from typing import ClassVar, Literal
from xml.etree.ElementTree import Element

from escort_mj.components.parameters import Mass, Radius
from escort_mj.mjcf import set_attributes
from escort_mj.robots.rolling_sphere import RollingSphere

LOAD = 0.3  # radius of the load as it is drawn, of the ball's


class Loaded(RollingSphere):
    """A rolling ball with a hidden off-center mass (`axes: 2`).

    The mass makes the ball wobble and must be lifted in every revolution.
    """

    part: ClassVar[str] = "loaded"
    opacity: ClassVar[float] = 0.3

    kind: Literal["loaded"] = "loaded"  # type: ignore[assignment]
    load: Mass = 0.5
    """Mass of the load, in addition to the ball's mass [kg]."""
    offset: Radius = 0.1
    """Distance of the load from the ball's center [m]; initially, the load is below the center."""

    def misfits(self, radius: float) -> Iterator[str]:
        """Yield that the load is outside the ball."""
        if self.offset >= radius:
            far = f"{self.offset:g} m off the center of a ball of radius {radius:g} m"
            yield f"found a load {far}; it is inside"

    def burden(self) -> float:
        """Return the mass of the load [kg]."""
        return self.load

    def shape(self, parts: Mapping[str, Element], radius: float) -> None:
        """Give the load its place and mass."""
        set_attributes(parts["load"], size=LOAD * radius, pos=[0.0, 0.0, -self.offset], mass=self.load)
