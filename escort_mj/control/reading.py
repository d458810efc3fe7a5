"""What sensors of other kinds than the plain one show: step by step, quantity by quantity, axis by axis."""

from __future__ import annotations

import math

from escort_mj.components.component import block_at
from escort_mj.control.custom.calls import custom_sensor
from escort_mj.control.members import asker
from escort_mj.native.kernels import inlined
from escort_mj.native.on_demand import on_demand
from escort_mj.numerics.gaussian import SENSOR, fractions, normals
from escort_mj.plan import Plan, State
from escort_mj.sensors import EQUATED, QUANTITIES
from escort_mj.sensors.sensor import MOVES, NORMALS, SHOWS

POSITION, VELOCITY, TARGET_POSITION, TARGET_VELOCITY, HEADING = range(len(QUANTITIES))
BLOCKS = 2  # of random numbers for one axis
MOST_AXES = 9


@on_demand
def read_sensors(moved: bool, plan: Plan, state: State) -> None:
    """Let all sensors measure that are not plain; `..._measured` and `readings` are written.

    Args:
        moved: Whether time has moved on: then the sensors' own numbers do.
        plan: Gives the sensors.
        state: Gives the truth.
    """
    p, question = state.q.shape[1], SHOWS
    if moved and state.evaluated[0] > 0.0:
        question = MOVES
    for s in range(plan.own_sensor.shape[0]):
        quantity, row = int(plan.own_quantity[s]), int(plan.own_first[s])
        if quantity == HEADING:
            _read(s, question, quantity, 0, 1, row + 1, plan, state)
            for i in range(state.q.shape[0]):
                state.readings[row, i] = state.sensor_shown[i]
        else:
            for k in range(p):
                _read(s, question, quantity, k, p, row, plan, state)
                _show(quantity, k, state)


@inlined
def _read(
    s: int, question: int, quantity: int, k: int, width: int, row: int, plan: Plan, state: State
) -> None:  # fmt: skip
    """Ask one sensor along one axis, with its own numbers from the rows of `readings`."""
    for i in range(state.q.shape[0]):
        state.sensor_truth[i] = _truth(quantity, i, k, state)
        body = 0 if quantity == TARGET_POSITION or quantity == TARGET_VELOCITY else i
        block, step = 1 + BLOCKS * (quantity * MOST_AXES + k), int(state.step[0])
        normals(len(NORMALS), plan.seed, block, SENSOR, body, step, state.sensor_drawn)
        for j in range(len(NORMALS)):
            state.sensor_normals[j, i] = state.sensor_drawn[j]
        draw, _, _, _ = fractions(plan.seed, block + 1, SENSOR, body, step)
        state.sensor_draw[i] = draw
        for j in range(int(plan.own_memories[s])):
            state.sensor_memory[j, i] = state.readings[row + j * width + k, i]
    _ask(int(plan.own_sensor[s]), block_at(int(plan.own_sensor_place[s]), plan), question, plan, state)
    for i in range(state.q.shape[0]):
        for j in range(int(plan.own_memories[s])):
            state.readings[row + j * width + k, i] = state.sensor_memory[j, i]


@inlined
def _truth(quantity: int, i: int, k: int, state: State) -> float:
    """Return the true value of a quantity of robot i on axis k."""
    if quantity == POSITION:
        return state.q[i, k]
    if quantity == VELOCITY:
        return state.v[i, k]
    if quantity == TARGET_POSITION:
        return state.target_position[k]
    if quantity == TARGET_VELOCITY:
        return state.target_velocity[k]
    return math.atan2(state.heading[i, 1], state.heading[i, 0])


@inlined
def _show(quantity: int, k: int, state: State) -> None:
    """Write what was measured on axis k to where all read it."""
    if quantity == TARGET_POSITION:
        state.target_position_measured[k] = state.sensor_shown[0]
    elif quantity == TARGET_VELOCITY:
        state.target_velocity_measured[k] = state.sensor_shown[0]
    else:
        measured = state.q_measured if quantity == POSITION else state.v_measured
        for i in range(state.q.shape[0]):
            measured[i, k] = state.sensor_shown[i]


_ask = asker(EQUATED, custom_sensor)
