"""The team's part of a scenario: how many robots, of what kind, with what motors, where, and what fails."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, TypeAlias

from pydantic import Field, NonNegativeFloat, PositiveInt

from escort_mj.components.parameters import Force, Mass, Parameters, Radius
from escort_mj.control.failure import Failure
from escort_mj.robots import KINDS, PointMass, RobotKind
from escort_mj.scenario.findings import listed
from escort_mj.scenario.schema.fields import Vector, one_of_kinds

MAX_ROBOTS = 5000
Share = Annotated[float, Field(ge=0, lt=1)]
Gain = Annotated[float, Field(gt=0, le=10)]
KIND_NAMES = [f"`{kind.model_fields['kind'].default}`" for kind in KINDS]
if TYPE_CHECKING:
    OneKind: TypeAlias = RobotKind
else:
    OneKind = one_of_kinds(KINDS, "kind")


class Actuators(Parameters):
    """What motors do to the force that they are told. The controller knows of none of it."""

    lag: NonNegativeFloat = 0.0
    """Time constant with which force follows command, a first-order lag [s]; 0: at once."""
    dead_zone: NonNegativeFloat = 0.0
    """Force that every command loses, and below which a motor does nothing [N]."""
    gain_error: Share = 0.0
    """Largest error of a motor's gain, drawn from the seed for each motor [1]."""
    gains: Annotated[tuple[Gain, ...], Field(min_length=1)] | None = None
    """Gain of each motor, 1 for what the controller believes [1]; null: drawn as `gain_error` says."""


class RandomPlacement(Parameters):
    """Positions drawn from the scenario's seed: uniform in a ball (a disc when axes is 2)."""

    within: Radius
    """Radius of the ball [m]."""
    center: Vector | None = None
    """Center of the ball [m]; null: the target's position at the start."""
    least_gap: NonNegativeFloat = 1.0
    """Least surface-to-surface distance between robots, and from robots to obstacles and target [m]."""


class RobotOverride(Parameters):
    """What one robot has different from its team."""

    robot: PositiveInt
    """Which robot, counted from 1."""
    mass: Mass | None = None
    """Mass [kg]."""
    radius: Radius | None = None
    """Radius [m]."""
    force_limit: Force | None = None
    """Largest force per axis [N]."""
    kind: OneKind | None = None
    """What it is: a name, or a table with parameters."""
    actuators: Actuators | None = None
    """What its motors do to commands."""
    position: Vector | None = None
    """Initial position [m]."""


class Robots(Parameters):
    """The team of robots."""

    count: Annotated[int, Field(ge=1, le=MAX_ROBOTS)] | None = None
    """Number of robots; null: as many as `positions` has, or else 5 where axes is 2, else twice the axes."""
    kind: OneKind = Field(
        default=PointMass(),
        description=f"What they are: {listed(KIND_NAMES)}, or a table with\nits name and parameters.",
    )
    mass: Mass = 1.0
    """Mass of each [kg]."""
    radius: Radius = 0.2
    """Radius of each body [m]."""
    force_limit: Force | None = 10.0
    """Largest force per axis, of one motor each or of what a quadrotor is told [N]; null: no limit."""
    actuators: Actuators = Actuators()
    """What motors do to commands."""
    positions: Annotated[tuple[Vector, ...], Field(min_length=1, max_length=MAX_ROBOTS)] | None = None
    """Initial positions, one row per robot [m]; null: drawn as `placement` says."""
    velocities: Annotated[tuple[Vector, ...], Field(min_length=1, max_length=MAX_ROBOTS)] | None = None
    """Initial velocities, one row per robot [m/s]; balls roll at once; null: all are at rest."""
    placement: RandomPlacement | None = None
    """How to draw initial positions; null: within twice the mission's radius of the target."""
    overrides: tuple[RobotOverride, ...] = ()
    """Robots that differ from the team."""
    failures: tuple[Failure, ...] = ()
    """Robots whose motors fail during the mission."""

    @property
    def height(self) -> float:
        """Height of the plane of a planar mission above its floor, at which distances are measured [m]."""
        each = [(each.kind or self.kind, each.radius or self.radius) for each in self.overrides]
        return max(kind.height(radius) for kind, radius in [(self.kind, self.radius), *each])

    @property
    def largest_radius(self) -> float:
        """Radius of the largest body [m]."""
        return max([self.radius, *(override.radius or 0.0 for override in self.overrides)])
