"""What the law is given: the truth through the sensors (docs/sensing.md).

In this order: the truth, `delay` steps old (the start's, before so many steps); plus the bias; plus noise
from a ball (section 5), which belongs to the present step; rounded to the resolution. With the probability
of `dropout` nothing of it arrives, and the last value stays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.noise import AT_ONCE, OF_ROBOT, OF_TARGET, chance, draw_points, first_coordinates
from escort_mj.control.plan import EVALUATED, STEP, Plan, State
from escort_mj.control.sensing import BIAS, DELAY, DROPOUT, NOISE, PAST, RESOLUTION
from escort_mj.kernels import DOUBLE, inlined, matrix_at, stack_memory
from escort_mj.lanes import copy_lanes
from escort_mj.on_demand import on_demand

Array = NDArray[np.float64]

AHEAD = 4  # bodies whose streams are begun together: the processor works on all at once


@on_demand
def measure(plan: Plan, state: State) -> None:
    """Measures all robots, and the target once for the team.

    Args:
        plan: Gives the sensors.
        state: Gives time and truth; the measured positions and velocities are written, and the past.
    """
    n, p = state.q.shape
    if plan.perfect:
        copy_lanes(state.q, state.q_measured, n * p)
        copy_lanes(state.v, state.v_measured, n * p)
        for k in range(p):
            state.target_position_measured[k] = state.target_position[k]
            state.target_velocity_measured[k] = state.target_velocity[k]
        return
    step = int(state.clock[STEP])
    evaluated = int(state.clock[EVALUATED])
    memory = stack_memory()
    points, coordinates = matrix_at(memory, 2, p), matrix_at(memory + DOUBLE * 2 * p, AHEAD, AT_ONCE)
    for body in range(n + 1):
        if body % AHEAD == 0:
            _begin_streams(body, n, step, plan, coordinates)
        of_robot = body < n
        index, use, bodies = (body, OF_ROBOT, n) if of_robot else (0, OF_TARGET, 1)
        first = 0 if of_robot else 2  # channel of the position; that of the velocity follows
        draw_points(
            points, plan.sensors[first, NOISE], plan.sensors[first + 1, NOISE], plan.seed, use, index, step,
            coordinates[body % AHEAD],
        )  # fmt: skip
        for rate in range(2):
            if of_robot:
                truth = state.q[index] if rate == 0 else state.v[index]
                measured = state.q_measured[index] if rate == 0 else state.v_measured[index]
            else:
                truth = state.target_position if rate == 0 else state.target_velocity
                measured = state.target_position_measured if rate == 0 else state.target_velocity_measured
            sensor = plan.sensors[first + rate]
            seen = truth
            if sensor[DELAY] > 0.0:
                seen = state.past[_remember(truth, sensor, state.past, evaluated, bodies, index)]
            # The start always arrives. Evaluated again, a step drops the same again.
            if sensor[DROPOUT] > 0.0 and evaluated > 0:
                if chance(plan.seed, use, index, step, rate) < sensor[DROPOUT]:
                    continue
            for k in range(p):
                value = seen[k]
                if sensor[BIAS] >= 0.0:
                    value += plan.bias[int(sensor[BIAS]) + index, k]
                if sensor[NOISE] > 0.0:
                    value += sensor[NOISE] * points[rate, k]
                if sensor[RESOLUTION] > 0.0:
                    value = np.rint(value / sensor[RESOLUTION]) * sensor[RESOLUTION]
                measured[k] = value


@inlined
def _begin_streams(first: int, n: int, step: int, plan: Plan, coordinates: Array) -> None:
    """The first coordinates of the noise of several bodies."""
    for body in range(first, min(first + AHEAD, n + 1)):
        channel = 0 if body < n else 2
        if plan.sensors[channel, NOISE] > 0.0 or plan.sensors[channel + 1, NOISE] > 0.0:
            use, index = (OF_ROBOT, body) if body < n else (OF_TARGET, 0)
            first_coordinates(coordinates[body - first], plan.bias.shape[1], plan.seed, use, index, step)


@inlined
def _remember(truth: Array, sensor: Array, past: Array, evaluated: int, bodies: int, index: int) -> int:
    """Keeps the truth, and says which row of the past has what it was some steps ago.

    Args:
        truth: Of one body now, shape (p,).
        sensor: The channel's row of the plan.
        past: Memory of all channels, shape (rows, p): each has delay + 1 rows per body, in turn.
        evaluated: Steps evaluated before this one.
        bodies: How many the channel measures.
        index: Which of them this is.
    """
    delay, first = int(sensor[DELAY]), int(sensor[PAST]) + index
    now = first + evaluated % (delay + 1) * bodies
    for k in range(truth.shape[0]):
        past[now, k] = truth[k]
    return first + max(evaluated - delay, 0) % (delay + 1) * bodies
