"""Drives of robots that cannot be pushed sideways: the law acts at a point ahead of the axle."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RobotError
from escort_mj.robots.attitude import Craft
from escort_mj.robots.drive import DEMANDS, FORCE, DriveModel
from escort_mj.robots.modeled import DriveKeys
from escort_mj.world.model.robot.effects import (
    MOTOR,
    VELOCITY_SERVO,
    Machine,
)
from escort_mj.world.model.robot.rows import (
    MOST_TILT,
    actuator_gains,
    at_rate,
    craft_of,
    reach,
    rows_of,
    servo_of,
)
from escort_mj.world.model.robot.wheels import Rolling, find_wheels

Array = NDArray[np.float64]
Found = NDArray[np.int64]

HEADING_RATE = 2.0  # 1/s, at which omnidirectional robots come back to their heading


def steered(machine: Machine, keys: DriveKeys, motors: Found, point: Array, wrench: Array) -> DriveModel:
    """Motors that push along x and turn: the law acts at a point ahead of the center of mass."""
    ahead = keys.point or math.sqrt(float(machine.inertia[2, 2]) / machine.mass)
    hand = point + [ahead, 0.0, 0.0]
    made = np.array([wrench[0], wrench[5] / ahead])
    mix = np.linalg.pinv(made)
    inputs = rows_of(machine, motors, mix, made / actuator_gains(machine, motors))
    mass = machine.mass_matrix
    way = np.zeros((machine.model.nv, 2))
    inverse = np.linalg.pinv(machine.jacobian(point)[:, machine.base_freedoms], rcond=1e-9)
    way[machine.base_freedoms] = inverse[:, [0, 5]] / [1.0, ahead]
    moved = np.diag(way.T @ mass @ way)
    limits = (reach(inputs, 0), reach(inputs, 1), math.inf)
    return DriveModel(
        FORCE, "steer", tuple(hand), inputs, limits=limits, effective_mass=(*map(float, moved), math.inf)
    )


def rolled(machine: Machine, keys: DriveKeys, below: dict[int, Found], kinds: list[str]) -> DriveModel:
    """Wheels, by their torques or their rates."""
    name, joints = machine.name, list(below)
    used = np.unique(np.concatenate(list(below.values())))
    types = {kinds[actuator] for actuator in used}
    if types - {MOTOR, VELOCITY_SERVO} or len(types) > 1:
        what = " and ".join(sorted(types))
        raise RobotError(f"{name}: its wheels are turned by {what}s; expected motors, or velocity servos")
    wheels = find_wheels(machine, joints, sideways=keys.kind == "omni")
    if keys.kind == "omni" and not wheels.is_omni:
        raise RobotError(f"{name}: its wheels are not omnidirectional; found wheels that roll one way")
    transmissions = machine.moments[used][:, wheels.joints]
    if wheels.is_omni:
        point, rates = np.array([*wheels.axle, 0.0]), wheels.rates @ _at(wheels.axle)
    else:
        ahead = keys.point or 0.5 * wheels.track
        across = np.array([-wheels.forward[1], wheels.forward[0]])
        point = np.array([*(wheels.axle + ahead * wheels.forward), 0.0])
        turning = np.vstack([np.outer(wheels.forward, wheels.forward), across / ahead])
        rates = wheels.rates @ _at(wheels.axle) @ turning
    point[2] = machine.center[2]
    per_rate = transmissions @ rates  # of each transmission, for a velocity (and turning) of 1
    masses = _rolled_mass(machine, wheels, rates, point)
    if types == {MOTOR}:
        made = per_rate.T * actuator_gains(machine, used)
        mix, craft = np.zeros((len(used), DEMANDS)), None
        mix[:, [0, 1, 5][: made.shape[0]]] = np.linalg.pinv(made)
        inputs = rows_of(machine, used, mix, per_rate.T[:2])
        if wheels.is_omni:
            craft = craft_of(machine, [0.0, 0.0, reach(inputs, 5)], None, MOST_TILT)
        limits = (reach(inputs, 0), reach(inputs, 1), math.inf)
        return DriveModel(
            FORCE, "omni" if wheels.is_omni else "wheels", tuple(point), inputs, "", False, craft is not None,
            False, False, craft, limits=limits, effective_mass=masses,
        )  # fmt: skip
    ratio, damping = servo_of(machine, used)
    mix, craft = np.zeros((len(used), DEMANDS)), None
    mix[:, [0, 1, 5][: per_rate.shape[1]]] = ratio[:, None] * per_rate
    resisting = np.diag(per_rate.T @ (np.minimum(damping, 1e12)[:, None] * per_rate))[:2]
    bandwidth = float(min(resisting / masses[:2]))
    if wheels.is_omni:  # what turns it back is a rate: a body of moments 1 without damping
        level = [0.0, 0.0, HEADING_RATE, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
        craft = Craft._make([*level, *np.zeros(len(Craft._fields) - len(level))])
    inputs = rows_of(machine, used, mix, per_rate.T[:2])
    return at_rate(
        "omni" if wheels.is_omni else "wheels", tuple(point), inputs, False, bandwidth, masses, craft
    )


def _at(place: Array) -> Array:
    """From the motion of a place in the base's plane to that of its origin, shape (3, 3)."""
    return np.array([[1.0, 0.0, place[1]], [0.0, 1.0, -place[0]], [0.0, 0.0, 1.0]])


def _rolled_mass(machine: Machine, wheels: Rolling, rates: Array, point: Array) -> tuple[float, ...]:
    """Mass that a rolling robot has for its controlled point, wheels included [kg]."""
    way = np.zeros((machine.model.nv, rates.shape[1]))
    inverse = np.linalg.pinv(machine.jacobian(np.zeros(3))[:, machine.base_freedoms], rcond=1e-9)
    own = np.linalg.lstsq(wheels.rates, rates, rcond=None)[0]  # motion of the origin
    way[machine.base_freedoms] = inverse[:, [0, 1, 5]] @ own
    way[wheels.joints] = rates
    return (*map(float, np.diag(way.T @ machine.mass_matrix @ way)[:2]), math.inf)
