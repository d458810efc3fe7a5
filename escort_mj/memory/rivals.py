"""What opponents that are commanded from outside perceive after a step, and the reward of each.

`environments.rivals` says what is perceived and asked, and lays out what is read and written here.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from functools import cache

from escort_mj.components.movers import COMES, INTERCEPTED, REACHED
from escort_mj.control.opponents import aim
from escort_mj.memory.layout import unpack_plan, unpack_state
from escort_mj.native import artifacts
from escort_mj.native.kernels import DOUBLE, matrix_at, merged, vector_at
from escort_mj.native.on_demand import callback, piece_of
from escort_mj.native.vectors import dot, norm, numbers_at, numbers_from, set_numbers
from escort_mj.plan import Plan, State
from escort_mj.policies.body import body_at, policy_view
from escort_mj.policies.learned import ROBOTS, perceive

WEIGHTS = ("approach", "reach", "capture", "command")
REWARD, DISTANCE, STATUS, SEEN = range(4)
"""Columns of what is found of each opponent: reward, distance to the target [m], status, what it observes."""


@merged
def perceive_rivals(plan: Plan, state: State, weights: int, commanded: int, found: int) -> None:
    """Write what the opponents of a mission perceive, and their rewards.

    In missions with teams, the target of an opponent is the nearest of their targets.

    Args:
        plan: Of the mission.
        state: After a step.
        weights: Address of the numbers that `WEIGHTS` names.
        commanded: Address of the last command, shape (o, p), as shares.
        found: Address of what is written, shape (o, SEEN + inputs); before, as of the last command.
    """
    p, bodies, opponents = state.q.shape[1], plan.mover_opponent.shape[0], plan.opponent_obstacle.shape[0]
    width = SEEN + (3 + 2 * ROBOTS) * p
    wish, shares = vector_at(weights, len(WEIGHTS)), matrix_at(commanded, opponents, p)
    position = numbers_from(state, state.target_position, 0)
    velocity = numbers_from(state, state.target_velocity, 0)
    for b in range(bodies):
        o = int(plan.mover_opponent[b])
        if o < 0:
            continue
        if plan.team_radius.shape[0] > 0:
            aim(b, plan, state)
        row, share = vector_at(found + DOUBLE * width * o, SEEN), numbers_at(state, shares, o)
        way = numbers_from(state, state.target_position, 0) - numbers_at(state, state.mover_position, b)
        distance, status, reward = norm(way), state.opponent_status[o], 0.0
        nearer = (row[DISTANCE] - distance) / plan.radius
        if row[STATUS] == COMES:
            reward = wish[0] * (nearer if abs(nearer) < math.inf else 0.0) - wish[3] * dot(share, share) / p
        if row[STATUS] <= COMES:
            reward += wish[1] if status == REACHED else -wish[2] if status == INTERCEPTED else 0.0
        row[REWARD], row[DISTANCE], row[STATUS] = reward, distance, status
        seen = vector_at(found + DOUBLE * (width * o + SEEN), width - SEEN)
        perceive(body_at(b, policy_view(state)), plan.mover_speed[b], seen)
    set_numbers(state.target_position, 0, position)
    set_numbers(state.target_velocity, 0, velocity)


@callback(2, 3)
def rival_perception(axes: int) -> Callable[..., None]:
    """Perceive a mission whose plan and state are at two addresses; the others are as `perceive_rivals`."""

    def of_opponents(plan: int, memory: int, weights: int, commanded: int, found: int) -> None:
        state = unpack_state(plan, memory, axes)
        perceive_rivals(unpack_plan(plan, axes), state, weights, commanded, found)

    return of_opponents


@cache
def rival_perception_of(axes: int) -> Callable[[int, int, int, int, int], None]:
    """Return the machine code of `rival_perception`; it is too short to release Python's lock."""
    address = artifacts.address(piece_of(rival_perception, axes))
    return ctypes.PYFUNCTYPE(None, *[ctypes.c_ssize_t] * 5)(address)
