"""Four rotors on a rigid body: its parameters, its body, and what its motors are commanded.

A rotor's motor only turns the body; what the rotors push together is the command of three more, along the
world's axes (see `models/quadrotor.xml`), as MuJoCo is about to find it: behind gains, lags and limits.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, ClassVar, Literal
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PositiveFloat

from escort_mj.components.parameters import Mass, Radius
from escort_mj.mjcf import set_attributes
from escort_mj.native.kernels import DOUBLE, matrix_at, merged, stack_memory, vector_at
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State
from escort_mj.robots.addresses import Addresses
from escort_mj.robots.attitude import (
    QUARTERS,
    ROTOR_LIMIT,
    ROTORS,
    TURNS,
    Craft,
    axes_of_body,
    fly_craft,
    hold_height,
)
from escort_mj.robots.kind import FREE_COORDINATES, Motor, RobotKind

Array = NDArray[np.float64]

HOVER = 0.5  # m, height above the floor of planar missions, below its hull
LEAST_LIFT = 0.2  # of its weight, that its thrust keeps upward
THRUSTS = ("thrust_x", "thrust_y", "thrust_z")
NAMES = tuple(f"rotor_{number}" for number in range(1, ROTORS + 1))
HUB, ROTOR, THICKNESS, ARM = 0.3, 0.28, 0.03, 0.04  # sizes of what is drawn, of its radius


class Quadrotor(RobotKind):
    """Four rotors on a rigid body. An attitude loop tilts the thrust toward the force that the law demands.

    The weight of the nominal mass is fed forward, and in planar missions, the height is held. The law knows
    nothing of the attitude loop, the feedforward or the height control. The hull, a sphere with the robot's
    radius, contains the rotors.
    """

    part: ClassVar[str] = "quadrotor"
    opacity: ClassVar[float] = 0.15
    painted: ClassVar[tuple[str, ...]] = ("hub", *NAMES)
    needs_gravity: ClassVar[bool] = True
    has_heading: ClassVar[bool] = True
    flies: ClassVar[bool] = True

    kind: Literal["quadrotor"] = "quadrotor"
    arm: Radius | None = None
    """Distance of the rotors from the center [m]; null: 0.7 times the radius."""
    inertia: Annotated[tuple[PositiveFloat, ...], Field(min_length=3, max_length=3)] | None = None
    """Moments of inertia about the body axes [kg m^2]; null: those of a uniform disc whose radius is the
    length of the arms."""
    nominal_mass: Mass | None = None
    """Mass whose weight is fed forward [kg]; null: the mass of the robot."""
    thrust_to_weight: Annotated[float, Field(gt=1, le=100)] = 2.5
    """Largest total thrust divided by the nominal weight [1]."""
    torque_per_thrust: Annotated[float, Field(ge=1e-4, le=1)] = 0.016
    """Reaction torque of a rotor about its axis divided by its thrust [m]."""
    attitude_frequency: Annotated[float, Field(gt=0, le=1e3)] = 15.0
    """Natural frequency of the attitude loop [rad/s]."""
    attitude_damping: Annotated[float, Field(gt=0, le=10)] = 0.8
    """Damping ratio of the attitude loop [1]."""
    tilt_limit: Annotated[float, Field(gt=0, le=1.4)] = 0.7
    """Largest commanded tilt [rad]; it limits the horizontal force."""
    height_frequency: Annotated[float, Field(gt=0, le=100)] = 3.0
    """Natural frequency of the critically damped height control in planar missions [rad/s]."""

    def misfits(self, radius: float) -> Iterator[str]:
        """Yield arms that reach out of the hull, and moments of inertia that no body has."""
        if self.arm_length(radius) >= radius:
            yield f"found arms of {self.arm:g} m in a hull of radius {radius:g} m; expected them inside"
        largest = max(moments := self.moments(1.0, radius))
        if 2.0 * largest > sum(moments):
            yield (
                f"found moments of inertia of which {largest:g} kg m^2 is more than the two others together; "
                "no body has such"
            )

    def coordinates(self, axes: int) -> int:
        """Return those of a free body."""
        return FREE_COORDINATES

    def motors(self, axes: int) -> int:
        """Return the number of its rotors."""
        return ROTORS

    def actuators(self, axes: int) -> int:
        """Return one for the torques of each rotor, and one for the thrust of all along each world axis."""
        return ROTORS + len(THRUSTS)

    def height(self, radius: float) -> float:
        """Return a height clear of the floor, whatever happens to it in flight [m]."""
        return radius + HOVER

    def shape(self, parts: Mapping[str, Element], radius: float) -> None:
        """Give hub, rotors and arms their sizes."""
        set_attributes(parts["hub"], size=[HUB * radius, HUB * radius, HUB * radius / 2])
        places = self.rotor_positions(radius)
        for name, place in zip(NAMES, places, strict=True):
            set_attributes(parts[name], pos=place, size=[ROTOR * radius, THICKNESS * radius])
        for name, (one, other) in {"arm_1": (0, 2), "arm_2": (1, 3)}.items():
            set_attributes(parts[name], size=ARM * radius, fromto=[*places[one], *places[other]])

    def weigh(self, parts: Mapping[str, Element], mass: float, radius: float) -> None:
        """Give the body its mass and moments of inertia; its geoms weigh nothing."""
        set_attributes(parts["inertial"], mass=mass, diaginertia=self.moments(mass, radius))

    def free_motors(self, mass: float, radius: float, gravity: Sequence[float]) -> tuple[Motor, ...]:
        """Return the motors of the rotors, which turn it, and those of their thrust, which push it."""
        most = self.craft(mass, radius, gravity, 0.0).rotor_limit
        hover = self.lift(mass, gravity)[2] / ROTORS
        rotors = [
            Motor(name, (0.0, 0.0, 0.0, y, -x, turns * self.torque_per_thrust), (0.0, most), hover)
            for name, (x, y, _), turns in zip(NAMES, self.rotor_positions(radius), TURNS, strict=True)
        ]
        return (*rotors, *map(Motor, THRUSTS))

    def lift(self, mass: float, gravity: Sequence[float]) -> tuple[float, ...]:
        """Return the force against the weight of its nominal mass, world frame, shape (3,) [N]."""
        return tuple(-(self.nominal_mass or mass) * pull for pull in gravity)

    def craft(self, mass: float, radius: float, gravity: Sequence[float], height: float) -> Craft:
        """Return what its attitude loop knows of it: its nominal mass, not the true one."""
        nominal = self.nominal_mass or mass
        lift = self.lift(mass, gravity)[2]
        across_x, across_y, along = self.moments(nominal, radius)
        damping = 2.0 * self.attitude_damping * self.attitude_frequency
        return Craft(
            stiffness_x=self.attitude_frequency**2,
            stiffness_y=self.attitude_frequency**2,
            stiffness_z=self.attitude_frequency**2,
            damping_x=damping,
            damping_y=damping,
            damping_z=damping,
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

    def arm_length(self, radius: float) -> float:
        """Return the distance from the center to a rotor's [m].

        Args:
            radius: Of its hull [m].
        """
        return 0.7 * radius if self.arm is None else self.arm

    def rotor_positions(self, radius: float) -> list[tuple[float, float, float]]:
        """Return where its rotors are, body frame, shape (4, 3) [m].

        Args:
            radius: Of its hull [m].
        """
        along = self.arm_length(radius) / math.sqrt(2.0)
        return [(x * along, y * along, 0.0) for x, y in QUARTERS]

    def moments(self, mass: float, radius: float) -> tuple[float, ...]:
        """Return its moments of inertia about its own axes, shape (3,) [kg m^2].

        Args:
            mass: Its true mass [kg].
            radius: Of its hull [m].
        """
        across = 0.25 * mass * self.arm_length(radius) ** 2
        return (across, across, 2.0 * across) if self.inertia is None else self.inertia


@on_demand
def pilot(
    i: int, qpos: Array, qvel: Array, plan: Plan, state: State, addresses: Addresses, rotors: Array
) -> None:
    """Find thrusts of one quadrotor for the force that the law wants, within its limit, and the lift.

    Args:
        i: Which robot.
        qpos: MuJoCo's generalized positions.
        qvel: Its generalized velocities.
        plan: Gives force limits.
        state: Gives the law's commands.
        addresses: Where the robot's coordinates are, and what it is like.
        rotors: Result: commands of its rotors, shape (4,) [N].
    """
    p = state.q.shape[1]
    craft = addresses.crafts[int(addresses.pilot[i])]
    place, dof = int(addresses.qpos_address[i]), int(addresses.dof_address[i])
    force = vector_at(stack_memory(), 3)
    limit = plan.force_limit[i]
    for k in range(3):
        force[k] = addresses.lift[i, k]
    for k in range(p):
        force[k] += min(max(state.command[i, k], -limit), limit)
    if p == 2:
        force[2] += hold_height(craft, qpos[place + 2], qvel[dof + 2])
    fly_craft(force, qpos[place + 3 : place + 7], qvel[dof + 3 : dof + 6], craft, rotors)


@merged
def push(i: int, rotors: int, activations: int, qpos: Array, addresses: Addresses) -> None:
    """Command the thrust of all rotors of one quadrotor, along its z axis, to the motors that push it.

    Args:
        i: Which robot.
        rotors: Address of its controls: four rotors, then the thrust along the world's axes.
        activations: Address of the states of MuJoCo's motors that lag.
        qpos: MuJoCo's generalized positions.
        addresses: Where the robot's coordinates are, and what it is like.
    """
    flyer = int(addresses.pilot[i])
    turning = rotors
    if addresses.rotor_state[flyer] >= 0.0:
        turning = activations + DOUBLE * int(addresses.rotor_state[flyer])
    pushes, thrust = vector_at(turning, ROTORS), 0.0
    for rotor in range(ROTORS):
        made = addresses.rotor_gain[flyer, rotor] * pushes[rotor]
        thrust += min(max(made, 0.0), addresses.crafts[flyer, ROTOR_LIMIT])
    axes = matrix_at(stack_memory(), 3, 3)
    place = int(addresses.qpos_address[i])
    axes_of_body(qpos[place + 3 : place + 7], axes)
    motors = vector_at(rotors + DOUBLE * ROTORS, 3)
    for k in range(3):
        motors[k] = thrust * axes[2, k]
