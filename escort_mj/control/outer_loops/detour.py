"""Detours: a robot that is blocked follows the boundary of what blocks it, until its way is free again.

The rule is that of the Bug algorithms (Lumelsky, Stepanov 1987; Kamon, Rimon, Rivlin 1998), for velocities
and for robots that know only what they see. A robot is blocked when its constraints leave less than ENTER of
the velocity that its behaviors want, for as long as its patience lasts. It then turns from the direction into
the most binding constraint, counterclockwise in the plane of the first two axes, to the first direction in
which its speed is allowed, or half of it, or FREE. It leaves the boundary when LEAVE of the wanted velocity
is allowed and it has got further along the wanted direction than where it was blocked, or has followed
nothing but teammates, which have no corners that could lead it back. After some time it
turns around, and after twice as long again: the way to an unknown end of the boundary is then at most nine
times the shortest (Baeza-Yates, Culberson, Rawlins 1993). Teammates that follow the same target get out of
the way by themselves: only those with goals of their own are followed around.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.outer_loops.nearest_velocity import speed_along
from escort_mj.control.outer_loops.passing import turn
from escort_mj.native.fields import Array as Field
from escort_mj.native.fields import Fields, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.vectors import Vec, numbers_at, zero_like
from escort_mj.plan import State

Array = NDArray[np.float64]

ENTER, LEAVE, FREE = 0.2, 0.6, 0.25  # shares of the wanted speed
ANYWHERE = 1e6  # progress of a detour around teammates alone, which may end anywhere [m]
DIRECTIONS = 72  # that a robot looks at, of a full turn
NAMES = "detour", "detour_for", "detour_progress", "detour_limit"
HALVINGS = 30  # of the step to the first one that is free


class DetourState(Fields):
    """Where each robot is in its detour."""

    detour: Annotated[Field, "n", Value("1", "1 counterclockwise, -1 clockwise, 0 for none")]
    detour_time: Annotated[Field, "n", Value("s", "time of the last update")]
    detour_for: Annotated[Field, "n", Value("s", "since it began, or while it is none, blocked since")]
    detour_progress: Annotated[Field, "n", Value("m", "way along the wanted direction since it began")]
    detour_limit: Annotated[Field, "n", Value("s", "time after which the robot turns around")]
    detour_near: Annotated[Field, "n", Value("1", "whether a constraint may bind")]


class Detour(NamedTuple):
    """One robot's row of `DetourState`."""

    side: float
    held: float
    progress: float
    limit: float


@inlined
def next_detour(
    before: Detour, elapsed: float, moved: bool, share: float, advance: float, near: float, patience: float,
    turn_back: float,
) -> Detour:  # fmt: skip
    """Decide whether a robot is on a detour.

    Args:
        before: What it was at the last update.
        elapsed: Time since then [s].
        moved: Whether constraints change what it wants.
        share: Share of the wanted velocity that they leave.
        advance: Measured speed along the wanted direction [m/s].
        near: 1 where an obstacle, the target or a failed robot can bind at its speed, less where only
            teammates with goals of their own can, 0 where nothing is followed around.
        patience: For how long a robot may be blocked [s].
        turn_back: After what time it first turns around [s].
    """
    if before.side == 0.0:
        held = before.held + elapsed if moved and near > 0.0 and share < ENTER else 0.0
        if held <= patience:
            return Detour(0.0, held, 0.0, before.limit)
        return Detour(1.0, 0.0, 0.0 if near == 1.0 else ANYWHERE, max(turn_back, before.limit))
    anywhere = near < 1.0 and before.progress == ANYWHERE
    start = 0.0 if before.progress == ANYWHERE else before.progress
    held, progress = before.held + elapsed, ANYWHERE if anywhere else start + elapsed * advance
    if near == 0.0 or (share >= LEAVE and progress > 0.0):
        return Detour(0.0, 0.0, 0.0, before.limit)
    if held > before.limit:
        return Detour(-before.side, 0.0, ANYWHERE if anywhere else 0.0, 2.0 * before.limit)
    return Detour(before.side, held, progress, before.limit)


@inlined
def follow_boundary(
    side: float, speed: float, rows: Array, bounds: Array, cooperation: Array, count: int, v: Vec
) -> Vec:
    """Return the velocity along the boundary of the most binding constraint; rest where no direction is free.

    Args:
        side: 1 counterclockwise, -1 clockwise.
        speed: Wanted [m/s].
        rows: Unit vectors r of the constraints r . v >= b, shape (at least count, p).
        bounds: b [m/s].
        cooperation: See `find_constraints`; what is 1 is not followed around.
        count: Number of constraints.
        v: What is wanted [m/s].
    """
    binding = -1
    for j in range(count):
        if cooperation[j] < 1.0 and (binding < 0 or bounds[j] > bounds[binding]):
            binding = j
    into, share = numbers_at(v, rows, binding), 1.0
    tangent = turn(into)
    while share >= FREE:
        for step in range(1, DIRECTIONS):
            free = step * (2.0 * math.pi / DIRECTIONS)
            if not _is_free(_toward(side * free, share * speed, into, tangent), rows, bounds, count):
                continue
            blocked = free - 2.0 * math.pi / DIRECTIONS
            for _ in range(HALVINGS):
                middle = 0.5 * (blocked + free)
                if _is_free(_toward(side * middle, share * speed, into, tangent), rows, bounds, count):
                    free = middle
                else:
                    blocked = middle
            return _toward(side * free, share * speed, into, tangent)
        share *= 0.5
    return zero_like(v)


@inlined
def _toward(angle: float, speed: float, into: Vec, tangent: Vec) -> Vec:
    """Return a velocity by its angle from straight into a constraint [m/s]."""
    return speed * (math.sin(angle) * tangent - math.cos(angle) * into)


@inlined
def _is_free(v: Vec, rows: Array, bounds: Array, count: int) -> bool:
    """Whether all constraints allow a velocity."""
    for j in range(count):
        if speed_along(rows, j, v) < bounds[j]:
            return False
    return True


@inlined
def detour_of(robot: int, state: State) -> Detour:
    """Return a robot's row of the state."""
    return Detour(
        state.detour[robot],
        state.detour_for[robot],
        state.detour_progress[robot],
        state.detour_limit[robot],
    )


@inlined
def keep_detour(robot: int, found: Detour, state: State) -> None:
    """Write a robot's row of the state."""
    state.detour[robot] = found.side
    state.detour_for[robot] = found.held
    state.detour_progress[robot] = found.progress
    state.detour_limit[robot] = found.limit
