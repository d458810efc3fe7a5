"""Attitude of flying robots with rotation matrices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from escort_mj.robots.attitude import QUARTERS, Craft

Array = NDArray[np.float64]


def rotation(orientation: Array) -> Array:
    """Rotation matrix of a unit quaternion w + u, real part first: v + 2 w u x v + 2 u x (u x v)."""
    real, imaginary = orientation[0], np.asarray(orientation[1:])
    cross = np.cross(imaginary, np.eye(3)).T
    return np.asarray(np.eye(3) + 2.0 * real * cross + 2.0 * cross @ cross)


def mixing(craft: Craft) -> Array:
    """What thrusts make: their sum and the torques about x, y, z, as a matrix, shape (4, 4)."""
    return np.array(
        [[1.0, craft.lever * y, -craft.lever * x, craft.torque_per_thrust * x * y] for x, y in QUARTERS]
    ).T


def wanted_rotation(force: Array, heading: Sequence[float] | Array = (1.0, 0.0, 0.0)) -> Array:
    """The attitude whose z axis is along a force and whose x axis is in its plane with a heading."""
    z = force / np.linalg.norm(force)
    y = np.cross(z, heading)
    y /= np.linalg.norm(y)
    return np.column_stack([np.cross(y, z), y, z])


def reachable_force(force: Array, craft: Craft) -> Array:
    """A force cut to what the craft is to be tilted for, world frame, shape (3,) [N]."""
    upward = max(force[2], craft.least_lift)
    across = np.hypot(force[0], force[1])
    share = min(1.0, craft.most_slope * upward / across) if across > 0.0 else 1.0
    return np.array([share * force[0], share * force[1], upward])


def torque_for(wanted: Array, actual: Array, rate: Array, craft: Craft) -> Array:
    """Torque that turns a body from one rotation to another, in its own frame, shape (3,) [N m]."""
    skew = 0.5 * (wanted.T @ actual - actual.T @ wanted)
    error = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    inertia = np.diag([craft.inertia_x, craft.inertia_y, craft.inertia_z])
    stiffness = np.array([craft.stiffness_x, craft.stiffness_y, craft.stiffness_z])
    damping = np.array([craft.damping_x, craft.damping_y, craft.damping_z])
    return np.asarray(-inertia @ (stiffness * error + damping * rate) + np.cross(rate, inertia @ rate))


def thrusts_for(force: Array, orientation: Array, rate: Array, craft: Craft) -> Array:
    """Thrusts that are to make a force, shape (4,) [N]; arguments as of `fly`."""
    actual, force = rotation(orientation), reachable_force(force, craft)
    torque = torque_for(wanted_rotation(force), actual, rate, craft)
    turning = np.linalg.solve(mixing(craft), [0.0, *torque])
    even = float(force @ actual[:, 2]) / 4.0
    return np.asarray(turning + max(min(even, craft.rotor_limit - turning.max()), -turning.min()))
