"""What a behavior asks of eight robots at once, and the vector arithmetic that their kernels share.

Lanes stand for robots i to i + 7, rows of scratch for axes. A kernel of a behavior writes the directions x of
its task and the velocity that it wishes for, and returns a `Wish`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.knowledge.belief import target_rows
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import (
    Lanes,
    everywhere,
    greatest,
    least,
    load,
    load_rows,
    pick,
    root,
    row_of,
    set_row,
    stack_rows,
    there,
    where,
)
from escort_mj.plan import Plan, State

Array = NDArray[np.float64]

MAX_DIRECTIONS = 2  # of a task: chords in space keep two distances
MAX_LEVELS = 8  # behaviors by priority that a mission or a phase may have


class Wish(NamedTuple):
    """A task of robots i to i + 7; 1 and 0 in lanes stand for true and false.

    Attributes:
        directions: How many directions x it takes: 1 or 2.
        weight: 1 / |x|^2 of the first; 0 where the task takes nothing [1/m^2].
        second: 1 / |x|^2 of the second.
        across: Where it takes all directions but x.
        active: Where it asks for anything.
        error: How far it is from done [m].
    """

    directions: int
    weight: Lanes
    second: Lanes
    across: Lanes
    active: Lanes
    error: Lanes


@inlined
def along(weight: Lanes, active: Lanes, error: Lanes) -> Wish:
    """A task along one direction."""
    return Wish(1, weight, everywhere(0.0), everywhere(0.0), active, error)


@inlined
def across(weight: Lanes, error: Lanes) -> Wish:
    """A task in all directions but one."""
    return Wish(1, weight, everywhere(0.0), everywhere(1.0), everywhere(1.0), error)


@inlined
def look_at_point(i: int, q: Array, point: Array, x: Array) -> None:
    """Writes x = q - point, with rows for axes; 0 in lanes past the last robot.

    Args:
        i: First robot, from 0.
        q: Positions, shape (n, p) [m].
        point: Shape (p,) [m].
        x: Result, in the first p rows [m].
    """
    n, p = q.shape
    here = stack_rows(p)
    load_rows(q, i, here)
    for k in range(p):
        set_row(x, k, where(there(n - i), row_of(here, k) - point[k], 0.0))


@inlined
def look_at_target(i: int, plan: Plan, state: State, x: Array) -> None:
    """Writes x = q - c, with c where each robot believes the target to be; 0 in lanes past the last robot.

    Args:
        i: First robot, from 0.
        plan: Says whether robots have targets each by itself.
        state: Gives measured positions and the target.
        x: Result, in the first p rows [m].
    """
    p = state.q.shape[1]
    if not plan.apart:
        look_at_point(i, state.q_measured, state.target_position_measured, x)
        return
    here, center = stack_rows(p), stack_rows(p)
    load_rows(state.q_measured, i, here)
    target_rows(i, plan, state, center)
    for k in range(p):
        set_row(x, k, where(there(state.q.shape[0] - i), row_of(here, k) - row_of(center, k), 0.0))


@inlined
def look_at_others(i: int, q: Array, others: Array, x: Array, first: int) -> None:
    """Writes x = q_i - q_j, each robot as seen from another one, to the rows of x from the first one on.

    Args:
        i: First robot, from 0.
        q: Positions, shape (n, p) [m].
        others: The robot j of each robot, shape (n,).
        x: Result [m].
        first: Row of the first axis.
    """
    n, p = q.shape
    here, seen = stack_rows(p), float(p) * least(greatest(load(others, i), 0.0), float(n - 1))
    load_rows(q, i, here)
    for k in range(p):
        way = row_of(here, k) - pick(q, seen + float(k))
        set_row(x, first + k, where(there(n - i), way, 0.0))


@inlined
def square_of(rows: Array, first: int, p: int) -> Lanes:
    """Squared lengths of the vectors in p rows of lanes."""
    square = everywhere(0.0)
    for k in range(first, first + p):
        square = square + row_of(rows, k) * row_of(rows, k)
    return square


@inlined
def keep_distance(
    p: int, distance: Lanes | float, gain: float, x: Array, first: int, wish: Array, at: int
) -> tuple[Lanes, Lanes]:
    """Velocity of the task sigma~ = (d^2 - |x|^2) / 2 with J = x^T (eqs. 4, 5): x Lambda sigma~ / |x|^2.

    Args:
        p: Number of axes.
        distance: d [m].
        gain: Lambda [1/s].
        x: Where the robots are, as seen from what they keep the distance to [m].
        first: Row of x of the first axis.
        wish: Result: the velocity [m/s].
        at: Row of it of the first axis.

    Returns:
        1 / |x|^2, 0 where x is 0 [1/m^2]; and |x| - d [m].
    """
    square = square_of(x, first, p)
    weight = where(square > 0.0, 1.0 / square, 0.0)
    speed = gain * 0.5 * (distance * distance - square) * weight
    for k in range(p):
        set_row(wish, at + k, speed * row_of(x, first + k))
    return weight, root(square) - distance
