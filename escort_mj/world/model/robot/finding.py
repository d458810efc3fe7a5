"""Which drive a compiled robot has, and its numbers: computed from what its actuators do."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RobotError
from escort_mj.robots.drive import DEMANDS, FORCE, POSITION, THRUST, DriveModel
from escort_mj.robots.modeled import DriveKeys
from escort_mj.world.model.robot.effects import (
    HINGE,
    MOTOR,
    POSITION_SERVO,
    SMALL,
    VELOCITY_SERVO,
    Machine,
    geom_outline,
    kind_of,
    solid_geoms,
)
from escort_mj.world.model.robot.rolling import rolled, steered
from escort_mj.world.model.robot.rows import (
    GRAVITY,
    MOST_TILT,
    actuator_gains,
    at_rate,
    craft_of,
    mobility,
    rank,
    reach,
    rows_of,
    servo_of,
)

Array = NDArray[np.float64]
Found = NDArray[np.int64]

TILT_TIME, LEAST_TILT = 0.5, 0.05  # s and rad
LEAST_TURN = 0.01  # angular acceleration about x and y of a robot that flies [rad/s^2]
SPARE = 1.05  # thrust over weight that flying takes


def find_drive(machine: Machine, keys: DriveKeys) -> DriveModel:
    """Return the drive of a robot in its start pose.

    Raises:
        RobotError: If it has none that moves it along all axes.
    """
    model, name = machine.model, machine.name
    kinds = [kind_of(model, actuator) for actuator in range(model.nu)]
    moments = machine.moments
    own = np.zeros(model.nv, dtype=bool)
    own[machine.base_freedoms] = True
    direct = np.flatnonzero(np.abs(moments[:, own]).max(axis=1, initial=0.0) > SMALL)
    motors = np.array([a for a in direct if kinds[a] == MOTOR], dtype=int)
    positions = np.array([a for a in direct if kinds[a] == POSITION_SERVO], dtype=int)
    rates = np.array([a for a in direct if kinds[a] == VELOCITY_SERVO], dtype=int)
    told = keys.kind
    if len(motors) and told in (None, "force", "thrust", "steer"):
        return _pushed(machine, keys, motors)
    if len(positions) and told in (None, "omni"):
        return _positioned(machine, positions)
    if len(rates) and told in (None, "omni", "velocity"):
        return _moved(machine, rates, told or "velocity")
    if told in ("force", "thrust", "steer", "velocity"):
        raise RobotError(f"{name}: found no actuator on its base for the drive {told}")
    below = _below(machine, moments, own)
    if not below:
        does = "turns what stands on the floor" if told else "moves its base"
        raise RobotError(f"{name}: none of its {model.nu} actuators {does}")
    return rolled(machine, keys, below, kinds)


def _below(machine: Machine, moments: Array, own: NDArray[np.bool_]) -> dict[int, Found]:
    """Joints of the robot that touch the floor and what turns them, by themselves or several at once."""
    model, turning = machine.model, machine.data.xaxis
    freedom = {
        joint: int(model.jnt_dofadr[joint])
        for joint in range(model.njnt)
        if not own[model.jnt_dofadr[joint]]
        and model.jnt_bodyid[joint] in machine.bodies
        and model.jnt_type[joint] == HINGE
        and abs(turning[joint, 2]) <= 0.5  # a wheel's axis is level
    }
    acts = np.abs(moments) > SMALL
    freedom = {joint: dof for joint, dof in freedom.items() if acts[:, dof].any()}
    freedom = {joint: dof for joint, dof in freedom.items() if _touches_lowest(machine, joint)}
    elsewhere = np.delete(acts, list(freedom.values()), axis=1).any(axis=1)
    found = {joint: np.flatnonzero(acts[:, dof] & ~elsewhere) for joint, dof in freedom.items()}
    return {joint: actuators for joint, actuators in found.items() if len(actuators)}


def _touches_lowest(machine: Machine, joint: int) -> bool:
    """Whether what a joint turns reaches as low as the robot does, within a tenth of its height."""
    heights = {geom: geom_outline(machine, geom)[:, 2] for geom in solid_geoms(machine)}
    low = min(float(each.min()) for each in heights.values())
    high = max(float(each.max()) for each in heights.values())
    reach = np.inf
    for geom, each in heights.items():
        body = int(machine.model.geom_bodyid[geom])
        while body not in (0, int(machine.model.jnt_bodyid[joint])):
            body = int(machine.model.body_parentid[body])
        if body:
            reach = min(reach, float(each.min()))
    return reach - low < 0.1 * (high - low) + 1e-6


def _pushed(machine: Machine, keys: DriveKeys, motors: Found) -> DriveModel:
    """Motors that act on the base itself."""
    point = machine.center
    wrench = machine.on_base(point)[0][:, motors] * actuator_gains(machine, motors)
    flies, full = machine.rises, rank(wrench[:3]) == 3
    if keys.kind == "thrust" or (keys.kind is None and flies and not full and rank(wrench[2:5]) == 3):
        return _thrust(machine, keys, motors, point, wrench)
    if keys.kind != "steer" and (full or rank(wrench[:2]) == 2):
        return _force(machine, motors, point, wrench, flies and full)
    if rank(wrench[[0, 5]]) == 2 and (not flies or keys.kind == "steer"):
        return steered(machine, keys, motors, point, wrench)
    pushed = [axis for axis, row in zip("xyz", wrench[:3], strict=True) if np.abs(row).max() > SMALL]
    along = " and ".join(pushed) or "no axis"
    raise RobotError(
        f"{machine.name}: its {len(motors)} motors push the base along {along} and cannot turn it to where "
        "the law wants a force; it cannot be pushed along all axes"
    )


def _force(machine: Machine, motors: Found, point: Array, wrench: Array, flies: bool) -> DriveModel:
    """Motors that push along all axes."""
    in_world = machine.frame_of(point, motors)
    gains = actuator_gains(machine, motors)
    rows = [0, 1, 2] if flies else [0, 1]
    turning = [k for k in (3, 4, 5) if np.abs(wrench[k]).max() > SMALL]
    holds = rank(wrench[[*rows, *turning]]) == len(rows) + len(turning) and bool(turning)
    kept = [*rows, *turning] if holds else rows
    made = wrench.copy()
    if in_world:
        made[:3] = machine.rotation @ wrench[:3]
    mix = np.zeros((len(motors), DEMANDS))
    mix[:, kept] = np.linalg.pinv(made[kept])
    inputs = rows_of(machine, motors, mix, made[:3] / gains)
    craft = None
    if holds:
        torques = [reach(inputs, k) if k in turning else 0.0 for k in (3, 4, 5)]
        craft = craft_of(machine, torques, None, MOST_TILT)
    limits = tuple(reach(inputs, k) if k in rows else math.inf for k in range(3))
    return DriveModel(
        FORCE, "force", tuple(point), inputs, "", in_world, holds, flies and craft is not None, flies, craft,
        limits=limits, effective_mass=mobility(machine, point),
    )  # fmt: skip


def _thrust(machine: Machine, keys: DriveKeys, motors: Found, point: Array, wrench: Array) -> DriveModel:
    """Rotors, or a thrust with moments."""
    if machine.frame_of(point, motors):
        raise RobotError(
            f"{machine.name}: its rotors push along the world's axes; a thrust turns with the base"
        )
    axis = machine.rotation[:, 2]
    if axis[2] < 0.5:
        raise RobotError(
            f"{machine.name}: the z axis of its base points along {axis.round(2)}; it flies with z up"
        )
    turning = [k for k in (3, 4, 5) if np.abs(wrench[k]).max() > SMALL]
    kept = [2, *turning]
    if rank(wrench[kept]) < len(kept):  # as where yaw only comes with roll: the heading is let go
        kept, turning = [2, 3, 4], [3, 4]
    if rank(wrench[kept]) < 3:
        raise RobotError(f"{machine.name}: its rotors cannot thrust and turn it about x and y at once")
    mix = np.zeros((len(motors), 4))
    mix[:, [0, *(k - 2 for k in turning)]] = np.linalg.pinv(wrench[kept])
    inputs = rows_of(machine, motors, mix, wrench[:3] / actuator_gains(machine, motors))
    weight, lifting = machine.mass * GRAVITY, [row for row in inputs if abs(row.mix_1) > 1e-12]
    ends = np.array([sorted((row.low / row.mix_1, row.high / row.mix_1)) for row in lifting])
    most = float(ends[:, 1].min())
    if most < SPARE * weight:
        raise RobotError(
            f"{machine.name}: its thrust of {most:.3g} N cannot hold its weight of {weight:.3g} N; expected "
            f"at least {SPARE:g} times as much"
        )
    hover = tuple(row._replace(trim=row.mix_1 * weight) for row in inputs)
    torques = [reach(hover, k) for k in (1, 2, 3)]
    torques = [torque if k in turning else 0.0 for k, torque in zip((3, 4, 5), torques, strict=True)]
    slowest = float(min(torques[:2] / np.diag(machine.inertia)[:2]))
    if slowest < LEAST_TURN:
        raise RobotError(
            f"{machine.name}: its rotors turn it about x or y with at most {slowest:.3g} rad/s^2; expected "
            f"{LEAST_TURN:g} rad/s^2 or more, to keep it upright"
        )
    tilt = keys.tilt_limit or min(MOST_TILT, max(LEAST_TILT, 0.25 * slowest * TILT_TIME**2))
    craft = craft_of(machine, torques, keys.attitude_frequency, tilt)
    across = weight * math.tan(tilt)
    across = min(across, math.sqrt(max(most**2 - weight**2, 0.0)))
    return DriveModel(
        THRUST, "thrust", tuple(point), inputs, "", False, 5 in turning, True, True, craft,
        limits=(across, across, most - weight), effective_mass=(machine.mass,) * 3,
        bandwidth=math.sqrt(min(craft.stiffness_x, craft.stiffness_y)),
    )  # fmt: skip


def _positioned(machine: Machine, servos: Found) -> DriveModel:
    """Position servos on the base: they are given the reference position, in their own coordinates."""
    point = machine.center
    in_world = machine.frame_of(point, servos)
    force, rates = (each for each in machine.on_base(point))
    force, rates = force[:, servos], rates[servos]
    if in_world:
        force, rates = machine.rotation @ force[:3], rates[:, :3] @ machine.rotation.T
    elif (
        machine.turned() is not machine and np.abs(machine.turned().rotation - machine.rotation).max() > 1e-9
    ):
        raise RobotError(
            f"{machine.name}: its position servos turn with its base; expected them along fixed axes"
        )
    axes = 3 if machine.rises else 2
    if rank(rates[:, :axes].T) < axes:
        raise RobotError(f"{machine.name}: its position servos cannot move it along all axes")
    gain, bias = actuator_gains(machine, servos), machine.model.actuator_biasprm[servos]
    ratio = -bias[:, 1] / gain
    trim = ratio * machine.data.actuator_length[servos]
    mix = ratio[:, None] * rates[:, :3]
    stiff, damped = -bias[:, 1], -bias[:, 2] + _joint_damping(machine, servos)
    mass = mobility(machine, point)
    stiffness = float(np.min(np.diag(rates[:, :axes].T @ (stiff[:, None] * rates[:, :axes]))))
    damping = float(np.max(np.diag(rates[:, :axes].T @ (damped[:, None] * rates[:, :axes]))))
    natural = math.sqrt(stiffness / mass[0])
    bandwidth = min(natural, stiffness / damping) if damping > 0.0 else natural
    return DriveModel(
        POSITION, "omni", tuple(point), rows_of(machine, servos, mix, force[:3], trim), in_world=True,
        bandwidth=bandwidth, effective_mass=mass,
    )  # fmt: skip


def _joint_damping(machine: Machine, actuators: Found) -> Array:
    """Damping of the joints that actuators move, as damping of their transmissions."""
    moments = machine.moments[actuators]
    size = np.maximum((moments**2).sum(axis=1), SMALL)
    return np.asarray((moments**2 @ machine.model.dof_damping) / size**2)


def _moved(machine: Machine, servos: Found, found: str) -> DriveModel:
    """Velocity servos on the base."""
    point = machine.center
    in_world = machine.frame_of(point, servos)
    force, rates = machine.on_base(point)
    force, rates = force[:, servos], rates[servos]
    axes = 3 if machine.rises else 2
    if rank(rates[:, :axes].T) < axes:
        raise RobotError(f"{machine.name}: its velocity servos cannot move it along all axes")
    if in_world:
        force, rates = machine.rotation @ force[:3], rates[:, :3] @ machine.rotation.T
    ratio, damping = servo_of(machine, servos)
    mix = np.zeros((len(servos), DEMANDS))
    mix[:, :3] = ratio[:, None] * rates[:, :3]
    mass = mobility(machine, point)
    bandwidth = float(min(np.diag(rates[:, :axes].T @ (damping[:, None] * rates[:, :axes])) / mass[:axes]))
    return at_rate(found, tuple(point), rows_of(machine, servos, mix, force[:3]), in_world, bandwidth, mass)
