"""What a learner's robots perceive after a step, and the reward of each, found in the memory of a mission.

`environments.senses` says what is perceived and asked, and lays out what is read and written here.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from functools import cache

from escort_mj.components.movers import REACHED
from escort_mj.components.teams import radius_of
from escort_mj.knowledge.observation import observe, vectors_observed
from escort_mj.memory.layout import axes_of, unpack_plan, unpack_state
from escort_mj.native import artifacts
from escort_mj.native.fields import Array
from escort_mj.native.kernels import DOUBLE, inlined, matrix_at, merged, vector_at
from escort_mj.native.on_demand import CLASSES, callback, piece_of
from escort_mj.native.vectors import Vec, dot, norm, numbers_at, numbers_from
from escort_mj.plan import Plan, State

WEIGHTS = ("radius", "spacing", "command", "clearance", "touch", "breach", "capture")
SETTINGS = (*WEIGHTS, "safe", "speed", "bound", "begin", "end", "sight")
"""Numbers that a mission is perceived with: weights of rewards; safe distance [m], largest speed [m/s],
distance to the target that is suspicious [m]; where in a record stands what must be finite; 1 where robots
see each other. The even spacings of teams of 1, 2 ... n robots follow, team by team, at the radius that the
team has at the start [m]."""
W_RADIUS, W_SPACING, W_COMMAND, W_CLEARANCE, W_TOUCH, W_BREACH, W_CAPTURE = range(7)
SAFE, SPEED, BOUND, BEGIN, END, SIGHT, EVEN = range(7, 14)
BROKEN = -1e6  # reward where a state is no longer a number


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
            last command, at most what stands there [m]; the terms of its reward, shape (n, WEIGHTS); what it
            observes, shape (n, width).
    """
    n, p = state.q.shape
    teams = max(plan.team_radius.shape[0], 1)
    wish, shares = vector_at(settings, EVEN + teams * n), matrix_at(commanded, n, p)
    rewards, captures = vector_at(found + DOUBLE * 2, n), vector_at(found + DOUBLE * (2 + n), n)
    clearance, whole = vector_at(found + DOUBLE * (2 + 2 * n), n), vector_at(found, 2)
    terms = matrix_at(found + DOUBLE * (2 + 3 * n), n, len(WEIGHTS))
    near, reached, count = True, 0.0, vectors_observed(n, state.opponent_status.shape[0])
    for o in range(state.opponent_status.shape[0]):
        reached += 1.0 if state.opponent_status[o] == REACHED else 0.0
    for i in range(n):
        radius = radius_of(i, plan, state)
        q, share = numbers_at(state, state.q, i), numbers_at(state, shares, i)
        distance, effort = norm(q - _middle(i, plan, state)), dot(share, share)
        near = near and norm(q - numbers_from(state, state.target_position, 0)) < wish[BOUND]
        for g in range(state.clearance.shape[1]):
            least = state.clearance[i, g]
            clearance[i] = clearance[i] if clearance[i] <= least else least
        terms[i, W_RADIUS] = -wish[W_RADIUS] * abs(distance - radius) / radius
        terms[i, W_COMMAND] = -wish[W_COMMAND] * effort / p
        lack = 1.0 - _spacing(i, wish, plan, state)
        terms[i, W_SPACING] = -wish[W_SPACING] * (0.0 if lack < 0.0 else lack)
        lack = 1.0 - clearance[i] / wish[SAFE]
        terms[i, W_CLEARANCE] = -wish[W_CLEARANCE] * (0.0 if lack < 0.0 else 1.0 if lack > 1.0 else lack)
        terms[i, W_TOUCH] = -wish[W_TOUCH] if clearance[i] <= 0.0 else 0.0
        caught = 0.0
        for o in range(state.interceptor.shape[0]):
            caught += 1.0 if state.interceptor[o] == i + 1.0 else 0.0
        terms[i, W_CAPTURE] = wish[W_CAPTURE] * (caught - captures[i])
        terms[i, W_BREACH] = -wish[W_BREACH] * (reached - whole[1])
        captures[i], reward = caught, 0.0
        for term in range(len(WEIGHTS)):
            reward += terms[i, term]
        rewards[i] = reward if abs(reward) < math.inf else BROKEN
        rows = matrix_at(found + DOUBLE * (2 + 3 * n + len(WEIGHTS) * n + i * count * p), count, p)
        observe(i, plan, state, wish[SPEED], wish[SIGHT] != 0.0, rows)
    whole[1] = reached
    whole[0] = 1.0 if near and is_sound(plan, memory, int(wish[BEGIN]), int(wish[END])) else 0.0


@inlined
def _middle(robot: int, plan: Plan, state: State) -> Vec:
    """Return where the target of a robot truly is: of its team, the middle of the targets [m]."""
    if plan.team_radius.shape[0] > 0:
        return numbers_at(state, state.team_center, int(state.member_of[robot]) - 1)
    return numbers_from(state, state.target_position, 0)


@inlined
def _spacing(robot: int, wish: Array, plan: Plan, state: State) -> float:
    """Return how far the nearest teammate of a robot is, as a share of the even spacing of its team."""
    n = state.q.shape[0]
    if plan.team_radius.shape[0] == 0:
        return state.robot_distance_min[robot] / wish[EVEN + n - 1]
    nearest, team = math.inf, int(state.member_of[robot]) - 1
    for j in range(n):
        way = numbers_at(state, state.q, j) - numbers_at(state, state.q, robot)
        square = dot(way, way)
        if j != robot and state.member_of[j] == team + 1.0 and state.lost[j] == 0.0:
            nearest = min(nearest, square)
    if nearest == math.inf or state.lost[robot] != 0.0:
        return math.inf
    even = wish[EVEN + team * n + int(state.team_left[team]) - 1]
    return math.sqrt(nearest) / (even * (state.team_radius[team] / plan.team_radius[team]))


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
