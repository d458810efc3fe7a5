"""Tables of what stands in the way: obstacles, walls with doors, corridors, clutter, and how bodies move."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, NonNegativeFloat, PlainValidator, PositiveFloat, WithJsonSchema
from pydantic_core import PydanticCustomError

from escort_mj.components.parameters import Force, Mass, Parameters, Radius
from escort_mj.scenario.schema.fields import BODY_NAME, Component, Vector

SPHERE_RADIUS = 0.5
MOST_VERTICES = 500
MOST_CLUTTER = 500
Shape = Literal["sphere", "box", "cylinder", "capsule", "ellipsoid", "mesh"]
Primitive = Literal["sphere", "box", "cylinder", "capsule", "ellipsoid"]
Color = Literal["gray", "red", "orange", "yellow", "green", "blue", "purple", "brown", "white"]
Name = Annotated[str, Field(pattern=BODY_NAME)]


def _orientation(value: Any) -> float | tuple[float, ...]:
    """One angle, three angles or a quaternion."""
    numbers = value if isinstance(value, tuple | list) else (value,)
    right = all(isinstance(x, int | float) and not isinstance(x, bool) and abs(x) <= 1e6 for x in numbers)
    if not right or (isinstance(value, tuple | list) and len(value) not in (3, 4)):
        raise PydanticCustomError(
            "orientation", "a yaw angle, three angles (roll, pitch, yaw) or a quaternion (w, x, y, z)"
        )
    if len(numbers) == 4 and not any(numbers):
        raise PydanticCustomError("orientation", "a quaternion (w, x, y, z) that is not zero")
    return tuple(map(float, numbers)) if isinstance(value, tuple | list) else float(value)


_NUMBER = {"type": "number"}
Orientation = Annotated[
    float | tuple[float, ...],
    PlainValidator(_orientation),
    WithJsonSchema({"anyOf": [_NUMBER, {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 4}]}),
]
"""A yaw angle, or (roll, pitch, yaw) about the world's x, y, z in turn [rad], or a quaternion w, x, y, z."""


class Waypoint(Parameters):
    """Where a body is at one moment."""

    time: NonNegativeFloat
    """Time [s]."""
    position: Vector
    """Position, one number per axis [m]."""


class Motion(Parameters):
    """Where a body is to be as time goes by. Give `position` or `waypoints`."""

    position: tuple[Component, ...] | None = None
    """Position per axis [m]: numbers, or expressions in t."""
    waypoints: Annotated[tuple[Waypoint, ...], Field(min_length=1)] | None = None
    """Timed waypoints; before the first and after the last the body rests."""
    interpolation: Literal["linear", "smooth"] = "linear"
    """Between waypoints: straight at constant speed, or a cubic spline that starts and ends at rest."""


class Drive(Parameters):
    """A body with mass that a force drives along its motion: it pushes, and can be pushed."""

    mass: Mass = 1000.0
    """Mass [kg]; the default hardly feels a robot."""
    force_limit: Force | None = None
    """Largest driving force [N]; null: no limit."""
    gain: Annotated[float, Field(gt=0.0, le=1e3)] = 10.0
    """How fast it comes back to where it should be [1/s]."""


class Obstacle(Parameters):
    """One obstacle that robots can collide with, fixed or moving."""

    shape: Shape = "sphere"
    """Shape of its body."""
    position: Vector | None = None
    """Center, one number per axis [m]; left out where `motion` says where it is."""
    radius: Radius | None = None
    """Radius of a sphere [m]; null: 0.5."""
    size: Annotated[tuple[Radius, ...], Field(min_length=1, max_length=3)] | None = None
    """Half-sizes as MuJoCo has them [m]. box, ellipsoid: along its own x, y, z; cylinder, capsule: radius,
    and half the length along its own z, without a capsule's caps. Where axes is 2 the last one may be left
    out (but a capsule's not): half of its height is then the robots' radius."""
    vertices: Annotated[tuple[Vector, ...], Field(min_length=3, max_length=MOST_VERTICES)] | None = None
    """Corners of a mesh, whose body is their convex hull, relative to its center [m]; where axes is 2 those
    of its outline."""
    orientation: Orientation = 0.0
    """How it is turned [rad]: a yaw angle, or roll, pitch, yaw, or a quaternion w, x, y, z."""
    motion: Motion | None = None
    """How its center moves; null: it stands still. A body that moves does not turn."""
    body: Drive | None = None
    """Mass and drive of one that moves; null: the defaults."""
    color: Color | None = None
    """Color in pictures; null: gray."""
    name: Name | None = None
    """Name in pictures and verdicts; null: obstacle_1, obstacle_2 ..."""


class Door(Parameters):
    """An opening in a wall."""

    at: NonNegativeFloat
    """Where its middle is, along the wall's points from the first [m]."""
    width: Radius
    """Clear width [m]."""
    sill: NonNegativeFloat = 0.0
    """Height of its lower edge above the wall's foot [m]; axes 3 only."""
    height: Radius | None = None
    """Clear height [m], axes 3 only; null: up to the wall's top."""


class Wall(Parameters):
    """A wall along straight stretches, or with `corridor` two parallel ones."""

    points: Annotated[tuple[Vector, ...], Field(min_length=2, max_length=100)]
    """Where it goes: two or more points; where axes is 3 of its foot, all at one height [m]."""
    corridor: Radius | None = None
    """Clear width between two walls, one on each side of the points [m]; null: one wall."""
    height: Radius = 1.0
    """Height above its foot, which is the floor where axes is 2 [m]."""
    thickness: Radius = 0.2
    """Thickness [m]."""
    doors: tuple[Door, ...] = ()
    """Openings, each within one straight stretch; a corridor has them on both sides."""
    color: Color | None = None
    """Color in pictures; null: gray."""
    name: Name | None = None
    """Name; its parts are called name_1, name_2 ...; null: wall_1, wall_2 ..."""


class Clutter(Parameters):
    """Obstacles drawn at random that leave a passage between any two of them, and along the target's path."""

    count: Annotated[int, Field(ge=1, le=MOST_CLUTTER)]
    """How many."""
    low: Vector
    """Lower corner of the box in which they lie [m]."""
    high: Vector
    """Upper corner [m]."""
    least_radius: Radius = 0.3
    """Least radius of the sphere around one [m]."""
    largest_radius: Radius = 0.8
    """Largest radius of the sphere around one [m]."""
    shapes: Annotated[tuple[Primitive, ...], Field(min_length=1)] = ("sphere",)
    """Shapes to draw from."""
    passage: PositiveFloat = 1.0
    """Least gap between any two of them, to other obstacles and walls, to where the target ever is and to
    robots whose start is given [m]."""
    seed: Annotated[int, Field(ge=0, lt=2**53)] | None = None
    """Seed of the draw; null: the scenario's."""
