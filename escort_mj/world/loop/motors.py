"""What motors are told, robot by robot: the law's force, or the thrusts that an attitude loop makes of it.

A rotor's motor only turns a quadrotor; what the rotors push together is told to three more, along the world's
axes (see `models/quadrotor.xml`), as MuJoCo is about to find it: behind gains, lags and limits.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.plan import Plan, State
from escort_mj.control.attitude import ROTOR_LIMIT, axes_of_body, fly, hold_height
from escort_mj.control.failure import DEAD, KIND, START, STUCK
from escort_mj.native.kernels import DOUBLE, inlined, matrix_at, merged, stack_memory, vector_at
from escort_mj.native.on_demand import on_demand
from escort_mj.scenario.schema.kinds import ROTORS
from escort_mj.world.loop.wiring import Wiring

Array = NDArray[np.float64]

WORKING = -1.0  # beside the kinds of failures


@inlined
def past_dead_zone(command: float, zone: float) -> float:
    """What is left of a command behind a motor's dead zone [N]."""
    return command - min(max(command, -zone), zone)


@on_demand
def command_motors(
    controls: int, activations: int, qpos: Array, qvel: Array, plan: Plan, state: State, wiring: Wiring
) -> None:
    """Tells all motors what the law's commands mean for them.

    Args:
        controls: Address of MuJoCo's controls.
        activations: Address of what its motors that lag have come to.
        qpos: Its generalized positions.
        qvel: Its generalized velocities.
        plan: Gives force limits and failures.
        state: Gives the commands.
        wiring: Where motors are, and what they are like.
    """
    n, p = state.q.shape
    for i in range(n):
        first = controls + DOUBLE * int(wiring.motor_address[i])
        zone = wiring.dead_zone[i]
        if wiring.pilot[i] < 0.0:
            motors = vector_at(first, p)
            for k in range(p):
                motors[k] = past_dead_zone(state.command[i, k], zone)
            continue
        rotors = vector_at(first, ROTORS)
        failure = WORKING
        if plan.failures.shape[0] > 0 and state.time[0] + 0.5 * plan.timestep >= plan.failures[i, START]:
            failure = plan.failures[i, KIND]
        if failure != STUCK:
            _pilot(i, qpos, qvel, plan, state, wiring, rotors)
            for rotor in range(ROTORS):
                rotors[rotor] = 0.0 if failure == DEAD else past_dead_zone(rotors[rotor], zone)
        _push(i, first, activations, qpos, wiring)


@on_demand
def _pilot(i: int, qpos: Array, qvel: Array, plan: Plan, state: State, wiring: Wiring, rotors: Array) -> None:
    """Thrusts of one quadrotor for the force that the law wants, within its limit, and the lift."""
    p = state.q.shape[1]
    craft = wiring.crafts[int(wiring.pilot[i])]
    place, dof = int(wiring.qpos_address[i]), int(wiring.dof_address[i])
    force = vector_at(stack_memory(), 3)
    limit = plan.force_limit[i]
    for k in range(3):
        force[k] = wiring.lift[i, k]
    for k in range(p):
        force[k] += min(max(state.command[i, k], -limit), limit)
    if p == 2:
        force[2] += hold_height(craft, qpos[place + 2], qvel[dof + 2])
    fly(force, qpos[place + 3 : place + 7], qvel[dof + 3 : dof + 6], craft, rotors)


@merged
def _push(i: int, rotors: int, activations: int, qpos: Array, wiring: Wiring) -> None:
    """Tells the thrust of all rotors of one quadrotor, along its z axis, to the motors that push it.

    Args:
        i: Which robot.
        rotors: Address of its controls: four rotors, then the thrust along the world's axes.
        activations: As `command_motors` has it.
        qpos: MuJoCo's generalized positions.
        wiring: As `command_motors` has it.
    """
    flyer = int(wiring.pilot[i])
    turning = rotors
    if wiring.rotor_state[flyer] >= 0.0:
        turning = activations + DOUBLE * int(wiring.rotor_state[flyer])
    pushes, thrust = vector_at(turning, ROTORS), 0.0
    for rotor in range(ROTORS):
        push = wiring.rotor_gain[flyer, rotor] * pushes[rotor]
        thrust += min(max(push, 0.0), wiring.crafts[flyer, ROTOR_LIMIT])
    axes = matrix_at(stack_memory(), 3, 3)
    place = int(wiring.qpos_address[i])
    axes_of_body(qpos[place + 3 : place + 7], axes)
    motors = vector_at(rotors + DOUBLE * ROTORS, 3)
    for k in range(3):
        motors[k] = thrust * axes[2, k]
