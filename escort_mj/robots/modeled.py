"""Robots whose body and actuators are a whole MJCF model: what is read of one, and the base of such kinds."""

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, ClassVar, Literal, NamedTuple, cast
from xml.etree.ElementTree import Element

from pydantic import Field, PositiveFloat

from escort_mj.components.parameters import Parameters
from escort_mj.robots.attitude import Craft
from escort_mj.robots.drive import THRUST, DriveModel
from escort_mj.robots.kind import RobotKind

READER = "escort_mj.world.model.robot.reading"
"""Module that reads models. Kinds know no simulator: it is found when a model is first asked for."""
HOVER = 0.5  # m, height above the floor of planar missions, below its hull


class DriveKeys(Parameters):
    """Properties of a robot's drive that override those found in the model."""

    kind: Literal["force", "thrust", "steer", "wheels", "omni", "velocity"] | None = None
    """Kind of drive; null: found from the effect of each actuator."""
    point: PositiveFloat | None = None
    """Distance forward to the point that the law controls [m]: for `wheels`, from the axle (null: half the
    track); for `steer`, from the center of mass (null: the radius of gyration)."""
    tilt_limit: float | None = Field(default=None, gt=0, le=1.4)
    """`thrust`: largest commanded tilt [rad]; null: the tilt that can be reached in half a second, at most
    0.7."""
    attitude_frequency: float | None = Field(default=None, gt=0, le=1e3)
    """`thrust`: natural frequency of the attitude loop [rad/s]; null: computed from the available torques and
    the moments of inertia."""


class Source(NamedTuple):
    """An MJCF model before it is read.

    Attributes:
        text: The MJCF, if it is not in a file.
        file: Where it is, else empty.
        folder: What it and all that it names is inside of; empty where `sha256` vouches for them.
        sha256: Digest that the content must have; empty for any.
        body: Name of the base; empty to find it.
        drive: As JSON, see `DriveKeys`.
        name: What messages call it.
    """

    text: str = ""
    file: str = ""
    folder: str = ""
    sha256: str = ""
    body: str = ""
    drive: str = "{}"
    name: str = ""


@dataclass(frozen=True)
class RobotModel:
    """A robot read from MJCF, as one copy of it stands in its file.

    Attributes:
        root: The body that everything of the robot hangs on, names as in the file, defaults written out.
        sections: Its assets, actuators, sensors, tendons, equalities and contacts, likewise, by section.
        assets: Content of the files that assets name.
        text: MJCF that can be read again, with the assets beside it.
        digest: SHA-256 of all of it.
        coordinates: Number of generalized positions.
        freedoms: Number of generalized velocities.
        actuators: Number of actuators.
        mass: Of all of it [kg].
        inertia: About the center of mass, along the base's axes, shape (3,) [kg m^2].
        radius: Of the least sphere about the controlled point that contains what can touch; of robots that
            stay on the ground, of the least upright cylinder [m].
        reach: Of the sphere about that point which nothing that can touch ever leaves; inf where joints can
            move a part of it [m].
        span: Height of the lowest and of the highest point that can touch something, once it is put up [m].
        start: Controlled point in the file's start pose, shape (3,) [m].
        stands: Whether it rests on the floor.
        lifted: How far it is put up so that none of it is below the floor [m].
        place: Of the outermost body there: position and orientation, shape (7,).
        qpos: The start pose of its joints.
        way: Generalized velocities for a velocity of 1 of the controlled point, shape (freedoms, 3).
        ctrl: Controls there.
        drive: What drives it.
        damped: Whether some actuator damps what it moves, as servos do: explicit integrators are then stable
            for short timesteps only.
        medium: Density and viscosity that the file asks for [kg/m^3, Pa s].
        left: What is not taken from the file, in words.
    """

    root: Element = field(repr=False)
    sections: Mapping[str, Sequence[Element]] = field(repr=False)
    assets: Mapping[str, bytes] = field(repr=False)
    text: str = field(repr=False)
    digest: str
    coordinates: int
    freedoms: int
    actuators: int
    mass: float
    inertia: tuple[float, ...]
    radius: float
    reach: float
    span: tuple[float, float]
    start: tuple[float, ...]
    stands: bool
    lifted: float
    place: tuple[float, ...]
    qpos: tuple[float, ...]
    way: tuple[tuple[float, ...], ...]
    ctrl: tuple[float, ...]
    drive: DriveModel
    damped: bool = False
    medium: tuple[float, float] = (0.0, 0.0)
    left: tuple[str, ...] = ()

    @property
    def force_limit(self) -> float | None:
        """Largest force along any axis that is always to be had [N]; None where servos decide on it."""
        least = min(self.drive.limits)
        return least if self.drive.pushes and math.isfinite(least) else None


