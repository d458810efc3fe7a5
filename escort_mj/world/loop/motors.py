"""Commands of motors, robot by robot: the law's force, or what a kind that flies makes of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.failure import has_failed
from escort_mj.failures.failure import HOLD, OBEY, OFF
from escort_mj.native.kernels import DOUBLE, vector_at
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State
from escort_mj.robots.addresses import Addresses
from escort_mj.robots.attitude import ROTORS
from escort_mj.robots.drive import past_dead_zone
from escort_mj.robots.quadrotor import pilot, push
from escort_mj.world.loop.drives import operate

Array = NDArray[np.float64]

MOST_CONTROLS = 1000  # of one robot


@on_demand
def command_motors(
    d: int,
    controls: int,
    activations: int,
    qpos: Array,
    qvel: Array,
    plan: Plan,
    state: State,
    addresses: Addresses,
) -> None:
    """Tells all motors what the law's commands mean for them.

    Args:
        d: Address of MuJoCo's data.
        controls: Address of its controls.
        activations: Address of what its motors that lag have come to.
        qpos: Its generalized positions.
        qvel: Its generalized velocities.
        plan: Gives force limits and failures.
        state: Gives the commands.
        addresses: Where motors are, and what they are like.
    """
    n, p = state.q.shape
    for i in range(n):
        first = controls + DOUBLE * int(addresses.motor_address[i])
        zone = addresses.dead_zone[i]
        if state.drive_force.shape[0] > 0:
            limit = plan.force_limit[i]
            for k in range(p):
                state.drive_force[i, k] = min(max(state.command[i, k], -limit), limit)
        driven = addresses.drive[i] >= 0.0
        if addresses.pilot[i] < 0.0 and not driven:
            motors = vector_at(first, p)
            for k in range(p):
                motors[k] = past_dead_zone(state.command[i, k], zone)
            continue
        do = OBEY
        if plan.failure.shape[0] > 0 and has_failed(i, plan, state):
            do = plan.failure_motors[i]
        if driven:
            operate(i, d, vector_at(first, MOST_CONTROLS), do, plan, state, addresses)
            continue
        rotors = vector_at(first, ROTORS)
        if do != HOLD:
            pilot(i, qpos, qvel, plan, state, addresses, rotors)
            for rotor in range(ROTORS):
                rotors[rotor] = 0.0 if do == OFF else past_dead_zone(rotors[rotor], zone)
        push(i, first, activations, qpos, addresses)
