"""Contact episodes, natively: touches of pairs of bodies, begun, gone on and ended at every physics step.

What touches in a step has a row in one of two tables, by turns; a pair that touched in the step before takes
its row along, and rows that were not taken are episodes that have ended. A hash table of each step finds a
pair's row: a step costs in proportion to its contacts however many bodies touch, nothing where none does.
"""

from __future__ import annotations

import math
from typing import Annotated

from escort_mj.components.obstacles import obstacles_seen
from escort_mj.monitor.signals import (
    CLOSING_SPEED,
    DEPTH,
    END,
    EPISODE_SIZE,
    FIRST,
    IMPULSE,
    PEAK_FORCE,
    PEAK_TIME,
    SECOND,
    START,
    TOUCH_TIME,
)
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, kernel
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import Plan, State

FORCE = EPISODE_SIZE  # place in a row of `touches` of the force of the present step
KEY, STAMP, ROW = 0, 1, 2  # places in a cell of `places`
PAIRS_PER_BODY = 8  # so many can touch at once, and end between two samples; more are counted, not logged
CELLS_PER_PAIR = 2  # of the table that finds a pair
TAKEN = -1.0  # in place of its first body: a row that has gone on to the present step
KEYS = 2**31
SPREAD = (73856093, 19349663)  # primes: pairs of one body must not fall on a few cells


class ContactState(Fields):
    """The log of contacts; two tables each, of the step before and of this one by turns."""

    touches: Annotated[
        Array, 2, "pairs", EPISODE_SIZE + 1, Value("1", "episodes under way, and the force in this step")
    ]
    places: Annotated[Array, 2, "cells", 3, Value("1", "tables that find a pair's row in `touches`")]
    episodes: Annotated[
        Array, "pairs", EPISODE_SIZE, Value("1", "that have ended and were not yet taken off")
    ]
    turn: Annotated[Array, 1, Value("1", "stamp of the present step: odd and even take turns")]
    under_way: Annotated[Array, 1, Value("1", "rows of `touches` in the present step")]
    under_way_before: Annotated[Array, 1, Value("1", "rows of `touches` in the step before")]
    ended: Annotated[Array, 1, Value("1", "rows of `episodes`")]


@inlined
def begin(state: State) -> None:
    """Begins the contacts of a physics step."""
    state.turn[0] = max(state.turn[0], 1.0) + 1.0  # cells that were never used bear the stamp 0
    state.under_way_before[0] = state.under_way[0]
    state.under_way[0] = 0.0


@kernel
def touch(
    state: State, time: float, first: int, second: int, force: float, depth: float, speed: float
) -> None:
    """Notes one contact of the present step.

    Args:
        state: The log of touches is written.
        time: Of the step [s].
        first: One body.
        second: The other.
        force: Normal force [N].
        depth: Penetration [m].
        speed: At which the bodies close along the normal [m/s]; it counts in the pair's first step.
    """
    stamp = state.turn[0]
    turn = int(stamp) % 2
    rows, places = state.touches[turn], state.places[turn]
    low, high = min(first, second), max(first, second)
    cell = _cell(places, low, high, stamp)
    if places[cell, STAMP] != stamp:
        row = int(state.under_way[0])
        if row == rows.shape[0]:
            state.contacts_untold[0] += 1.0
            return
        state.under_way[0] = row + 1
        places[cell, KEY], places[cell, STAMP], places[cell, ROW] = low * KEYS + high, stamp, row
        for column in range(EPISODE_SIZE):
            rows[row, column] = 0.0
        rows[row, FIRST], rows[row, SECOND], rows[row, START] = low, high, time
        rows[row, PEAK_TIME], rows[row, CLOSING_SPEED] = time, speed
        known = state.places[1 - turn]
        old = _cell(known, low, high, stamp - 1.0)
        if known[old, STAMP] == stamp - 1.0:
            before = int(known[old, ROW])
            for column in range(EPISODE_SIZE):
                rows[row, column] = state.touches[1 - turn, before, column]
            state.touches[1 - turn, before, FIRST] = TAKEN
        rows[row, FORCE] = 0.0
    row = int(places[cell, ROW])
    rows[row, FORCE] += force
    rows[row, DEPTH] = max(rows[row, DEPTH], depth)
    if rows[row, START] == time:
        rows[row, CLOSING_SPEED] = max(rows[row, CLOSING_SPEED], speed)