class ModeledKind(RobotKind):
    """A robot that is a whole MJCF model with actuators of its own.

    A subclass says where the model is, as a file or as text made of its parameters: one body with all that
    hangs on it, actuators, and a keyframe where it does not start in its default pose.
    """

    needs_gravity: ClassVar[bool] = True
    driven: ClassVar[bool] = True
    modeled: ClassVar[bool] = True
    has_heading: ClassVar[bool] = True

    @abstractmethod
    def source(self, mass: float, radius: float) -> Source:
        """Return the model before it is read.

        Args:
            mass: Of the robot, for kinds that are made to measure [kg].
            radius: Of its hull, likewise [m].

        Raises:
            ScenarioError: If there is none.
        """

    def robot(self, mass: float, radius: float) -> RobotModel:
        """Return the model, read once in a process; arguments as of `source`.

        Raises:
            RobotError: If it cannot be read, or cannot be driven.
        """
        return known(self.source(mass, radius))

    @property
    def flies(self) -> bool:  # type: ignore[override]
        """Whether thrust holds its weight."""
        return self.robot(1.0, 0.2).drive.mode == THRUST

    @property
    def most_axes(self) -> int:  # type: ignore[override]
        """Three for what rises by itself, else two."""
        return 3 if self.robot(1.0, 0.2).drive.lifts else 2

    @property
    def stays(self) -> bool:  # type: ignore[override]
        """Whether it cannot choose its height: all but what rises by itself."""
        return self.most_axes == 2

    @property
    def passes_floor(self) -> bool:  # type: ignore[override]
        """Whether joints hold its height, so that no floor bears it."""
        model = self.robot(1.0, 0.2)
        return not (model.stands or model.drive.lifts)

    def coordinates(self, axes: int) -> int:
        """Return its number of generalized positions."""
        return self.robot(1.0, 0.2).coordinates

    def motors(self, axes: int) -> int:
        """Return the number of motors that drive it; servos have no errors of their own."""
        return len(self.robot(1.0, 0.2).drive.motors)

    def actuators(self, axes: int) -> int:
        """Return the number of its actuators, those included that hold still."""
        return self.robot(1.0, 0.2).actuators

    def height(self, radius: float) -> float:
        """Return the height at which a planar mission of such robots happens [m].

        Robots that lift themselves hover there. Others stay where they are: the height is that of the
        controlled point, or of the middle half of what can touch, so that what stands there meets them.
        """
        model = self.robot(1.0, radius)
        if model.drive.lifts:
            return radius + HOVER
        low, high = model.span
        edge = 0.25 * (high - low)
        return min(max(model.start[2] + model.lifted, low + edge), high - edge)

    def span(self, radius: float, height: float) -> tuple[float, float]:
        """Return the heights between which it can touch something at the start [m]."""
        model = self.robot(1.0, radius)
        low, high = model.span
        if not model.drive.lifts:
            return low, high
        return low + height - model.start[2], high + height - model.start[2]

    def lift(self, mass: float, gravity: Sequence[float]) -> tuple[float, ...]:
        """Return the force against its weight, world frame, shape (3,) [N]; 0 where something bears it."""
        model = self.robot(mass, 0.2)
        if not model.drive.lifts:
            return (0.0, 0.0, 0.0)
        return tuple(-model.mass * pull for pull in gravity)

    def craft(self, mass: float, radius: float, gravity: Sequence[float], height: float) -> Craft | None:
        """Return what attitude loop and height control know of it; None where it has neither."""
        craft = self.drive_model(mass, radius).craft
        return None if craft is None else craft._replace(height=height)

    def drive_model(self, mass: float, radius: float) -> DriveModel:
        """Return its drive."""
        return self.robot(mass, radius).drive


_known: dict[Source, RobotModel] = {}


def known(source: Source, model: RobotModel | None = None) -> RobotModel:
    """Return a model, which is read once in a process.

    Args:
        source: Where it is.
        model: What was read already, under another name.

    Raises:
        RobotError: If it cannot be read, or cannot be driven.
    """
    if model is not None:
        _known[source] = model
    elif source not in _known:
        reading: Any = import_module(READER)
        _known[source] = cast(RobotModel, reading.read_model(source))
    return _known[source]


def known_now(source: Source) -> RobotModel:
    """Return a model as its files are now; it is read again where they, their includes or assets changed.

    Args:
        source: Where it is.

    Raises:
        RobotError: If it cannot be read, or cannot be driven.
    """
    reading: Any = import_module(READER)
    digest = reading.read_files(source).digest
    if source.sha256 not in ("", digest):
        return cast(RobotModel, reading.read_model(source))  # says that it has changed
    return known(source._replace(sha256=digest))
