"""Base of the kinds of robots: what one answers about its body, its motors and what it needs."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import ClassVar, NamedTuple
from xml.etree.ElementTree import Element

from escort_mj.components.parameters import Member
from escort_mj.mjcf import set_attributes
from escort_mj.robots.attitude import Craft
from escort_mj.robots.drive import DriveModel
from escort_mj.robots.hydrodynamics import Vessel

FREE_COORDINATES = 7  # of a free body: a place and a quaternion
MOST_MOTORS = 9  # of any kind


class Motor(NamedTuple):
    """A motor that acts on the joint or site of a robot that its part names, such as the joint `free`.

    Attributes:
        name: In the MJCF part.
        gear: Force and torque there for a control of 1, shape (6,); None: as the part has it.
        limits: Least and largest force [N]; None for a motor without limit, lag and gain error.
        start: Force at the start of the mission, where motors lag [N].
    """

    name: str
    gear: Sequence[float] | None = None
    limits: tuple[float, float] | None = None
    start: float = 0.0


class RobotKind(Member):
    """What a robot is, beside mass, radius and motors, which every kind has.

    A subclass has a key `kind` with its name, parameters, and a body: `part`, the name of a file in
    `models/`, or `mjcf`, its text. What it does not answer otherwise holds for a mass that slides along each
    axis. The first coordinates of every kind are the position of its hull, the geom `body`, a sphere, one per
    axis of the mission.
    """

    plural: ClassVar[str] = "robots"
    named_by: ClassVar[str] = "kind"
    method: ClassVar[str] = "shape"
    part: ClassVar[str] = ""
    """Name of the file in `models/` with its body and motors."""
    mjcf: ClassVar[str] = ""
    """The same as text, in place of a file (docs/plugins.md)."""
    opacity: ClassVar[float] = 1.0
    """Of its hull: less where something inside is to be seen."""
    painted: ClassVar[tuple[str, ...]] = ()
    """Geoms that have the robot's color, beside its hull."""
    most_axes: ClassVar[int] = 3
    rolls: ClassVar[bool] = False
    """Whether it rolls on the floor: planar missions only."""
    stays: ClassVar[bool] = False
    """Whether a planar mission has to happen at the height at which it stands, within its span."""
    needs_gravity: ClassVar[bool] = False
    """Whether a mission with it has gravity unless the scenario says otherwise."""
    flies: ClassVar[bool] = False
    """Whether thrust holds its weight, turned by an attitude loop to where the law wants a force."""

    has_heading: ClassVar[bool] = False
    """Whether the x axis of its body is a heading, around which it has a field of view."""
    driven: ClassVar[bool] = False
    """Whether it has a drive of its own, see `drive_model`."""

    modeled: ClassVar[bool] = False
    """Whether it is a whole MJCF model, with actuators of its own."""

    passes_floor: ClassVar[bool] = False
    """Whether parts of it may pass through the floor, which they never touch."""

    kind: str

    @classmethod
    def misstated(cls) -> Iterator[tuple[str, str]]:
        """Yield its body, if it has none."""
        if not (cls.mjcf or cls.part):
            yield "mjcf", 'its body, as in  mjcf = "<body> ... </body>"'

    def misfits(self, radius: float) -> Iterator[str]:
        """Yield what of its parameters does not fit, in words.

        Args:
            radius: Of its hull [m].
        """
        yield from ()

    def coordinates(self, axes: int) -> int:
        """Return the number of its generalized positions in a mission of so many axes."""
        return axes

    def motors(self, axes: int) -> int:
        """Return the number of its motors, each with a gain."""
        return axes

    def actuators(self, axes: int) -> int:
        """Return the number of MuJoCo's actuators that its motors are made of."""
        return self.motors(axes)

    def burden(self) -> float:
        """Return the mass of what it carries unknown to the controller [kg]."""
        return 0.0

    def effective_mass(self, mass: float) -> float:
        """Return the mass that a force on its center moves [kg].

        Args:
            mass: Of the robot [kg].
        """
        return mass

    def swing(self, gravity: Sequence[float]) -> float:
        """Return the slowest frequency of what hangs on it [rad/s]; infinite for nothing.

        Args:
            gravity: World frame, shape (3,) [m/s^2].
        """
        return math.inf

    def height(self, radius: float) -> float:
        """Return the least height of its hull's center above the floor of a planar mission [m].

        Args:
            radius: Of its hull [m].
        """
        return radius

    def span(self, radius: float, height: float) -> tuple[float, float]:
        """Return the heights between which it can touch something in a planar mission [m].

        Args:
            radius: Of its hull [m].
            height: At which the mission happens [m].
        """
        middle = radius if self.rolls else height
        return middle - radius, middle + radius

    def shape(self, parts: Mapping[str, Element], radius: float) -> None:
        """Give the parts of one robot's body the sizes and masses that the parameters say.

        Args:
            parts: Elements of the body by their names, joined from the body down; without one, by tags.
            radius: Of its hull [m].
        """

    def weigh(self, parts: Mapping[str, Element], mass: float, radius: float) -> None:
        """Give the parts of one robot's body the robot's mass: by default all of it to the hull.

        Args:
            parts: As in `shape`.
            mass: Of the robot [kg].
            radius: Of its hull [m].
        """
        set_attributes(parts["body"], mass=mass)

    def free_motors(self, mass: float, radius: float, gravity: Sequence[float]) -> tuple[Motor, ...]:
        """Return its motors in their order, if they are not one for each axis of the mission.

        Args:
            mass: Of the robot [kg].
            radius: Of its hull [m].
            gravity: World frame, shape (3,) [m/s^2].
        """
        return ()

    def start_rates(self, velocity: Sequence[float], radius: float) -> tuple[float, ...]:
        """Return the first rates of its coordinates behind those of the hull's place; the rest are zero.

        Args:
            velocity: Of its hull at the start, along the axes of the mission [m/s].
            radius: Of its hull [m].
        """
        return ()

    def lift(self, mass: float, gravity: Sequence[float]) -> tuple[float, ...]:
        """Return the force that is fed forward against its weight, world frame, shape (3,) [N].

        Args:
            mass: Of the robot [kg].
            gravity: World frame, shape (3,) [m/s^2].
        """
        return (0.0, 0.0, 0.0)

    def craft(self, mass: float, radius: float, gravity: Sequence[float], height: float) -> Craft | None:
        """Return what the attitude loop knows of it; None where motors push along the axes.

        Args:
            mass: Of the robot [kg].
            radius: Of its hull [m].
            gravity: World frame, shape (3,) [m/s^2].
            height: That planar missions hold [m].
        """
        return None

    def vessel(self, mass: float, radius: float) -> Vessel | None:
        """Return what the water does to it; None for what does not float.

        Its first coordinates are then x, y and heading, of a tree of its own.

        Args:
            mass: Of the robot [kg].
            radius: Of its hull [m].
        """
        return None

    def drive_model(self, mass: float, radius: float) -> DriveModel | None:
        """Return the drive of a robot with actuators of its own; None where motors push along the axes.

        Args:
            mass: Of the robot [kg].
            radius: Of its hull [m].
        """
        return None


def plane_height(kinds: Iterable[tuple[RobotKind, float]]) -> float:
    """Return the height at which a planar mission happens: the greatest that a robot asks for [m].

    Balls cannot be raised: where some roll, robots that stay where they stand have no say.

    Args:
        kinds: Kind and radius of each robot [m].
    """
    pairs = list(dict.fromkeys(kinds))
    if any(kind.rolls for kind, _ in pairs):
        pairs = [(kind, radius) for kind, radius in pairs if not kind.stays]
    return max(kind.height(radius) for kind, radius in pairs)
