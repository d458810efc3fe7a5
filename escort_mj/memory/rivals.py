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
from escort_mj.native.kernels import DOUBLE, matrix_at, merged, stack_memory, vector_at
from escort_mj.native.on_demand import callback, piece_of
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
    kept = vector_at(stack_memory(), 2 * p)
    for k in range(p):
        kept[k], kept[p + k] = state.target_position[k], state.target_velocity[k]
    for b in range(bodies):
        o = int(plan.mover_opponent[b])
        if o < 0:
            continue
        if plan.team_radius.shape[0] > 0:
            aim(b, plan, state)
        row, square, effort = vector_at(found + DOUBLE * width * o, SEEN), 0.0, 0.0
        for k in range(p):
            square += (state.target_position[k] - state.mover_position[b, k]) ** 2
            effort += shares[o, k] ** 2
        distance, status, reward = math.sqrt(square), state.opponent_status[o], 0.0
        nearer = (row[DISTANCE] - distance) / plan.radius
        if row[STATUS] == COMES:
            reward = wish[0] * (nearer if abs(nearer) < math.inf else 0.0) - wish[3] * effort / p
        if row[STATUS] <= COMES:
            reward += wish[1] if status == REACHED else -wish[2] if status == INTERCEPTED else 0.0
        row[REWARD], row[DISTANCE], row[STATUS] = reward, distance, status
        seen = vector_at(found + DOUBLE * (width * o + SEEN), width - SEEN)
        perceive(body_at(b, policy_view(state)), plan.mover_speed[b], seen)
    for k in range(p):
        state.target_position[k], state.target_velocity[k] = kept[k], kept[p + k]


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
