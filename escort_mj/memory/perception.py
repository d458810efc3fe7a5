"""What a learner's robots perceive after a step, and the reward of each, found in the memory of a mission.

`environments.senses` says what is perceived and asked, and lays out what is read and written here.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

from escort_mj.control.opponents import COMES, REACHED
from escort_mj.memory.layout import axes_of, unpack_plan, unpack_state
from escort_mj.native import artifacts
from escort_mj.native.kernels import DOUBLE, matrix_at, merged, vector_at
from escort_mj.native.on_demand import CLASSES, callback, piece_of

if TYPE_CHECKING:
    from escort_mj.memory.layout import Plan, State

WEIGHTS = ("radius", "spacing", "command", "clearance", "touch", "breach", "capture")
SETTINGS = (*WEIGHTS, "even", "safe", "speed", "bound", "begin", "end")
"""Numbers that a mission is perceived with: weights of rewards; even spacing [m], safe distance [m], largest
speed [m/s], distance to the target that is suspicious [m]; where in a record stands what must be finite."""
W_RADIUS, W_SPACING, W_COMMAND, W_CLEARANCE, W_TOUCH, W_BREACH, W_CAPTURE = range(7)
EVEN, SAFE, SPEED, BOUND, BEGIN, END = range(7, 13)
TEAMMATES = 4  # that a robot observes, the nearest ones
BROKEN = -1e6  # reward where a state is no longer a number
NEAREST = 1e-9  # m at least to an obstacle's center


@merged
def perceive(plan: Plan, state: State, memory: int, settings: int, commanded: int, found: int) -> None:
    """Write what the robots of a mission perceive, and their rewards.

    Args:
        plan: Of the mission.
        state: After a step in which a sample was taken.
        memory: Address of the state.
        settings: Address of the numbers that `SETTINGS` names.
        commanded: Address of the last command, shape (n, p), as shares.
        found: Address of what is written: 1 if nothing is suspicious; how many opponents have reached the
            target; of each robot a reward, how many it has intercepted, and its least clearance since the
            last command, at most what stands there [m]; what it observes, shape (n, width).
    """
    n, p = state.q.shape
    wish, shares = vector_at(settings, END + 1), matrix_at(commanded, n, p)
    rewards, captures = vector_at(found + DOUBLE * 2, n), vector_at(found + DOUBLE * (2 + n), n)
    clearance, whole = vector_at(found + DOUBLE * (2 + 2 * n), n), vector_at(found, 2)
    near, reached = True, 0.0
    for o in range(state.opponent_status.shape[0]):
        reached += 1.0 if state.opponent_status[o] == REACHED else 0.0
    for i in range(n):
        square, effort = 0.0, 0.0
        for k in range(p):
            square += (state.q[i, k] - state.target_position[k]) ** 2
            effort += shares[i, k] ** 2
        distance = math.sqrt(square)
        near = near and distance < wish[BOUND]
        for g in range(state.clearance.shape[1]):
            least = state.clearance[i, g]
            clearance[i] = clearance[i] if clearance[i] <= least else least
        reward = -wish[W_RADIUS] * abs(distance - plan.radius) / plan.radius - wish[W_COMMAND] * effort / p
        lack = 1.0 - state.robot_distance_min[i] / wish[EVEN]
        reward -= wish[W_SPACING] * (0.0 if lack < 0.0 else lack)
        lack = 1.0 - clearance[i] / wish[SAFE]
        reward -= wish[W_CLEARANCE] * (0.0 if lack < 0.0 else 1.0 if lack > 1.0 else lack)
        reward -= wish[W_TOUCH] if clearance[i] <= 0.0 else 0.0
        caught = 0.0
        for o in range(state.interceptor.shape[0]):
            caught += 1.0 if state.interceptor[o] == i + 1.0 else 0.0
        reward += wish[W_CAPTURE] * (caught - captures[i]) - wish[W_BREACH] * (reached - whole[1])
        captures[i] = caught
        rewards[i] = reward if abs(reward) < math.inf else BROKEN
        observe(i, plan, state, wish[SPEED], found + DOUBLE * (2 + 3 * n))
    whole[1] = reached
    whole[0] = 1.0 if near and is_sound(plan, memory, int(wish[BEGIN]), int(wish[END])) else 0.0


@merged
def is_sound(plan: Plan, memory: int, begin: int, end: int) -> bool:
    """Whether a record has no NaN, and from one place to before another nothing infinite."""
    place, sound = 0, True
    for k in range(plan.stretches.shape[0]):
        first, count = int(plan.stretches[k, 0]), int(plan.stretches[k, 1])
        numbers = vector_at(memory + DOUBLE * first, count)
        for one in range(count):
            size = abs(numbers[one])
            inside = begin <= place + one < end
            sound = sound and size <= math.inf and (not inside or size < math.inf)
        place += count
    return sound


@merged
def observe(i: int, plan: Plan, state: State, speed: float, found: int) -> None:
    """Write what a robot observes: see `Simulation.observe`.

    Args:
        i: Robot, from 0.
        plan: Of the mission.
        state: After a step.
        speed: That velocities are shares of [m/s].
        found: Address of what robots observe, shape (n, width).
    """
    n, p = state.q.shape
    mates, opponents = min(n - 1, TEAMMATES), state.opponent_status.shape[0]
    count = 4 + mates + (2 if opponents > 0 else 0)
    rows = matrix_at(found + DOUBLE * i * count * p, count, p)
    for k in range(p):
        rows[0, k] = (state.target_position_measured[k] - state.q_measured[i, k]) / plan.radius
        rows[1, k] = state.target_velocity_measured[k] / speed
        rows[2, k] = state.v_measured[i, k] / speed
        rows[3, k] = 0.0
    m, least = plan.obstacle_radius.shape[0], math.inf
    for j in range(m):
        square = 0.0
        for k in range(p):
            square += (_place(i, j, k, plan, state) - state.q_measured[i, k]) ** 2
        length = math.sqrt(square)
        gap = length - plan.obstacle_radius[j] - plan.robot_radius[i]
        if gap < least:
            least = gap
            for k in range(p):
                way = _place(i, j, k, plan, state) - state.q_measured[i, k]
                rows[3, k] = way * (gap / max(length, NEAREST)) / plan.radius
    reached, last = -1.0, -1  # the teammate that was found before, and its distance squared
    for mate in range(mates):
        nearest, square_of_nearest = -1, math.inf
        for j in range(n):
            square = 0.0
            for k in range(p):
                square += (state.q_measured[j, k] - state.q_measured[i, k]) ** 2
            later = square > reached or (square == reached and j > last)
            if j != i and later and square < square_of_nearest:
                nearest, square_of_nearest = j, square
        for k in range(p):
            there = state.q_measured[nearest, k] if nearest >= 0 else math.nan
            rows[4 + mate, k] = (there - state.q_measured[i, k]) / plan.radius
        reached, last = square_of_nearest, nearest
    if opponents > 0:
        rows[count - 2 :] = 0.0
    least = math.inf
    for o in range(opponents):
        square, j = 0.0, int(plan.opponent_obstacle[o])
        for k in range(p):
            square += (state.obstacle_position[j, k] - state.q_measured[i, k]) ** 2
        if state.opponent_status[o] == COMES and square < least:
            least = square
            for k in range(p):
                way = state.obstacle_position[j, k] - state.q_measured[i, k]
                rows[count - 2, k] = way / plan.radius
                rows[count - 1, k] = state.obstacle_velocity[j, k] / speed


@merged
def _place(i: int, j: int, k: int, plan: Plan, state: State) -> float:
    """A coordinate of an obstacle as a robot finds it: of its center, or of the nearest point of a shape."""
    m = plan.obstacle_radius.shape[0]
    return state.obstacle_point[i * m + j, k] if plan.shaped else state.obstacle_position[j, k]


@callback(*CLASSES)
def perception(axes: int | None) -> Callable[..., None]:
    """Perceive a mission whose plan and state are at two addresses; the others are those of `perceive`."""
    if axes is None:

        def of_many(plan: int, memory: int, settings: int, commanded: int, found: int) -> None:
            axes = axes_of(plan)
            state = unpack_state(plan, memory, axes)
            perceive(unpack_plan(plan, axes), state, memory, settings, commanded, found)

        return of_many

    def of_few(plan: int, memory: int, settings: int, commanded: int, found: int) -> None:
        state = unpack_state(plan, memory, axes)
        perceive(unpack_plan(plan, axes), state, memory, settings, commanded, found)

    return of_few


@cache
def perception_of(axes: int) -> Callable[[int, int, int, int, int], None]:
    """Return the machine code of `perception` for so many axes; it is too short to release Python's lock."""
    address = artifacts.address(piece_of(perception, axes))
    return ctypes.PYFUNCTYPE(None, *[ctypes.c_ssize_t] * 5)(address)
