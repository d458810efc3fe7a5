"""The attitude loop in plain NumPy: rotation matrices and a mixing matrix that is solved, not written out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.attitude import Craft

Array = NDArray[np.float64]

QUARTERS = ((1, 1), (-1, 1), (-1, -1), (1, -1))  # signs of x and y of each rotor


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


def wanted_rotation(force: Array) -> Array:
    """The attitude whose z axis is along a force and whose x axis is in the world's xz plane."""
    z = force / np.linalg.norm(force)
    y = np.cross(z, [1.0, 0.0, 0.0])
    y /= np.linalg.norm(y)
    return np.column_stack([np.cross(y, z), y, z])


def thrusts_for(force: Array, orientation: Array, rate: Array, craft: Craft) -> Array:
    """Thrusts that are to make a force, shape (4,) [N]; arguments as of `attitude.fly`."""
    upward = max(force[2], craft.least_lift)
    across = np.hypot(force[0], force[1])
    share = min(1.0, craft.most_slope * upward / across) if across > 0.0 else 1.0
    reachable = np.array([share * force[0], share * force[1], upward])
    actual, wanted = rotation(orientation), wanted_rotation(reachable)
    skew = 0.5 * (wanted.T @ actual - actual.T @ wanted)
    error = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    inertia = np.diag([craft.inertia_x, craft.inertia_y, craft.inertia_z])
    torque = -inertia @ (craft.stiffness * error + craft.damping * rate) + np.cross(rate, inertia @ rate)
    turning = np.linalg.solve(mixing(craft), [0.0, *torque])
    even = float(reachable @ actual[:, 2]) / 4.0
    return np.asarray(turning + max(min(even, craft.rotor_limit - turning.max()), -turning.min()))
