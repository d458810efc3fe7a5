"""What a learner's robots perceive after a step, and the reward of each, found in the memory of a mission.

`environments.senses` says what is perceived and asked, and lays out what is read and written here.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from functools import cache

from escort_mj.components.movers import COMES, REACHED
from escort_mj.components.obstacles import obstacle_speed, obstacles_seen
from escort_mj.components.teams import radius_of
from escort_mj.knowledge.belief import target_place, target_speed
from escort_mj.knowledge.teammates import know_teammates
from escort_mj.memory.layout import axes_of, unpack_plan, unpack_state
from escort_mj.native import artifacts
from escort_mj.native.fields import Array
from escort_mj.native.kernels import DOUBLE, inlined, matrix_at, merged, vector_at
from escort_mj.native.on_demand import CLASSES, callback, piece_of
from escort_mj.native.vectors import Vec, dot, norm, numbers_at, of_numbers, set_numbers_at
from escort_mj.plan import Plan, State
from escort_mj.sensing.lidar import FAR

WEIGHTS = ("radius", "spacing", "command", "clearance", "touch", "breach", "capture")
SETTINGS = (*WEIGHTS, "safe", "speed", "bound", "begin", "end", "sight")
"""Numbers that a mission is perceived with: weights of rewards; safe distance [m], largest speed [m/s],
distance to the target that is suspicious [m]; where in a record stands what must be finite; 1 where robots
see each other. The even spacings of teams of 1, 2 ... n robots follow, team by team, at the radius that the
team has at the start [m]."""
W_RADIUS, W_SPACING, W_COMMAND, W_CLEARANCE, W_TOUCH, W_BREACH, W_CAPTURE = range(7)
SAFE, SPEED, BOUND, BEGIN, END, SIGHT, EVEN = range(7, 14)
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
    teams = max(plan.team_radius.shape[0], 1)
    wish, shares = vector_at(settings, EVEN + teams * n), matrix_at(commanded, n, p)
    rewards, captures = vector_at(found + DOUBLE * 2, n), vector_at(found + DOUBLE * (2 + n), n)
    clearance, whole = vector_at(found + DOUBLE * (2 + 2 * n), n), vector_at(found, 2)
    near, reached = True, 0.0
    for o in range(state.opponent_status.shape[0]):
        reached += 1.0 if state.opponent_status[o] == REACHED else 0.0
    for i in range(n):
        center, radius = _middle(i, plan, state), radius_of(i, plan, state)
        square, from_target, effort = 0.0, 0.0, 0.0
        for k in range(p):
            square += (state.q[i, k] - center[k]) ** 2
            from_target += (state.q[i, k] - state.target_position[k]) ** 2
            effort += shares[i, k] ** 2
        distance = math.sqrt(square)
        near = near and math.sqrt(from_target) < wish[BOUND]
        for g in range(state.clearance.shape[1]):
            least = state.clearance[i, g]
            clearance[i] = clearance[i] if clearance[i] <= least else least
        reward = -wish[W_RADIUS] * abs(distance - radius) / radius - wish[W_COMMAND] * effort / p
        lack = 1.0 - _spacing(i, wish, plan, state)
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
        observe(i, plan, state, wish, found + DOUBLE * (2 + 3 * n))
    whole[1] = reached
    whole[0] = 1.0 if near and is_sound(plan, memory, int(wish[BEGIN]), int(wish[END])) else 0.0


@merged
def _middle(robot: int, plan: Plan, state: State) -> Array:
    """Return where the target of a robot truly is: of its team, the middle of the targets [m]."""
    if plan.team_radius.shape[0] > 0:
        return state.team_center[int(state.member_of[robot]) - 1]
    return state.target_position


@inlined
def _spacing(robot: int, wish: Array, plan: Plan, state: State) -> float:
    """Return how far the nearest teammate of a robot is, as a share of the even spacing of its team."""
    n, p = state.q.shape
    if plan.team_radius.shape[0] == 0:
        return state.robot_distance_min[robot] / wish[EVEN + n - 1]
    nearest, team = math.inf, int(state.member_of[robot]) - 1
    for j in range(n):
        square = 0.0
        for k in range(p):
            square += (state.q[j, k] - state.q[robot, k]) ** 2
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


@merged
def observe(i: int, plan: Plan, state: State, wish: Array, found: int) -> None:
    """Write what a robot observes, as far as the law knows it: see `Simulation.observe`.

    Args:
        i: Robot, from 0.
        plan: Of the mission.
        state: After a step; `mate_...` are scratch.
        wish: The numbers that `SETTINGS` names.
        found: Address of what robots observe, shape (n, width).
    """
    n, p = state.q.shape
    mates, opponents = min(n - 1, TEAMMATES), state.opponent_status.shape[0]
    count = 4 + mates + (2 if opponents > 0 else 0)
    rows, radius = matrix_at(found + DOUBLE * i * count * p, count, p), radius_of(i, plan, state)
    q, way = numbers_at(state, state.q_measured, i), of_numbers(target_place(i, plan, state), 0.0, 0.0, 0.0)
    set_numbers_at(rows, 0, (target_place(i, plan, state) - q) / radius)
    set_numbers_at(rows, 1, target_speed(i, plan, state) / wish[SPEED])
    set_numbers_at(rows, 2, numbers_at(state, state.v_measured, i) / wish[SPEED])
    if plan.apart:
        know_teammates(i, plan, state)
    seen, within, least = obstacles_seen(i, plan, state), min(plan.sensing_obstacles, FAR), math.inf
    for j in range(plan.obstacle_radius.shape[0]):
        there = numbers_at(state, seen, j) - q
        gap = norm(there) - plan.seen_radius[j] - plan.robot_radius[i]
        least, way = _nearer(there, gap, within, least, way)
    if plan.apart and wish[SIGHT] != 0.0:
        for j in range(n):
            if j != i and state.mate_unknown[j] != 0.0:
                there = numbers_at(state, state.q_measured, j) - q
                gap = norm(there) - plan.robot_radius[j] - plan.robot_radius[i]
                least, way = _nearer(there, gap, plan.sensing_robots, least, way)
    set_numbers_at(rows, 3, way / radius)
    reached, last, places = -1.0, -1, _teammates(plan, state)  # of the one that was found before
    for mate in range(mates):
        nearest, square_of_nearest = -1, math.inf
        for j in range(n):
            way = numbers_at(state, places, j) - q
            square = dot(way, way)
            later = square > reached or (square == reached and j > last)
            unknown = plan.apart and state.mate_unknown[j] != 0.0
            if j != i and later and square < square_of_nearest and not unknown:
                nearest, square_of_nearest = j, square
        there = numbers_at(state, places, nearest) if nearest >= 0 else q
        set_numbers_at(rows, 4 + mate, (there - q) / radius)
        reached, last = square_of_nearest, nearest
    if opponents > 0:
        rows[count - 2 :] = 0.0
    least, places = math.inf, _opponents(seen, plan, state)
    for o in range(opponents):
        j = int(plan.opponent_obstacle[o])
        way, speed = numbers_at(state, places, j) - q, numbers_at(state, state.obstacle_velocity, j)
        square = dot(way, way)
        gap = math.sqrt(square) - plan.seen_radius[j] - plan.robot_radius[i]
        visible = not plan.informed or gap <= within
        if state.opponent_status[o] == COMES and square < least and visible:
            least = square
            if plan.informed:
                speed = obstacle_speed(j, plan, state)
            set_numbers_at(rows, count - 2, way / radius)
            set_numbers_at(rows, count - 1, speed / wish[SPEED])


@inlined
def _nearer(way: Vec, gap: float, within: float, least: float, nearest: Vec) -> tuple[float, Vec]:
    """Return the gap to a body that a robot sees and the way to its surface, unless another one is nearer.

    Args:
        way: To its center, or to the point of it that the robot sees [m].
        gap: To its surface [m].
        within: How far robots see it, surface to surface [m].
        least: Gap to the nearest body so far [m].
        nearest: Way to the surface of that [m].
    """
    if not (gap < least and gap <= within):
        return least, nearest
    return gap, (gap / max(norm(way), NEAREST)) * way


@merged
def _teammates(plan: Plan, state: State) -> Array:
    """Return where a robot knows its teammates to be, shape (n, p) [m]."""
    return state.mate_position if plan.apart else state.q_measured


@merged
def _opponents(seen: Array, plan: Plan, state: State) -> Array:
    """Return where a robot knows opponents to be, among obstacles: with `knowledge`, where it sees them."""
    return seen if plan.informed else state.obstacle_position


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
