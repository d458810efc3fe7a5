"""What all drives are made of: rows of actuators, attitude loops, and what is within reach."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.robots.attitude import Craft
from escort_mj.robots.drive import DEMANDS, RATE, DriveModel, Input
from escort_mj.world.model.robot.effects import (
    MOTOR,
    SMALL,
    Machine,
    control_range,
    kind_of,
)

Array = NDArray[np.float64]
Found = NDArray[np.int64]

GRAVITY = 9.81
MOST_TILT = 0.7  # rad
SATURATING_SHARE = (
    8.0  # tilt limit over the error for which the attitude loop asks for all the torque there is:
)
# at most 8 damping ratios^2, and a turn from one limit to the other overshoots by a few percent
MOST_FREQUENCY, DAMPING_RATIO = 25.0, 1.0  # of the attitude loop [rad/s]
LEAST_LIFT = 0.2  # of the weight
HEIGHT_FREQUENCY = 3.0  # rad/s
STIFF, MOST_STIFFENED = 50.0, 4.0  # bandwidth that servos are brought to [rad/s], by so much at most
FOLLOW_SHARE, MOST_FOLLOW_RATE, FOLLOW_SPEED = 0.1, 4.0, 0.4  # of bandwidth, 1/s, of the largest velocity
RANK = 1e-6
MOST_REACH = 1e12  # of an actuator with a range


def rows_of(
    machine: Machine, actuators: Found, mix: Array, effect: Array, trim: Array | None = None
) -> tuple[Input, ...]:
    """Rows of actuators.

    Args:
        machine: The robot.
        actuators: Which.
        mix: Controls for demands of 1, shape (actuators, up to 6).
        effect: Force on the point for actuator forces of 1, shape (up to 3, actuators).
        trim: Controls where nothing is demanded; None for 0.
    """
    rows = []
    for k, actuator in enumerate(actuators):
        kind = kind_of(machine.model, int(actuator))
        low, high = control_range(machine.model, int(actuator), kind)
        gain = float(machine.model.actuator_gainprm[actuator, 0]) if kind == MOTOR else 0.0
        mixed = [*mix[k], *np.zeros(DEMANDS - mix.shape[1])]
        made = [*effect[:, k], *np.zeros(3 - len(effect))]
        rows.append(Input(float(actuator), 0.0 if trim is None else trim[k], low, high, gain, *mixed, *made))
    return tuple(rows)


def actuator_gains(machine: Machine, actuators: Found) -> Array:
    """Force of actuators for a control of 1."""
    return np.asarray(machine.model.actuator_gainprm[actuators, 0])


def reach(inputs: tuple[Input, ...], demand: int) -> float:
    """Largest demand of one kind, either way, for which no actuator leaves its range."""
    found = np.inf
    for row in inputs:
        share = abs((row.mix_1, row.mix_2, row.mix_3, row.mix_4, row.mix_5, row.mix_6)[demand])
        if share > 1e-12:
            found = min(found, min(row.high - row.trim, row.trim - row.low) / share)
    return float(max(found, 0.0)) if found < MOST_REACH else math.inf


def mobility(machine: Machine, point: Array) -> tuple[float, ...]:
    """Mass that a force on a point moves, along each axis of the base [kg]."""
    straight = machine.jacobian(point)[:3]
    moved = straight @ np.linalg.solve(machine.mass_matrix, straight.T)
    return tuple(float(1.0 / each) if each > 1e-12 else math.inf for each in np.diag(moved))


def rank(rows: Array) -> int:
    """Rank of a matrix, measured by its largest row."""
    scale = np.linalg.norm(rows, axis=1).max(initial=0.0)
    return int(np.linalg.matrix_rank(rows / scale, tol=RANK)) if scale > SMALL else 0


def craft_of(machine: Machine, torques: list[float], frequency: float | None, tilt: float) -> Craft:
    """The attitude loop of a robot: as fast as its torques let it be, and damped."""
    inertia = np.diag(machine.inertia)
    weight = machine.mass * GRAVITY
    fastest = [
        min(MOST_FREQUENCY, math.sqrt(torque / moment / tilt * SATURATING_SHARE))
        for torque, moment in zip(torques, inertia, strict=True)
    ]
    if frequency is not None:
        fastest = [frequency] * 3
    gains = [each**2 for each in fastest] + [2.0 * DAMPING_RATIO * each for each in fastest]
    height = [machine.mass * HEIGHT_FREQUENCY**2, 2.0 * machine.mass * HEIGHT_FREQUENCY]
    limits = [LEAST_LIFT * weight, math.tan(tilt), 0.0]
    return Craft._make([*gains, *map(float, inertia), 0.0, 0.0, *limits, 0.0, *height])


def servo_of(machine: Machine, servos: Found) -> tuple[Array, Array]:
    """Control of velocity servos for a rate of 1, and their force for an error of 1."""
    gain, bias = actuator_gains(machine, servos), machine.model.actuator_biasprm[servos]
    integrates = machine.model.actuator_dyntype[servos] == mujoco.mjtDyn.mjDYN_INTEGRATOR
    return np.where(integrates, 1.0, -bias[:, 2] / gain), np.where(integrates, np.inf, -bias[:, 2])


def at_rate(
    found: str, point: tuple[float, ...], inputs: tuple[Input, ...], in_world: bool, bandwidth: float,
    mass: tuple[float, ...], craft: Craft | None = None,
) -> DriveModel:  # fmt: skip
    """A drive that is given velocities."""
    limits = (reach(inputs, 0), reach(inputs, 1), math.inf)
    stiffen = min(max(STIFF / bandwidth - 1.0, 0.0), MOST_STIFFENED)
    follow = min(MOST_FOLLOW_RATE, FOLLOW_SHARE * bandwidth * (1.0 + stiffen))
    most = min(FOLLOW_SPEED * min(limits), 1e300)
    return DriveModel(
        RATE, found, point, inputs, "", in_world, craft is not None, False, False, craft, follow, stiffen,
        most, limits, bandwidth, mass,
    )  # fmt: skip
