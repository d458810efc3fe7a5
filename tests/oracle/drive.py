"""What motors have to give for a force, by least squares of matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.robots.drive import THRUST, DriveModel
from tests.oracle.attitude import reachable_force, torque_for, wanted_rotation

Array = NDArray[np.float64]


def demand_for(model: DriveModel, wanted: Array, rotation: Array, rate: Array) -> Array:
    """What is demanded of a robot's base, w, shape (6,).

    Args:
        model: The drive.
        wanted: Force with the lift [N], velocity [m/s] or way from the start [m], world frame, shape (3,).
        rotation: Of the base, shape (3, 3).
        rate: Its angular velocity in its own frame, shape (3,) [rad/s].
    """
    if model.mode == THRUST:
        assert model.craft is not None
        force = reachable_force(wanted, model.craft)
        heading = np.array([1.0, 0.0, 0.0]) if model.holds_attitude else rotation[:, 0]
        torque = torque_for(wanted_rotation(force, heading), rotation, rate, model.craft)
        return np.array([force @ rotation[:, 2], *torque, 0.0, 0.0])
    along = wanted if model.in_world else rotation.T @ wanted
    torque = np.zeros(3)
    if model.holds_attitude:
        assert model.craft is not None
        torque = torque_for(np.eye(3), rotation, rate, model.craft)
    return np.array([*along, *torque])
