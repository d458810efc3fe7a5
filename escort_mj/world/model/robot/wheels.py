"""How wheels follow from the motion of a robot's base without slip, whatever they are called."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RobotError
from escort_mj.world.model.robot.effects import HINGE, Machine, geom_outline

Array = NDArray[np.float64]

ALIGNED = 0.999  # cosine from which on two directions are one


class Rolling(NamedTuple):
    """The wheels of a robot, in the frame of its base.

    Attributes:
        joints: Velocity coordinate of each wheel.
        rates: Of each wheel for a velocity and a turning of 1 of the base's origin, shape (wheels, 3).
        forward: The direction in which they roll, shape (2,); zero for omnidirectional wheels.
        axle: Middle of their axle, shape (2,) [m].
        track: Distance of the outermost wheels across [m].
        radius: Of the wheels, mean [m].
    """

    joints: list[int]
    rates: Array
    forward: Array
    axle: Array
    track: float
    radius: float

    @property
    def is_omni(self) -> bool:
        """Whether the wheels let the base move in all directions."""
        return not self.forward.any()


def find_wheels(machine: Machine, joints: list[int], sideways: bool = False) -> Rolling:
    """Find how the wheels on some joints roll.

    Args:
        machine: The robot in its start pose.
        joints: Joints that actuators turn, below the base.
        sideways: Whether all wheels are omnidirectional even without rollers.

    Raises:
        RobotError: If they do not stand on the floor, or roll in several directions without rollers.
    """
    model, name = machine.model, machine.name
    places, rates, ways, radii = [], [], [], []
    for joint in joints:
        if model.jnt_type[joint] != HINGE:
            raise RobotError(f"{name}: the joint {model.joint(joint).name} is not a hinge, so no wheel")
        rollers = _rollers(machine, joint)
        contact, along = _contact(machine, joint, rollers)
        axis, anchor = machine.data.xaxis[joint], machine.data.xanchor[joint]
        own = float(along @ np.cross(axis, contact - anchor))
        if abs(own) < 1e-6:
            raise RobotError(f"{name}: the joint {model.joint(joint).name} turns, but rolls on nothing")
        place = machine.rotation.T @ (contact - machine.data.xpos[machine.base])
        way = machine.rotation.T @ along
        rates.append([-way[0] / own, -way[1] / own, -(way[1] * place[0] - way[0] * place[1]) / own])
        places.append(place[:2])
        radii.append(abs(own))
        if not rollers and not sideways:
            ways.append(way[:2] / np.linalg.norm(way[:2]))
    at, freedoms = np.array(places), [int(model.jnt_dofadr[joint]) for joint in joints]
    if not ways:
        if np.linalg.matrix_rank(np.array(rates), tol=1e-6) < 3:
            raise RobotError(f"{name}: its omnidirectional wheels cannot move it in all directions")
        return Rolling(freedoms, np.array(rates), np.zeros(2), at.mean(axis=0), 0.0, float(np.mean(radii)))
    forward = ways[0] * (1.0 if ways[0] @ [1.0, 0.5] >= 0.0 else -1.0)
    if len(ways) < len(joints) or any(abs(way @ forward) < ALIGNED for way in ways):
        raise RobotError(
            f"{name}: its wheels roll in several directions; wheels that turn about a vertical axis are not "
            "driven. Omnidirectional wheels without rollers: drive: {kind: omni}"
        )
    across = at @ [-forward[1], forward[0]]
    track = float(across.max() - across.min())
    if track < 1e-6:
        raise RobotError(f"{name}: its driven wheels are in one line, so it cannot be turned")
    axle = forward * (at @ forward).mean() + np.array([-forward[1], forward[0]]) * across.mean()
    return Rolling(freedoms, np.array(rates), forward, axle, track, float(np.mean(radii)))


def _rollers(machine: Machine, joint: int) -> list[int]:
    """Hinges on a wheel, of rollers."""
    model, wheel = machine.model, int(machine.model.jnt_bodyid[joint])
    found = []
    for other in range(model.njnt):
        body = int(model.jnt_bodyid[other])
        while body not in (0, wheel):
            body = int(model.body_parentid[body])
        if body == wheel and model.jnt_bodyid[other] != wheel and model.jnt_type[other] == HINGE:
            found.append(other)
    return found


def _contact(machine: Machine, joint: int, rollers: list[int]) -> tuple[Array, Array]:
    """Where a wheel stands, and the level direction in which the floor holds it, both in the world."""
    model, data = machine.model, machine.data
    axis, anchor = data.xaxis[joint], data.xanchor[joint]
    wheels = [int(model.jnt_bodyid[roller]) for roller in rollers] or [int(model.jnt_bodyid[joint])]
    lowest, place, body = np.inf, anchor, wheels[0]
    for geom in np.flatnonzero(np.isin(model.geom_bodyid, wheels)):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        points = geom_outline(machine, int(geom))
        bottom = float(points[:, 2].min())
        if bottom < lowest - 1e-9:
            near = points[points[:, 2] < bottom + 1e-4 * (1.0 + abs(bottom))]
            lowest, body, place = bottom, int(model.geom_bodyid[geom]), near.mean(axis=0)
    if not np.isfinite(lowest):
        raise RobotError(
            f"{machine.name}: the joint {model.joint(joint).name} turns nothing that has a shape"
        )
    if rollers:
        roller = next(each for each in rollers if model.jnt_bodyid[each] == body)
        place = np.array([*data.xanchor[roller][:2], lowest])
        along = data.xaxis[roller].copy()
    else:
        level = axis[:2] / max(np.linalg.norm(axis[:2]), 1e-9)
        place = np.array([*(anchor[:2] + level * ((place[:2] - anchor[:2]) @ level)), lowest])
        along = np.array([-axis[1], axis[0], 0.0])
    along[2] = 0.0
    size = float(np.linalg.norm(along))
    if size < 1e-6:
        name = model.joint(joint).name
        raise RobotError(f"{machine.name}: the joint {name} turns about a vertical axis, so is no wheel")
    return place, along / size