@inlined
def _cell(places: Array, low: int, high: int, stamp: float) -> int:
    """The cell that has a pair's place in the step of a stamp, or a free one."""
    cell = (low * SPREAD[0] + high * SPREAD[1]) % places.shape[0]
    while places[cell, STAMP] == stamp and places[cell, KEY] != low * KEYS + high:
        cell = (cell + 1) % places.shape[0]
    return cell


@kernel
def settle(state: State, time: float, timestep: float) -> None:
    """Ends the contacts of a physics step: totals of what touches, a log of what no longer does.

    Args:
        state: The log of touches is written.
        time: Of the step [s].
        timestep: [s].
    """
    turn = int(state.turn[0]) % 2
    old, now = state.touches[1 - turn], state.touches[turn]
    for row in range(int(state.under_way_before[0])):
        if old[row, FIRST] == TAKEN:
            continue
        line = int(state.ended[0])
        if line == state.episodes.shape[0]:
            state.contacts_untold[0] += 1.0
            continue
        for column in range(EPISODE_SIZE):
            state.episodes[line, column] = old[row, column]
        state.ended[0] = line + 1
    for row in range(int(state.under_way[0])):
        force = now[row, FORCE]
        now[row, END] = time + timestep
        now[row, TOUCH_TIME] += timestep
        if force > now[row, PEAK_FORCE]:
            now[row, PEAK_FORCE], now[row, PEAK_TIME] = force, time
        if force < math.inf:  # a state that is no longer a number spoils no log
            now[row, IMPULSE] += force * timestep


@on_demand
def touch_overlaps(plan: Plan, state: State, target_radius: float) -> None:
    """Notes the pairs of bodies that overlap in all axes: contacts without force, where MuJoCo can find none.

    In more than three axes a body's parts may lie on another's while the two are far apart. Obstacles stand
    there.

    Args:
        plan: Gives obstacles and radii.
        state: `q`, `v` and the target are read, the log of touches is written.
        target_radius: [m]; 0 where there is no target.
    """
    n, m = state.q.shape[0], plan.obstacle_radius.shape[0]
    begin(state)
    for i in range(n + 1):  # the target last, if there is one
        for other in range(n + 1 + m):
            if i <= other <= n or (i == n and target_radius == 0.0):
                continue  # pairs of robots and the target count once
            radius = plan.robot_radius[i] if i < n else target_radius
            if other < n:
                radius += plan.robot_radius[other]
            else:
                radius += plan.obstacle_radius[other - n - 1]
            square, approach = 0.0, 0.0
            for k in range(state.q.shape[1]):
                x = state.q[i, k] if i < n else state.target_position[k]
                v = state.v[i, k] if i < n else state.target_velocity[k]
                if other < n:
                    x, v = x - state.q[other, k], v - state.v[other, k]
                else:
                    x -= state.obstacle_position[other - n - 1, k]
                square += x * x
                approach -= x * v
            if square < radius * radius:
                distance = math.sqrt(square)
                speed = approach / distance if distance > 0.0 else 0.0
                touch(state, state.time[0], other, i, 0.0, radius - distance, speed)
    settle(state, state.time[0], plan.timestep)


@on_demand
def touch_what_stands(plan: Plan, state: State, target_radius: float) -> None:
    """Notes the obstacles at rest that a led target overlaps: MuJoCo never lets a mocap body meet these.

    Contacts without force, between `begin` and `settle`.

    Args:
        plan: Gives obstacles and drives.
        state: The target and what it sees of obstacles are read, the log of touches is written.
        target_radius: [m].
    """
    n, m = state.q.shape[0], plan.obstacle_radius.shape[0]
    seen = obstacles_seen(n, plan, state)
    for j in range(m):
        driven = False
        for b in range(plan.mover_obstacle.shape[0]):
            driven = driven or plan.mover_obstacle[b] == float(j)
        if driven:
            continue
        square, approach, fast = 0.0, 0.0, 0.0
        for k in range(state.q.shape[1]):
            x, v = state.target_position[k] - seen[j, k], state.target_velocity[k]
            square += x * x
            approach -= x * v
            fast += v * v
        distance = math.sqrt(square)
        gap = state.obstacle_gap[n * m + j] if plan.shaped else distance - plan.obstacle_radius[j]
        if gap < target_radius:  # a center inside a shape is itself what it sees: nothing tells the normal
            speed = approach / distance if distance > 0.0 else math.sqrt(fast)
            touch(state, state.time[0], n, n + 1 + j, 0.0, target_radius - gap, speed)
