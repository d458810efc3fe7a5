"""Kinds of robots, each a table of its parameters: everything that depends on the kind is said here once.

Bodies and motors of a kind are the MJCF part of its name in `models/`. The first coordinates of every kind
are the position of its hull, one per axis of the mission.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar, Literal
from xml.etree.ElementTree import Element

from pydantic import Field, NonNegativeFloat, PositiveFloat

from escort_mj.components.parameters import Parameters
from escort_mj.control.attitude import Craft
from escort_mj.scenario.schema.fields import Mass, Radius

FREE_COORDINATES = 7  # of a free body: a place and a quaternion
ROTORS = 4
MOST_MOTORS = 9  # of any kind
HOVER = 0.5  # m, height of flying robots above the floor of planar missions, below their hulls
LEAST_LIFT = 0.2  # of its weight, that a quadrotor's thrust keeps upward
CLEAR_OF_FLOOR = 0.1  # m, that what hangs below a robot is kept above the floor of planar missions


class RobotKind(Parameters):
    """What all kinds answer, beside their own parameters."""

    most_axes: ClassVar[int] = 3
    rolls: ClassVar[bool] = False
    """Whether it rolls on the floor: planar missions only."""
    needs_gravity: ClassVar[bool] = False
    """Whether a mission with it has gravity unless told otherwise."""
    flies: ClassVar[bool] = False
    """Whether thrust holds its weight, turned by our own attitude loop to where the law wants a force."""
    mjcf: ClassVar[str] = ""
    """MJCF of a plugin's kind (docs/plugins.md); of others it is a file in models/."""

    kind: str

    def shape(self, parts: Mapping[str, Element], radius: float) -> None:
        """Gives the parts of one robot's body the sizes and masses that the parameters say.

        Args:
            parts: Elements of the body by their names in the MJCF.
            radius: Of its hull [m].
        """

    def coordinates(self, axes: int) -> int:
        """Number of its generalized positions in a mission of so many axes."""
        return axes

    def motors(self, axes: int) -> int:
        """Number of its motors: one per axis, or its rotors."""
        return axes

    def actuators(self, axes: int) -> int:
        """Number of MuJoCo's actuators that its motors are made of."""
        return self.motors(axes)

    def burden(self) -> float:
        """Mass of what it carries unknown to the controller [kg]."""
        return 0.0

    def height(self, radius: float) -> float:
        """Least height of its hull's center above the floor of a planar mission [m].

        Args:
            radius: Of its hull [m].
        """
        return radius


class PointMass(RobotKind):
    """Slides freely along each axis; its mass is all there is."""

    most_axes: ClassVar[int] = 9

    kind: Literal["point_mass"] = "point_mass"


class RollingSphere(RobotKind):
    """A ball that rolls on the floor, pushed at its center (axes 2)."""

    most_axes: ClassVar[int] = 2
    rolls: ClassVar[bool] = True
    needs_gravity: ClassVar[bool] = True

    kind: Literal["rolling_sphere"] = "rolling_sphere"

    def coordinates(self, axes: int) -> int:
        """Those of a free body."""
        return FREE_COORDINATES


class Loaded(RollingSphere):
    """A rolling ball with a hidden off-center mass, which wobbles and must be lifted as it rolls (axes 2)."""

    kind: Literal["loaded"] = "loaded"  # type: ignore[assignment]
    load: Mass = 0.5
    """Mass of the load, on top of the ball's [kg]."""
    offset: Radius = 0.1
    """Distance of the load from the ball's center [m]; at the start it is below the center."""

    def burden(self) -> float:
        """The load's [kg]."""
        return self.load


class Slung(RobotKind):
    """A sliding mass with a hidden payload that swings below it: its mass matrix turns with the swing."""

    needs_gravity: ClassVar[bool] = True

    kind: Literal["slung"] = "slung"
    payload: Mass = 0.3
    """Mass of the payload, on top of the robot's [kg]."""
    cable: Radius = 0.8
    """Length of the cable, a rod without mass, from the robot's center to the payload's [m]."""
    damping: NonNegativeFloat = 0.02
    """Damping of the swing about each horizontal axis [N m s/rad]."""
    payload_radius: Radius = 0.08
    """Radius of the payload, a ball [m]."""
    payload_collides: bool = False
    """Whether the payload can touch anything; otherwise it passes through, and only swings."""

    def burden(self) -> float:
        """The payload's [kg]."""
        return self.payload

    def coordinates(self, axes: int) -> int:
        """Two angles of the cable beside the position."""
        return axes + 2

    def height(self, radius: float) -> float:
        """High enough for the payload to hang clear of the floor [m]."""
        return max(radius, self.cable + self.payload_radius + CLEAR_OF_FLOOR)


