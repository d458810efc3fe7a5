"""What the law is given: the truth through the sensors (docs/sensing.md).

In this order: the truth, `delay` steps old (the start's, before so many steps); plus the bias; plus noise
from a ball (section 5), which belongs to the present step; rounded to the resolution. With the probability
of `dropout` nothing of it arrives, and the last value stays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.parameters import UNLIMITED
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import (
    WIDTH,
    copy_lanes,
    copy_numbers,
    stack_rows,
)
from escort_mj.native.on_demand import on_demand_unrolled
from escort_mj.native.vectors import part_at, rows_at, set_rows
from escort_mj.numerics.noise import OF_ROBOT, OF_TARGET, chance, draw_points
from escort_mj.plan import Plan, State
from escort_mj.sensing.sensors import plain_at

Array = NDArray[np.float64]


@inlined
def measure_all(plan: Plan, state: State) -> None:
    """Measures all robots, and the target once for the team.

    Args:
        plan: Gives the sensors.
        state: Gives time and truth; the measured positions and velocities are written, and the past.
    """
    n, p = state.q.shape
    if plan.perfect:
        copy_lanes(state.q, state.q_measured, n * p)
        copy_lanes(state.v, state.v_measured, n * p)
        copy_numbers(state.target_position, state.target_position_measured, p)
        copy_numbers(state.target_velocity, state.target_velocity_measured, p)
    else:
        take_measurements(plan, state)


@on_demand_unrolled
def take_measurements(plan: Plan, state: State) -> None:
    """As `measure_all`, with sensors that are not perfect."""
    n, p = state.q.shape
    step = int(state.step[0])
    per_robot = int(plain_at(0, plan).noise > 0.0) + int(plain_at(1, plan).noise > 0.0)
    for_target = int(plain_at(2, plan).noise > 0.0) + int(plain_at(3, plan).noise > 0.0)
    points = stack_rows(2 * p)
    for first in range(0, n + 1, WIDTH):
        after = first + WIDTH
        if (per_robot > 0 and first < n) or (for_target > 0 and after > n):
            draw_points(points, per_robot, for_target, plan.seed, first, n, step)
        for rate in range(2):
            begin = first
            if _only_noise(rate, plan):
                begin = max(first, n)
                if first < n:
                    _add_noise(rate, first, points, plan, state)
            for body in range(begin, min(after, n + 1)):
                _measure_one(rate, body, points, body - first, step, plan, state)


@inlined
def _only_noise(channel: int, plan: Plan) -> bool:
    """Whether a channel shows the truth plus noise, if anything."""
    plain = plain_at(channel, plan)
    at_once = plan.sensor_delay[channel] == 0.0 and plain.dropout == 0.0
    return bool(at_once and plain.resolution == UNLIMITED and plan.sensor_bias[channel] < 0.0)


@inlined
def _point_of(rate: int, first: int, plan: Plan) -> int:
    """Which point of the two is that of a rate: a ball of radius 0 draws nothing."""
    return rate if plain_at(first, plan).noise > 0.0 else 0


@inlined
def _add_noise(rate: int, first: int, points: Array, plan: Plan, state: State) -> None:
    """Measures positions or velocities of robots in lanes, whose sensors add noise and no more.

    Args:
        rate: 0 for positions, 1 for velocities.
        first: Number of the first robot.
        points: From unit balls, see `draw_points`.
        plan: Gives the sensors.
        state: Gives the truth; what is measured is written.
    """
    truth = state.q if rate == 0 else state.v
    measured = state.q_measured if rate == 0 else state.v_measured
    radius, shown = plain_at(rate, plan).noise, rows_at(state, truth, first)
    if radius > 0.0:
        point = part_at(state, points, state.q.shape[1] * _point_of(rate, 0, plan))
        shown = shown + radius * point
    set_rows(measured, first, shown)


@inlined
def _measure_one(
    rate: int, body: int, points: Array, lane: int, step: int, plan: Plan, state: State
) -> None:  # fmt: skip
    """Measures position or velocity of one body.

    Args:
        rate: 0 for the position, 1 for the velocity.
        body: Number of the robot, or n for the target.
        points: From unit balls, see `draw_points`.
        lane: Whose column of these is the body's.
        step: Number of the present step.
        plan: Gives the sensors.
        state: Gives the truth; what is measured is written, and the past.
    """
    n, p = state.q.shape
    evaluated = int(state.evaluated[0])
    of_robot = body < n
    index, use, bodies = (body, OF_ROBOT, n) if of_robot else (0, OF_TARGET, 1)
    first = 0 if of_robot else 2  # channel of the position; that of the velocity follows
    if of_robot:
        truth = state.q[index] if rate == 0 else state.v[index]
        measured = state.q_measured[index] if rate == 0 else state.v_measured[index]
    else:
        truth = state.target_position if rate == 0 else state.target_velocity
        measured = state.target_position_measured if rate == 0 else state.target_velocity_measured
    channel = first + rate
    plain, bias = plain_at(channel, plan), plan.sensor_bias[channel]
    seen = truth
    if plan.sensor_delay[channel] > 0.0:
        seen = state.past[_remember(truth, channel, plan, state.past, evaluated, bodies, index)]
    # The start always arrives. Evaluated again, a step drops the same again.
    if plain.dropout > 0.0 and evaluated > 0:
        if chance(plan.seed, use, index, step, rate) < plain.dropout:
            return
    at = p * _point_of(rate, first, plan)
    for k in range(p):
        value = seen[k]
        if bias >= 0.0:
            value += plan.bias[int(bias) + index, k]
        if plain.noise > 0.0:
            value += plain.noise * points[at + k, lane]
        if plain.resolution < UNLIMITED:
            value = np.rint(value / plain.resolution) * plain.resolution
        measured[k] = value


@inlined
def _remember(
    truth: Array, channel: int, plan: Plan, past: Array, evaluated: int, bodies: int, index: int
) -> int:  # fmt: skip
    """Keeps the truth, and says which row of the past has what it was some steps ago.

    Args:
        truth: Of one body now, shape (p,).
        channel: Which channel, from 0.
        plan: Gives the sensors.
        past: Memory of all channels, shape (rows, p): each has delay + 1 rows per body, in turn.
        evaluated: Steps evaluated before this one.
        bodies: How many the channel measures.
        index: Which of them this is.
    """
    delay, first = int(plan.sensor_delay[channel]), int(plan.sensor_past[channel]) + index
    now = first + evaluated % (delay + 1) * bodies
    copy_numbers(truth, past[now], truth.shape[0])
    return first + max(evaluated - delay, 0) % (delay + 1) * bodies


DROPOUTS = 2  # what a stream is for: noise of robots, of the target, then whose measurements arrive
