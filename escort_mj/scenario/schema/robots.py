"""The team's part of a scenario: how many robots, of what kind, with what motors, where, and what fails."""

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveInt

from escort_mj.components.parameters import Deferred, Distance, Force, Mass, Parameters, Radius, Vector
from escort_mj.components.random_placement import RandomPlacement
from escort_mj.robots import KINDS, PointMass
from escort_mj.robots.kind import plane_height
from escort_mj.scenario.findings import listed
from escort_mj.scenario.schema.fields import Failure, Law, RobotKind

MAX_ROBOTS = 5000
RobotNumber = Annotated[int, Field(ge=1, le=MAX_ROBOTS)]
Share = Annotated[float, Field(ge=0, lt=1)]
Gain = Annotated[float, Field(gt=0, le=10)]
KIND_NAMES = [f"`{kind.own_name()}`" for kind in KINDS]


class Actuators(Parameters):
    """Motor errors, unknown to the controller."""

    lag: NonNegativeFloat = 0.0
    """Time constant of the first-order lag from command to force [s]; 0: no lag."""
    dead_zone: NonNegativeFloat = 0.0
    """Half-width of the dead zone [N]: it is subtracted from the magnitude of every command, and smaller
    commands have no effect."""
    gain_error: Share = 0.0
    """Largest relative error of a motor's gain; each motor's error is drawn at random [1]."""
    gains: Annotated[tuple[Gain, ...], Field(min_length=1)] | None = None
    """Gain of each motor; 1 is the nominal value [1]; null: random, see `gain_error`."""


class RobotOverride(Parameters):
    """Values of a single robot; null: the team's value."""

    robot: PositiveInt
    """Number of the robot, from 1."""
    mass: Mass | None = None
    """Mass [kg]."""
    radius: Radius | None = None
    """Radius [m]."""
    force_limit: Force | None = None
    """Largest force per axis [N]."""
    kind: RobotKind | None = None
    """Kind of robot: a name, or a table with parameters."""
    actuators: Actuators | None = None
    """Motor errors of this robot."""
    controller: Law | None = None
    """Law of this robot, in any team: a name, or a table with gains, as in `controller`."""
    position: Vector | None = None
    """Initial position [m]."""


class Tether(Parameters):
    """An elastic line between the centers of two bodies: a cable, or a spring."""

    between: tuple[RobotNumber | Literal["target"], RobotNumber | Literal["target"]]
    """The two bodies: numbers of robots, from 1, or `target`."""
    length: Distance
    """Distance at which it is taut, but not yet stretched [m]."""
    stiffness: Annotated[float, Field(gt=0.0, le=1e6)] | None = 100.0
    """Force per length by which it is stretched [N/m]; null: MuJoCo's constraint keeps it from stretching."""
    damping: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    """Force per rate at which a spring's length changes [N s/m]; cables have none."""
    pushes: bool = False
    """Whether it is a spring, which also pushes when shorter; a cable is slack then."""


class Robots(Parameters):
    """The team of robots."""

    count: Annotated[int, Field(ge=1, le=MAX_ROBOTS)] | None = None
    """Number of robots; null: the length of `positions` if set, otherwise 5 with two axes, and twice the
    number of axes with more."""
    kind: RobotKind = Field(
        default=PointMass.model_construct(),
        description=f"Kind of robot: {listed(KIND_NAMES)}, or a table with\nthe name and parameters.",
    )
    mass: Mass = 1.0
    """Mass of each robot [kg]."""
    radius: Radius = 0.2
    """Radius of the body of each robot [m]."""
    force_limit: Force | None = 10.0
    """Largest force per axis [N]: of each motor or, for kinds whose motors do not act along the axes, of the
    command; null: no limit."""
    actuators: Actuators = Actuators.model_construct()
    """Motor errors."""
    positions: Annotated[tuple[Vector, ...], Field(min_length=1, max_length=MAX_ROBOTS)] | None = None
    """Initial positions, one row per robot [m]; null: random, see `placement`."""
    velocities: Annotated[tuple[Vector, ...], Field(min_length=1, max_length=MAX_ROBOTS)] | None = None
    """Initial velocities, one row per robot [m/s]; balls start rolling without slip; null: at rest."""
    placement: RandomPlacement | None = None
    """Random initial positions; null: within twice the mission's radius of the target."""
    overrides: tuple[Annotated[RobotOverride, Deferred()], ...] = ()
    """Values of single robots, in place of the team's."""
    failures: tuple[Failure, ...] = ()
    """Robots whose motors fail during the mission."""
    tethers: Annotated[tuple[Tether, ...], Field(max_length=MAX_ROBOTS)] = ()
    """Cables and springs between robots, and from robots to the target."""

    @property
    def height(self) -> float:
        """Height of the plane of a planar mission above its floor, at which distances are measured [m]."""
        each = [(each.kind or self.kind, each.radius or self.radius) for each in self.overrides]
        return plane_height([(self.kind, self.radius), *each])

    @property
    def largest_radius(self) -> float:
        """Radius of the largest body [m]."""
        return max([self.radius, *(override.radius or 0.0 for override in self.overrides)])