class Quadrotor(RobotKind):
    """Four rotors on a rigid body. An attitude loop of ours turns its thrust to where the law wants a force.

    The weight of its nominal mass is fed forward; in planar missions its height is held. The escort law knows
    of none of this. Its hull is a sphere of the robot's radius, which the rotors do not reach beyond.
    """

    needs_gravity: ClassVar[bool] = True
    flies: ClassVar[bool] = True

    kind: Literal["quadrotor"] = "quadrotor"
    arm: Radius | None = None
    """From the center to a rotor's [m]; null: 0.7 of its radius."""
    inertia: Annotated[tuple[PositiveFloat, ...], Field(min_length=3, max_length=3)] | None = None
    """Moments of inertia about its axes [kg m^2]; null: of a uniform disc as wide as the arms."""
    nominal_mass: Mass | None = None
    """Mass whose weight is fed forward [kg]; null: its mass."""
    thrust_to_weight: Annotated[float, Field(gt=1, le=100)] = 2.5
    """Largest thrust of all rotors together over its nominal weight [1]."""
    torque_per_thrust: Annotated[float, Field(ge=1e-4, le=1)] = 0.016
    """Reaction torque of a rotor about its axis over its thrust [m]."""
    attitude_frequency: Annotated[float, Field(gt=0, le=1e3)] = 15.0
    """Natural frequency of the attitude loop [rad/s]."""
    attitude_damping: Annotated[float, Field(gt=0, le=10)] = 0.8
    """Damping ratio of the attitude loop [1]."""
    tilt_limit: Annotated[float, Field(gt=0, le=1.4)] = 0.7
    """Largest tilt that it is told to take [rad]; horizontal force beyond is cut off."""
    height_frequency: Annotated[float, Field(gt=0, le=100)] = 3.0
    """Natural frequency at which planar missions hold its height, critically damped [rad/s]."""

    def coordinates(self, axes: int) -> int:
        """Those of a free body."""
        return FREE_COORDINATES

    def motors(self, axes: int) -> int:
        """Its rotors."""
        return ROTORS

    def actuators(self, axes: int) -> int:
        """One for the torques of each rotor, and one along each of the world's axes for the thrust of all."""
        return ROTORS + 3

    def height(self, radius: float) -> float:
        """Clear of the floor, whatever its height does [m]."""
        return radius + HOVER

    def arm_length(self, radius: float) -> float:
        """From the center to a rotor's [m].

        Args:
            radius: Of its hull [m].
        """
        return 0.7 * radius if self.arm is None else self.arm

    def lift(self, mass: float, gravity: Sequence[float]) -> tuple[float, ...]:
        """Force that is fed forward against the weight of its nominal mass, world frame, shape (3,) [N].

        Args:
            mass: Its true mass [kg].
            gravity: World frame, shape (3,) [m/s^2].
        """
        return tuple(-(self.nominal_mass or mass) * pull for pull in gravity)

    def craft(self, mass: float, radius: float, gravity: Sequence[float], height: float) -> Craft:
        """What its attitude loop knows of it.

        Args:
            mass: Its true mass [kg]; the loop knows the nominal one.
            radius: Of its hull [m].
            gravity: World frame, shape (3,) [m/s^2].
            height: That planar missions hold [m].
        """
        nominal = self.nominal_mass or mass
        lift = self.lift(mass, gravity)[2]
        across_x, across_y, along = self.moments(nominal, radius)
        return Craft(
            stiffness=self.attitude_frequency**2,
            damping=2.0 * self.attitude_damping * self.attitude_frequency,
            inertia_x=across_x,
            inertia_y=across_y,
            inertia_z=along,
            lever=self.arm_length(radius) / math.sqrt(2.0),
            torque_per_thrust=self.torque_per_thrust,
            least_lift=LEAST_LIFT * lift,
            most_slope=math.tan(self.tilt_limit),
            rotor_limit=self.thrust_to_weight * lift / ROTORS,
            height=height,
            height_stiffness=nominal * self.height_frequency**2,
            height_damping=2.0 * nominal * self.height_frequency,
        )

    def moments(self, mass: float, radius: float) -> tuple[float, ...]:
        """Moments of inertia about its own axes, shape (3,) [kg m^2].

        Args:
            mass: Its true mass [kg].
            radius: Of its hull [m].
        """
        across = 0.25 * mass * self.arm_length(radius) ** 2
        return (across, across, 2.0 * across) if self.inertia is None else self.inertia


KINDS = (PointMass, RollingSphere, Loaded, Slung, Quadrotor)
Kind = PointMass | RollingSphere | Loaded | Slung | Quadrotor
