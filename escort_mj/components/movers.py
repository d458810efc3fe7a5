"""Bodies that move by themselves: obstacles and a target with mass, driven along their trajectories.

MuJoCo gives bodies that are merely put where they should be no velocity: they would not push. These have
mass and slide along the axes, and a force drives each of them so that its velocity at the end of the step is

    v = v_d + gain (x_d - x)

as far as the force's limit allows and nothing else pushes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.native.kernels import inlined, merged
from escort_mj.native.lanes import Lanes, everywhere, lane_numbers, least, pick
from escort_mj.native.on_demand import on_demand
from escort_mj.numerics.program import evaluate as evaluate_program

if TYPE_CHECKING:
    from escort_mj.components.plan import Plan, State

Array = NDArray[np.float64]

MASS, FORCE_LIMIT, GAIN, OBSTACLE = range(4)  # columns of a drive in the plan
TARGET = -1.0  # in the place of an obstacle


@merged
def obstacles_seen(robot: int, plan: Plan, state: State) -> Array:
    """Where a robot finds each obstacle: its center, or if it is no sphere its nearest point, shape (m, p).

    Distances to obstacles are those to these points less `plan.obstacle_radius`, which is 0 for all that are
    no spheres.

    Args:
        robot: From 0; the number of robots for the target.
        plan: Gives the obstacles.
        state: Gives where they are.
    """
    m = plan.obstacle_radius.shape[0]
    if plan.shaped:
        return state.obstacle_point[robot * m : (robot + 1) * m]
    return state.obstacle_position


@inlined
def obstacle_places(i: int, j: int, k: int, plan: Plan, state: State) -> Lanes:
    """Where robots i to i + 7 find obstacle j on axis k [m]; as `obstacles_seen`."""
    m, p = state.obstacle_position.shape
    if plan.shaped:
        robots = least(lane_numbers() + float(i), float(state.q.shape[0] - 1))
        seen: Lanes = pick(state.obstacle_point, robots * float(m * p) + float(j * p + k))
        return seen
    return everywhere(state.obstacle_position[j, k])


@on_demand
def drive(plan: Plan, state: State) -> None:
    """Finds where moving bodies are and what force drives them.

    Args:
        plan: Gives their drives and trajectories.
        state: Gives `time`, `mover_position` and `mover_velocity`; `mover_force` is written, and so is
            what follows from them: `obstacle_position`, or the target's position and velocity.
    """
    p, time = state.q.shape[1], state.time[0]
    for b in range(plan.drives.shape[0]):
        row = plan.drives[b]
        square = 0.0
        for k in range(p):
            first, count = int(plan.paths[b * p + k, 0]), int(plan.paths[b * p + k, 1])
            wanted, _ = evaluate_program(plan.code, first, count, plan.pieces, time, state.stack)
            _, speed = evaluate_program(
                plan.code, first, count, plan.pieces, time + plan.timestep, state.stack
            )
            lag = wanted - state.mover_position[b, k]
            change = speed + row[GAIN] * lag - state.mover_velocity[b, k]
            state.mover_force[b, k] = row[MASS] * change / plan.timestep
            square += state.mover_force[b, k] * state.mover_force[b, k]
        if square > row[FORCE_LIMIT] * row[FORCE_LIMIT]:
            share = row[FORCE_LIMIT] / math.sqrt(square)
            for k in range(p):
                state.mover_force[b, k] *= share
        for k in range(p):
            if row[OBSTACLE] == TARGET:
                state.target_position[k] = state.mover_position[b, k]
                state.target_velocity[k] = state.mover_velocity[b, k]
            else:
                state.obstacle_position[int(row[OBSTACLE]), k] = state.mover_position[b, k]
