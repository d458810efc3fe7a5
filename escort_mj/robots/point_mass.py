"""A mass that slides along each axis."""

from typing import ClassVar, Literal

from escort_mj.robots.kind import RobotKind


class PointMass(RobotKind):
    """A point mass that slides freely along each axis."""

    part: ClassVar[str] = "point_mass"
    most_axes: ClassVar[int] = 9
    passes_floor: ClassVar[bool] = True

    kind: Literal["point_mass"] = "point_mass"
