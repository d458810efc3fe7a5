"""Tables of what stands in the way: obstacles, walls with doors, corridors, clutter, and how bodies move."""

from typing import Annotated, Any, Literal

from pydantic import Field, NonNegativeFloat, PlainValidator, PositiveFloat, WithJsonSchema
from pydantic_core import PydanticCustomError

from escort_mj.components.parameters import Force, Mass, Parameters, Radius, Vector
from escort_mj.components.waypoint import Waypoint
from escort_mj.scenario.schema.fields import BODY_NAME, Component

SPHERE_RADIUS = 0.5
HEAVY, LIGHT = 1000.0, 1.0  # kg, of bodies with a path, and with a policy
MOST_VERTICES = 500
MOST_CLUTTER = 500
MOST_SCENERY = 20
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


def _or_table(schema: dict[str, Any]) -> None:
    """Let editors accept the name of a table, which the reader replaces by its waypoints."""
    table = {"type": "string", "pattern": r"\.csv$"}
    listed = {key: schema.pop(key) for key in ("type", "items", "minItems") if key in schema}
    schema["anyOf"] = [listed, table]


class Motion(Parameters):
    """Path of a body over time. Set `position` or `waypoints`."""

    position: tuple[Component, ...] | None = None
    """Position per axis [m]: numbers, or expressions in t."""
    waypoints: Annotated[tuple[Waypoint, ...], Field(min_length=1, json_schema_extra=_or_table)] | None = None
    """Timed waypoints, or a CSV file with a time and a position per line; the body rests before the first
    waypoint and after the last."""
    interpolation: Literal["linear", "smooth"] = "linear"
    """Motion between waypoints: `linear` at constant speed, or `smooth`, a cubic spline that starts and ends
    at rest."""


class Drive(Parameters):
    """A body that has mass and is driven by a force: it pushes other bodies and can be pushed."""

    mass: Mass | None = None
    """Mass [kg]; null: 1000 kg, which robots can hardly move, or 1 kg for a body with a policy."""
    force_limit: Force | None = None
    """Largest driving force [N]; null: no limit."""
    gain: Annotated[float, Field(gt=0.0, le=1e3)] = 10.0
    """Rate at which the body returns to its path [1/s]."""
    drag: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    """Linear drag [N s/m]; together with `force_limit`, the drag limits the speed."""

    def mass_of(self, policy: object) -> float:
        """Return the mass of a body with a policy, or without one (None) [kg]."""
        return self.mass or (HEAVY if policy is None else LIGHT)


class Obstacle(Parameters):
    """A fixed or moving obstacle."""

    shape: Shape = "sphere"
    """Shape of the body."""
    position: Vector | None = None
    """Center, one number per axis [m]; omit it if `motion` is set."""
    radius: Radius | None = None
    """Radius of a sphere [m]; null: 0.5."""
    size: Annotated[tuple[Radius, ...], Field(min_length=1, max_length=3)] | None = None
    """Half-sizes as in MuJoCo [m]. Box and ellipsoid: along the body's x, y, z; cylinder and capsule: radius
    and half-length along the body's z, without the caps of a capsule. In the plane, except for a capsule, you
    can omit the last value, which is then the height of the robots' centers."""
    vertices: Annotated[tuple[Vector, ...], Field(min_length=3, max_length=MOST_VERTICES)] | None = None
    """Vertices of a mesh, relative to its center [m]; the body is their convex hull. In the plane: vertices
    of the outline."""
    orientation: Orientation = 0.0
    """Orientation: a yaw angle [rad]; roll, pitch and yaw [rad]; or a quaternion w, x, y, z."""
    motion: Motion | None = None
    """Motion of the center; null: fixed. A moving body does not rotate."""
    body: Drive | None = None
    """Mass and drive of a moving obstacle; null: the defaults."""
    color: Color | None = None
    """Color in figures and videos; null: gray."""
    name: Name | None = None
    """Name in figures and verdicts; null: obstacle_1, obstacle_2 and so on."""


class Scenery(Parameters):
    """Surroundings from a file: each of its geoms that can collide becomes a fixed obstacle."""

    file: Annotated[str, Field(min_length=1, max_length=500)]
    """File beside the scenario: MJCF (`.xml`) whose bodies stand, or a mesh (`.obj`, `.stl`)."""
    position: Vector | None = None
    """Place of the file's origin, one number per axis [m]; null: the world's origin."""
    orientation: Orientation = 0.0
    """Orientation of the file's axes; in the plane, a yaw angle [rad]."""
    below: Radius = 1.0
    """Height below which robots of a planar mission meet what stands there [m]; geoms that begin higher are
    left out. In space: no meaning."""
    color: Color | None = None
    """Color in figures and videos; null: gray."""
    name: Name | None = None
    """Name that begins the names of the obstacles; null: the name of the file."""


class Door(Parameters):
    """An opening in a wall."""

    at: NonNegativeFloat
    """Position of the center, measured along the wall from its first point [m]."""
    width: Radius
    """Clear width [m]."""
    sill: NonNegativeFloat = 0.0
    """Height of the lower edge above the foot of the wall [m]; in space only."""
    height: Radius | None = None
    """Clear height [m]; in space only; null: up to the top of the wall."""


class Wall(Parameters):
    """A wall along straight segments or, with `corridor`, two parallel walls."""

    points: Annotated[tuple[Vector, ...], Field(min_length=2, max_length=100)]
    """Two or more points that the wall connects with straight segments [m]; in space, points on its foot, all
    at the same height."""
    corridor: Radius | None = None
    """Clear width between two walls, one on each side of the line through the points [m]; null: a single
    wall."""
    height: Radius = 1.0
    """Height above the foot [m]; in the plane, the foot is on the floor."""
    thickness: Radius = 0.2
    """Thickness [m]."""
    doors: tuple[Door, ...] = ()
    """Openings, each within one straight segment; a corridor has them in both walls."""
    color: Color | None = None
    """Color in figures and videos; null: gray."""
    name: Name | None = None
    """Name, followed by _1, _2 and so on if the wall has several parts; null: wall_1, wall_2 and so on."""


class Clutter(Parameters):
    """Random obstacles that leave a passage between any two of them and along the target's path."""

    count: Annotated[int, Field(ge=1, le=MOST_CLUTTER)]
    """Number of obstacles."""
    low: Vector
    """Lower corner of the box that contains the obstacles [m]."""
    high: Vector
    """Upper corner of the box [m]."""
    least_radius: Radius = 0.3
    """Smallest radius of an obstacle's bounding sphere [m]."""
    largest_radius: Radius = 0.8
    """Largest radius of an obstacle's bounding sphere [m]."""
    shapes: Annotated[tuple[Primitive, ...], Field(min_length=1)] = ("sphere",)
    """Shapes to choose from."""
    passage: PositiveFloat = 1.0
    """Minimum gap between any two of these obstacles, and from them to other obstacles, walls, the target's
    path and robots with given initial positions [m]."""
    seed: Annotated[int, Field(ge=0, lt=2**53)] | None = None
    """Seed; null: the scenario's seed."""
