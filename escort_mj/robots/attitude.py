"""The attitude loop of robots that fly: thrust and torques that make the force which is wanted.

A geometric PD on SO(3) after Lee, Leok and McClamroch, "Geometric tracking control of a quadrotor UAV on
SE(3)", CDC 2010: thrust is the wanted force along the body's z axis, and the torque turns that axis to the
force, with the body's x axis kept in the world's xz plane. The escort law knows of none of it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import inlined, kernel, matrix_at, stack_memory

Array = NDArray[np.float64]

ROTORS = 4
QUARTERS = ((1, 1), (-1, 1), (-1, -1), (1, -1))  # signs of x and y of each rotor
TURNS = tuple(x * y for x, y in QUARTERS)  # sign of the torque about z that each makes


class Craft(NamedTuple):
    """What the loop knows of one robot that flies; the rows of `Addresses.crafts`."""

    stiffness_x: float  # of the attitude over the moment of inertia [1/s^2]
    stiffness_y: float
    stiffness_z: float
    damping_x: float  # likewise [1/s]
    damping_y: float
    damping_z: float
    inertia_x: float  # [kg m^2]
    inertia_y: float
    inertia_z: float
    lever: float  # of a rotor about the x and the y axis [m]; this, the next and the limit: of four alike
    torque_per_thrust: float  # [m]
    least_lift: float  # upward force that it always keeps [N]
    most_slope: float  # tangent of the largest tilt
    rotor_limit: float  # [N]
    height: float  # that planar missions hold [m]
    height_stiffness: float  # [N/m]
    height_damping: float  # [N s/m]


(
    STIFFNESS, _, _, DAMPING, _, _, INERTIA, _, _, LEVER, TORQUE_PER_THRUST, LEAST_LIFT, MOST_SLOPE,
    ROTOR_LIMIT, HEIGHT, HEIGHT_STIFFNESS, HEIGHT_DAMPING,
) = range(len(Craft._fields))  # fmt: skip


@inlined
def hold_height(craft: Array, height: float, climb: float) -> float:
    """Vertical force that keeps a planar mission's height, beside the lift [N].

    Args:
        craft: A row of `Craft`.
        height: Of the hull's center [m].
        climb: Its rate [m/s].
    """
    return craft[HEIGHT_STIFFNESS] * (craft[HEIGHT] - height) - craft[HEIGHT_DAMPING] * climb


@inlined
def within_reach(force: Array, craft: Array) -> None:
    """Cuts a force to what the craft is to be tilted for: enough of it upward, and no more across.

    Args:
        force: World frame, shape (3,) [N]; changed in place.
        craft: A row of `Craft`.
    """
    force[2] = max(force[2], craft[LEAST_LIFT])
    across = math.sqrt(force[0] * force[0] + force[1] * force[1])
    most = craft[MOST_SLOPE] * force[2]
    if across > most:
        force[0] *= most / across
        force[1] *= most / across


@inlined
def axes_of_body(orientation: Array, axes: Array) -> None:
    """The body's axes in the world.

    Args:
        orientation: Unit quaternion, real part first, shape (4,).
        axes: Result: each row is one of the body's axes, shape (3, 3).
    """
    w, x, y, z = orientation[0], orientation[1], orientation[2], orientation[3]
    axes[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    axes[0, 1] = 2.0 * (x * y + w * z)
    axes[0, 2] = 2.0 * (x * z - w * y)
    axes[1, 0] = 2.0 * (x * y - w * z)
    axes[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    axes[1, 2] = 2.0 * (y * z + w * x)
    axes[2, 0] = 2.0 * (x * z + w * y)
    axes[2, 1] = 2.0 * (y * z - w * x)
    axes[2, 2] = 1.0 - 2.0 * (x * x + y * y)


@inlined
def axes_for(force: Array, axes: Array) -> None:
    """The axes that a body is to have: z along a force, x in the world's xz plane.

    Args:
        force: World frame, upward, shape (3,) [N].
        axes: Result, as in `axes_of_body`.
    """
    size = math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    for k in range(3):
        axes[2, k] = force[k] / size
    flat = math.sqrt(axes[2, 1] * axes[2, 1] + axes[2, 2] * axes[2, 2])
    axes[1, 0], axes[1, 1], axes[1, 2] = 0.0, axes[2, 2] / flat, -axes[2, 1] / flat  # z cross the world's x
    axes[0, 0] = axes[1, 1] * axes[2, 2] - axes[1, 2] * axes[2, 1]
    axes[0, 1] = axes[1, 2] * axes[2, 0] - axes[1, 0] * axes[2, 2]
    axes[0, 2] = axes[1, 0] * axes[2, 1] - axes[1, 1] * axes[2, 0]


@inlined
def axes_toward(force: Array, heading: Array, axes: Array) -> None:
    """The axes that a body is to have: z along a force, x as near to a heading as can be.

    Args:
        force: World frame, upward, shape (3,) [N].
        heading: Unit vector, shape (3,).
        axes: Result, as in `axes_of_body`.
    """
    size = math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    for k in range(3):
        axes[2, k] = force[k] / size
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        axes[1, k] = axes[2, a] * heading[b] - axes[2, b] * heading[a]
    across = math.sqrt(axes[1, 0] * axes[1, 0] + axes[1, 1] * axes[1, 1] + axes[1, 2] * axes[1, 2])
    for k in range(3):
        axes[1, k] /= across
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        axes[0, k] = axes[1, a] * axes[2, b] - axes[1, b] * axes[2, a]


@inlined
def turn_craft(wanted: Array, axes: Array, rate: Array, craft: Array, torque: Array) -> None:
    """Torque that turns a body: -J (stiffness e_R + damping w) + w x J w (eqs. 10 and 16 of Lee et al.).

    Args:
        wanted: The axes that it is to have, as in `axes_of_body`.
        axes: Those that it has.
        rate: Its angular velocity w, in its own frame, shape (3,) [rad/s].
        craft: A row of `Craft`.
        torque: Result, in the body's own frame, shape (3,) [N m].
    """
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        error = 0.0
        for c in range(3):
            error += 0.5 * (wanted[b, c] * axes[a, c] - wanted[a, c] * axes[b, c])
        inertia = craft[INERTIA + k]
        torque[k] = -inertia * (craft[STIFFNESS + k] * error + craft[DAMPING + k] * rate[k])
        torque[k] += (craft[INERTIA + b] - craft[INERTIA + a]) * rate[a] * rate[b]


@inlined
def mix_rotors(thrust: float, torque: Array, craft: Array, thrusts: Array) -> None:
    """Thrusts of the rotors; where not all can be had, torque comes before the sum of thrusts.

    Args:
        thrust: Of all rotors together [N].
        torque: In the body's own frame, shape (3,) [N m].
        craft: A row of `Craft`.
        thrusts: Result: of the rotors at (+, +), (-, +), (-, -), (+, -) of x and y, shape (4,) [N].
    """
    roll, pitch = 0.25 * torque[0] / craft[LEVER], 0.25 * torque[1] / craft[LEVER]
    yaw = 0.25 * torque[2] / craft[TORQUE_PER_THRUST]
    thrusts[0] = roll - pitch + yaw
    thrusts[1] = roll + pitch - yaw
    thrusts[2] = -roll + pitch + yaw
    thrusts[3] = -roll - pitch - yaw
    low = min(min(thrusts[0], thrusts[1]), min(thrusts[2], thrusts[3]))
    high = max(max(thrusts[0], thrusts[1]), max(thrusts[2], thrusts[3]))
    share = max(min(0.25 * thrust, craft[ROTOR_LIMIT] - high), -low)
    for rotor in range(ROTORS):
        thrusts[rotor] += share


@kernel
def fly_craft(force: Array, orientation: Array, rate: Array, craft: Array, thrusts: Array) -> None:
    """Thrusts that are to make a force.

    Args:
        force: That is wanted, the lift included, world frame, shape (3,) [N]; cut to what can be had.
        orientation: Unit quaternion, real part first, shape (4,).
        rate: Angular velocity in the body's frame, shape (3,) [rad/s].
        craft: A row of `Craft`.
        thrusts: Result: the command of the rotors, shape (4,) [N].
    """
    scratch = matrix_at(stack_memory(), 7, 3)
    wanted, axes, torque = scratch[:3], scratch[3:6], scratch[6]
    within_reach(force, craft)
    axes_of_body(orientation, axes)
    axes_for(force, wanted)
    turn_craft(wanted, axes, rate, craft, torque)
    thrust = force[0] * axes[2, 0] + force[1] * axes[2, 1] + force[2] * axes[2, 2]
    mix_rotors(thrust, torque, craft, thrusts)
