"""What a robot observes, as numbers without units: for learners, and for the behavior `learned`."""

from __future__ import annotations

import math

from escort_mj.components.movers import COMES
from escort_mj.components.obstacles import obstacle_speed, obstacles_seen
from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.teams import radius_of
from escort_mj.knowledge.belief import target_place, target_speed
from escort_mj.knowledge.teammates import know_teammates
from escort_mj.native.fields import Array
from escort_mj.native.kernels import inlined, merged
from escort_mj.native.vectors import Vec, dot, norm, numbers_at, set_numbers_at, zero_like
from escort_mj.plan import Plan, State
from escort_mj.sensing.lidar import FAR

TEAMMATES = 4  # that a robot observes, the nearest ones
NEAREST = 1e-9  # m at least to an obstacle's center
SPEED = 2.0  # what velocities are shares of where the mission has no limit [m/s]


@inlined
def vectors_observed(robots: int, opponents: int) -> int:
    """Return how many vectors a robot observes."""
    return 4 + min(robots - 1, TEAMMATES) + (2 if opponents > 0 else 0)


def observed_speed(max_speed: float) -> float:
    """Return what velocities are shares of [m/s], given the mission's limit."""
    return max_speed if max_speed < UNLIMITED else SPEED


@merged
def observe(i: int, plan: Plan, state: State, largest_speed: float, sight: bool, rows: Array) -> None:
    """Write what a robot observes, as far as the law knows it: see `Simulation.observe`.

    Args:
        i: Robot, from 0.
        plan: Of the mission.
        state: Gives what robots know; `mate_...` are scratch.
        largest_speed: That velocities are shares of [m/s].
        sight: Whether robots see each other.
        rows: Result, shape (vectors, p).
    """
    n = state.q.shape[0]
    mates, opponents = min(n - 1, TEAMMATES), state.opponent_status.shape[0]
    count, radius = rows.shape[0], radius_of(i, plan, state)
    q, way = numbers_at(state, state.q_measured, i), zero_like(target_place(i, plan, state))
    set_numbers_at(rows, 0, (target_place(i, plan, state) - q) / radius)
    set_numbers_at(rows, 1, target_speed(i, plan, state) / largest_speed)
    set_numbers_at(rows, 2, numbers_at(state, state.v_measured, i) / largest_speed)
    if plan.apart:
        know_teammates(i, plan, state)
    seen, within, least = obstacles_seen(i, plan, state), min(plan.sensing_obstacles, FAR), math.inf
    for j in range(plan.obstacle_radius.shape[0]):
        there = numbers_at(state, seen, j) - q
        gap = norm(there) - plan.seen_radius[j] - plan.robot_radius[i]
        least, way = _nearer(there, gap, within, least, way)
    if plan.apart and sight:
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
        gap = norm(way) - plan.seen_radius[j] - plan.robot_radius[i]
        visible = not plan.estimating or gap <= within
        if state.opponent_status[o] == COMES and square < least and visible:
            least = square
            if plan.estimating:
                speed = obstacle_speed(j, plan, state)
            set_numbers_at(rows, count - 2, way / radius)
            set_numbers_at(rows, count - 1, speed / largest_speed)


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
    return seen if plan.estimating else state.obstacle_position
