"""Robots with drives of their own: where the point is that the law controls, and what their actuators do.

Whatever joints lead to a robot's base, its place and motion are read where MuJoCo has worked them out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.failures.failure import HOLD, OFF
from escort_mj.native.kernels import (
    DOUBLE,
    double_at,
    flat,
    inlined,
    matrix_at,
    pointer_at,
    stack_memory,
    vector_at,
)
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State
from escort_mj.robots.addresses import Addresses
from escort_mj.robots.attitude import axes_for, axes_toward, hold_height, turn_craft, within_reach
from escort_mj.robots.drive import (
    BODY,
    COUNT,
    DEMANDS,
    EFFECT,
    FIRST,
    FOLLOW,
    FORCE,
    GAIN,
    HIGH,
    HOLDS_ATTITUDE,
    HOLDS_HEIGHT,
    IN_WORLD,
    INDEX,
    LOW,
    MODE,
    MOST_FOLLOW,
    POINT,
    POSITION,
    RATE,
    ROOT,
    START,
    STIFFEN,
    THRUST,
    controls_for,
    past_dead_zone,
    thrust_within,
)
from escort_mj.world.loop.layout import offset

Array = NDArray[np.float64]

DATA_PLACE, DATA_TURN = offset("mjData", "xpos"), offset("mjData", "xmat")
DATA_MOTION, DATA_CENTER = offset("mjData", "cvel"), offset("mjData", "subtree_com")
DATA_MASS_CENTER, DATA_PUSHED = offset("mjData", "xipos"), offset("mjData", "xfrc_applied")
DATA_ACTUATOR_FORCE = offset("mjData", "actuator_force")


@inlined
def axes_of_base(d: int, body: int, axes: Array) -> None:
    """The axes of a body in the world, a row each, shape (3, 3): MuJoCo has them as columns."""
    turned = vector_at(pointer_at(d + DATA_TURN()) + DOUBLE * 9 * body, 9)
    for a in range(3):
        for c in range(3):
            axes[a, c] = turned[3 * c + a]


@inlined
def point_of(d: int, drive: Array, axes: Array, point: Array, velocity: Array) -> None:
    """Where the point of a robot is that the law controls, and how it moves.

    Args:
        d: Address of MuJoCo's data.
        drive: A row of `Drive`.
        axes: Of the base, see `axes_of_base`.
        point: Result, world frame, shape (3,) [m].
        velocity: Result, world frame, shape (3,) [m/s].
    """
    body, root = int(drive[BODY]), int(drive[ROOT])
    place = vector_at(pointer_at(d + DATA_PLACE()) + DOUBLE * 3 * body, 3)
    motion = vector_at(pointer_at(d + DATA_MOTION()) + DOUBLE * 6 * body, 6)
    center = vector_at(pointer_at(d + DATA_CENTER()) + DOUBLE * 3 * root, 3)
    for c in range(3):
        point[c] = place[c]
        for a in range(3):
            point[c] += axes[a, c] * drive[POINT + a]
    for c in range(3):
        a, b = (c + 1) % 3, (c + 2) % 3
        velocity[c] = motion[3 + c] + motion[a] * (point[b] - center[b]) - motion[b] * (point[a] - center[a])


@on_demand
def read_points(d: int, state: State, addresses: Addresses) -> None:
    """Positions and velocities of all robots with drives of their own."""
    n, p = state.q.shape
    scratch = matrix_at(stack_memory(), 5, 3)
    axes, point, velocity = scratch[:3], scratch[3], scratch[4]
    for i in range(n):
        if addresses.drive[i] >= 0.0:
            drive = addresses.drives[int(addresses.drive[i])]
            axes_of_base(d, int(drive[BODY]), axes)
            point_of(d, drive, axes, point, velocity)
            for k in range(p):
                state.q[i, k], state.v[i, k] = point[k], velocity[k]


@on_demand
def read_headings(d: int, state: State, addresses: Addresses) -> None:
    """Which way robots look."""
    n, p = state.q.shape
    for i in range(n):
        turned = vector_at(pointer_at(d + DATA_TURN()) + DOUBLE * 9 * int(addresses.base[i]), 9)
        for k in range(p):
            state.heading[i, k] = turned[3 * k]


@on_demand
def operate(
    i: int, d: int, controls: Array, do: float, plan: Plan, state: State, addresses: Addresses
) -> None:
    """Command the actuators of one robot, and push it where a disturbance does.

    Args:
        i: Which robot.
        d: Address of MuJoCo's data.
        controls: Of the robot; those of a servo that is off stay.
        do: OBEY, OFF or HOLD.
        plan: Gives force limits.
        state: Gives what the law demands; what the actuators can make of it becomes `drive_force`.
        addresses: What the drive is like.
    """
    drive, inputs = addresses.drives[int(addresses.drive[i])], addresses.inputs
    scratch = matrix_at(stack_memory(), 13, 3)
    axes, wanted, point, velocity = scratch[:3], scratch[3:6], scratch[6], scratch[7]
    force, torque, rate = scratch[8], scratch[9], scratch[10]
    demand = flat(scratch[11:13])
    axes_of_base(d, int(drive[BODY]), axes)
    point_of(d, drive, axes, point, velocity)
    _disturb(i, d, int(drive[BODY]), point, state)
    first, count, mode = int(drive[FIRST]), int(drive[COUNT]), drive[MODE]
    if do == OFF:
        if mode != POSITION:
            for j in range(first, first + count):
                controls[int(inputs[j, INDEX])] = min(max(0.0, inputs[j, LOW]), inputs[j, HIGH])
    elif do != HOLD or mode == FORCE:
        _want(i, drive, point, velocity, plan, state, addresses, force)
        motion = vector_at(pointer_at(d + DATA_MOTION()) + DOUBLE * 6 * int(drive[BODY]), 6)
        for k in range(3):
            rate[k] = axes[k, 0] * motion[0] + axes[k, 1] * motion[1] + axes[k, 2] * motion[2]
            demand[3 + k] = 0.0
        if mode == THRUST:
            craft = addresses.crafts[int(addresses.pilot[i])]
            within_reach(force, craft)
            if drive[HOLDS_ATTITUDE] > 0.0:
                axes_for(force, wanted)
            else:
                axes_toward(force, axes[0], wanted)
            turn_craft(wanted, axes, rate, craft, torque)
            demand[0] = 0.0
            for k in range(3):
                demand[0] += force[k] * axes[2, k]
                demand[1 + k] = torque[k]
            demand[0] = thrust_within(demand, inputs, first, count)
            controls_for(demand, 4, inputs, first, count, controls)
        else:
            for k in range(3):
                along = axes[k, 0] * force[0] + axes[k, 1] * force[1] + axes[k, 2] * force[2]
                demand[k] = force[k] if drive[IN_WORLD] > 0.0 else along
            if drive[HOLDS_ATTITUDE] > 0.0:
                for a in range(3):
                    for c in range(3):
                        wanted[a, c] = 1.0 if a == c else 0.0
                turn_craft(wanted, axes, rate, addresses.crafts[int(addresses.pilot[i])], torque)
                for k in range(3):
                    demand[3 + k] = torque[k]
            controls_for(demand, DEMANDS, inputs, first, count, controls)
        for j in range(first, first + count):
            if inputs[j, GAIN] > 0.0:
                place, zone = int(inputs[j, INDEX]), addresses.dead_zone[i] / inputs[j, GAIN]
                controls[place] = past_dead_zone(controls[place], zone)
    for k in range(3):
        force[k] = 0.0
        for j in range(first, first + count):
            force[k] += inputs[j, EFFECT + k] * inputs[j, GAIN] * controls[int(inputs[j, INDEX])]
    _in_mission(force, drive, axes, addresses.lift[i], state.drive_force[i])


@inlined
def _want(
    i: int, drive: Array, point: Array, velocity: Array, plan: Plan, state: State, addresses: Addresses,
    wanted: Array,
) -> None:  # fmt: skip
    """What is wanted of a robot: a force with the lift, a velocity or a way, world frame, shape (3,)."""
    p, mode = state.q.shape[1], drive[MODE]
    for k in range(3):
        wanted[k] = addresses.lift[i, k]
    if mode == RATE:
        for k in range(p):
            more = drive[FOLLOW] * state.e[i, k] + drive[STIFFEN] * state.e_dot[i, k]
            wanted[k] = state.v_d[i, k] + min(max(more, -drive[MOST_FOLLOW]), drive[MOST_FOLLOW])
    elif mode == POSITION:
        for k in range(p):
            wanted[k] = state.q_d[i, k] - drive[START + k]
    else:
        limit = plan.force_limit[i]
        for k in range(p):
            wanted[k] += min(max(state.command[i, k], -limit), limit)
        if p == 2 and drive[HOLDS_HEIGHT] > 0.0:
            wanted[2] += hold_height(addresses.crafts[int(addresses.pilot[i])], point[2], velocity[2])


@inlined
def _disturb(i: int, d: int, body: int, point: Array, state: State) -> None:
    """Put a disturbance on the point of a robot: MuJoCo takes force and torque at the center of mass."""
    p = state.q.shape[1]
    center = vector_at(pointer_at(d + DATA_MASS_CENTER()) + DOUBLE * 3 * body, 3)
    pushed = vector_at(pointer_at(d + DATA_PUSHED()) + DOUBLE * 6 * body, 6)
    for k in range(p):
        pushed[k] = state.disturbance[i, k]
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        pushed[3 + k] = (point[a] - center[a]) * pushed[b] - (point[b] - center[b]) * pushed[a]


@on_demand
def read_forces(d: int, state: State, addresses: Addresses) -> None:
    """Forces that the actuators of robots with drives of their own made in a solved step."""
    n = state.q.shape[0]
    scratch = matrix_at(stack_memory(), 4, 3)
    axes, force = scratch[:3], scratch[3]
    for i in range(n):
        if addresses.drive[i] < 0.0:
            continue
        drive, inputs = addresses.drives[int(addresses.drive[i])], addresses.inputs
        axes_of_base(d, int(drive[BODY]), axes)
        first = pointer_at(d + DATA_ACTUATOR_FORCE()) + DOUBLE * int(addresses.motor_address[i])
        for k in range(3):
            force[k] = 0.0
        for j in range(int(drive[FIRST]), int(drive[FIRST]) + int(drive[COUNT])):
            made = double_at(first + DOUBLE * int(inputs[j, INDEX]))
            for k in range(3):
                force[k] += inputs[j, EFFECT + k] * made
        _in_mission(force, drive, axes, addresses.lift[i], state.force[i])


@inlined
def _in_mission(force: Array, drive: Array, axes: Array, lift: Array, result: Array) -> None:
    """Turn a force into the mission's axes, without what holds the weight."""
    for k in range(result.shape[0]):
        if drive[IN_WORLD] > 0.0:
            result[k] = force[k] - lift[k]
        else:
            result[k] = axes[0, k] * force[0] + axes[1, k] * force[1] + axes[2, k] * force[2] - lift[k]
