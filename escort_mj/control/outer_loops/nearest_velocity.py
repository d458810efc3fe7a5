"""The nearest velocity within half-spaces r . v >= b, by a quadratic program with slacks."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.outer_loops.passing import turn
from escort_mj.native.kernels import DOUBLE, inlined, matrix_at, stack_memory, vector_at
from escort_mj.numerics.vectors import length_of

Array = NDArray[np.float64]

STIFFNESS = 1e4  # weight of a violated constraint against the change of velocity: violations of 1e-4 of it
MOST_STEPS = 60  # of the minimization; a handful is needed
HALVINGS = 40
CLOSE = 1e-13  # of the velocities involved: a step that changes nothing
MOST_SOFTENINGS = 40  # of the search for the speed limit; three to ten are needed
SLACK = 1e-2  # share of the change of velocity by which constraints are broken that no velocity satisfies
LEAST_WEIGHT = 0.1  # of what is far, against what is a tenth as far and nearer
AT_LIMIT = 1e-11  # share of the limit by which what is found may miss it


@inlined
def nearest_velocity(rows: Array, bounds: Array, count: int, stiffness: float, v: Array) -> bool:
    """Move a velocity to the nearest one that satisfies all constraints r . v >= b.

    Minimizes |v - v_nominal|^2 / 2 + stiffness / 2 sum_j max(0, b_j - r_j . v)^2, a quadratic program with
    one slack per constraint: where constraints contradict each other, the sum of the squared violations is
    least. The function is convex and piecewise quadratic: Newton's method with a line search ends after about
    as many steps as the set of violated constraints changes.

    Args:
        rows: Unit vectors r, shape (at least count, p).
        bounds: b [m/s].
        count: Number of constraints.
        stiffness: Weight of violations, `STIFFNESS` where they are to be as small as they can.
        v: The nominal velocity, shape (p,) [m/s]; changed in place.

    Returns:
        Whether it had to move.
    """
    only, number = -1, 0
    for j in range(count):
        if speed_along(rows, j, v) < bounds[j]:
            only, number = j, number + 1
    if number == 0:
        return False
    if number == 1 and _yield_to(only, rows, bounds, count, stiffness, v):
        return True
    _minimize(rows, bounds, count, stiffness, v)
    return True


@inlined
def _minimize(rows: Array, bounds: Array, count: int, stiffness: float, v: Array) -> None:
    """Move a velocity as `nearest_velocity` does, where rows may be of any length."""
    p = v.shape[0]
    memory = stack_memory()
    nominal = vector_at(memory, p)
    gradient = vector_at(memory + DOUBLE * p, p)
    step = vector_at(memory + DOUBLE * 2 * p, p)
    trial = vector_at(memory + DOUBLE * 3 * p, p)
    hessian = matrix_at(memory + DOUBLE * 4 * p, p, p)
    scale = 0.0
    for k in range(p):
        nominal[k] = v[k]
        scale += abs(v[k])
    for _ in range(MOST_STEPS):
        cost = _cost(rows, bounds, count, stiffness, nominal, v)
        _differentiate(rows, bounds, count, stiffness, nominal, v, gradient, hessian)
        largest, slope = 0.0, 0.0
        _solve(hessian, gradient, step)
        for k in range(p):
            largest = max(largest, abs(step[k]))
            slope -= gradient[k] * step[k]
            scale = max(scale, abs(v[k]))
        if largest <= CLOSE * scale:
            break
        share = 1.0
        for _halving in range(HALVINGS):
            for k in range(p):
                trial[k] = v[k] - share * step[k]
            better = _cost(rows, bounds, count, stiffness, nominal, trial)
            if better <= cost + 1e-4 * share * slope + 1e-14 * cost:
                break
            share *= 0.5
        for k in range(p):
            v[k] = trial[k]


@inlined
def _yield_to(only: int, rows: Array, bounds: Array, count: int, stiffness: float, v: Array) -> bool:
    """Move a velocity to the nearest one that satisfies one constraint, unless that breaks another."""
    p = v.shape[0]
    change = (bounds[only] - speed_along(rows, only, v)) * stiffness / (1.0 + stiffness)
    for k in range(p):
        v[k] += change * rows[only, k]
    for j in range(count):
        if j != only and speed_along(rows, j, v) < bounds[j]:
            for k in range(p):
                v[k] -= change * rows[only, k]
            return False
    return True


@inlined
def keep_limit(rows: Array, bounds: Array, count: int, most: float, v: Array) -> bool:
    """Bring a velocity that satisfies constraints within a speed limit without breaking them, if it can be.

    It goes straight toward the slowest velocity that satisfies them: all in between do, too. A body that
    comes nearer asks for speed away from it; slowing down along the same direction would take that away.

    Args:
        rows: Unit vectors r, shape (at least count, p).
        bounds: b [m/s].
        count: Number of constraints.
        most: The limit [m/s].
        v: Velocity, shape (p,) [m/s]; changed in place.

    Returns:
        Whether some velocity within the limit satisfies them; if not, v is as it was.
    """
    p = v.shape[0]
    if not length_of(v) > most:
        return True
    slowest = vector_at(stack_memory(), p)
    for k in range(p):
        slowest[k] = 0.0
    nearest_velocity(rows, bounds, count, STIFFNESS, slowest)
    return _slow_down(most, slowest, v)


@inlined
def contradict(rows: Array, bounds: Array, count: int, nominal: Array, v: Array) -> bool:
    """Return whether no velocity satisfies all constraints, v being the one nearest to a nominal one."""
    worst = square = 0.0
    for k in range(v.shape[0]):
        square += (v[k] - nominal[k]) ** 2
    for j in range(count):
        worst = max(worst, bounds[j] - speed_along(rows, j, v))
    return worst > SLACK * math.sqrt(square)


@inlined
def break_least(
    rows: Array, bounds: Array, gaps: Array, count: int, near: float, most: float, v: Array
) -> None:
    """Move a velocity to the one within a speed limit that breaks constraints least, near ones least of all.

    The sum of the squared violations is least, each divided by the time in which the body could touch the
    robot. That is what `nearest_velocity` makes of rest with the stiffness, a Lagrange multiplier, that leads
    to the limit: 1 / |v| is nearly linear in 1 / stiffness (More, Sorensen 1983).

    Args:
        rows: Unit vectors r, shape (at least count, p); used up.
        bounds: b [m/s]; used up.
        gaps: How far the robot goes, at its speed limit, before each body could touch it [m].
        count: Number of constraints.
        near: Gap from which on all weigh the same [m].
        most: The limit [m/s].
        v: The nominal velocity, shape (p,) [m/s]; changed in place.
    """
    p = v.shape[0]
    slowest, soft, low, high = vector_at(stack_memory(), p), 1.0 / STIFFNESS, 1.0 / STIFFNESS, 0.0
    for j in range(count):
        weight = LEAST_WEIGHT * min(max(near / max(gaps[j], 1e-300), 1.0), 1.0 / LEAST_WEIGHT)
        bounds[j] *= weight
        high += (max(bounds[j], 0.0) / most) ** 2
        for k in range(p):
            rows[j, k] *= weight
    _minimize(rows, bounds, count, STIFFNESS, v)
    if not length_of(v) > most:
        return
    before = inverse = 0.0
    for step in range(MOST_SOFTENINGS):
        for k in range(p):
            slowest[k] = 0.0
        _minimize(rows, bounds, count, 1.0 / soft, slowest)
        length = length_of(slowest)
        if step == 0 and _slow_down(most, slowest, v):
            return
        if abs(length - most) <= AT_LIMIT * most:
            break
        slope = 1.0 / (length * (1.0 + soft)) if step == 0 else (1.0 / length - inverse) / (soft - before)
        before, inverse = soft, 1.0 / length
        low, high = (soft, high) if length > most else (low, soft)
        soft += (1.0 / most - inverse) / slope
        if not low < soft < high:
            soft = 0.5 * (low + high)
    for k in range(p):
        v[k] = slowest[k] * (most / length_of(slowest))


@inlined
def _slow_down(most: float, slowest: Array, v: Array) -> bool:
    """Bring a velocity within a limit on the straight way to the slowest one, unless that is above it."""
    length = length_of(slowest)
    if length > most:
        return False
    share = _share_within(length, most, slowest, v)
    for k in range(v.shape[0]):
        v[k] = slowest[k] + share * (v[k] - slowest[k])
    return True


@inlined
def _share_within(least: float, most: float, slowest: Array, v: Array) -> float:
    """Return how far the way from the slowest velocity to v can be gone within the limit, from 0 to 1."""
    along = square = 0.0
    for k in range(v.shape[0]):
        along += slowest[k] * (v[k] - slowest[k])
        square += (v[k] - slowest[k]) ** 2
    room = most * most - least * least
    if room <= 0.0 or square == 0.0:
        return 0.0
    return (math.sqrt(along * along + square * room) - along) / square


@inlined
def step_aside(share: float, rows: Array, bounds: Array, count: int, speed: float, v: Array) -> None:
    """Add a velocity across the constraint that is violated most, where what is wanted runs straight into it.

    What is wanted across it is filled up to a share of what it blocks, counterclockwise (remark 6).
    """
    p, worst, blocked = v.shape[0], -1, 0.0
    for j in range(count):
        missing = bounds[j] - speed_along(rows, j, v)
        if missing > blocked:
            worst, blocked = j, missing
    if worst < 0 or share == 0.0:
        return
    along = speed_along(rows, worst, v)
    add = share * blocked - math.sqrt(max(speed * speed - along * along, 0.0))
    if add > 0.0:
        tangent = vector_at(stack_memory(), p)
        turn(rows[worst], tangent)
        for k in range(p):
            v[k] += add * tangent[k]


@inlined
def speed_along(rows: Array, j: int, v: Array) -> float:
    """Return r . v for the row r of a constraint [m/s]."""
    along = 0.0
    for k in range(v.shape[0]):
        along += rows[j, k] * v[k]
    return along


@inlined
def _cost(rows: Array, bounds: Array, count: int, stiffness: float, nominal: Array, v: Array) -> float:
    """Return what `nearest_velocity` minimizes."""
    cost = 0.0
    for k in range(v.shape[0]):
        cost += 0.5 * (v[k] - nominal[k]) ** 2
    for j in range(count):
        missing = bounds[j] - speed_along(rows, j, v)
        if missing > 0.0:
            cost += 0.5 * stiffness * missing * missing
    return cost


@inlined
def _differentiate(
    rows: Array, bounds: Array, count: int, stiffness: float, nominal: Array, v: Array,
    gradient: Array, hessian: Array,
) -> None:  # fmt: skip
    """Write the derivatives of that, shapes (p,) and (p, p)."""
    p = v.shape[0]
    for k in range(p):
        gradient[k] = v[k] - nominal[k]
        for column in range(p):
            hessian[k, column] = 1.0 if k == column else 0.0
    for j in range(count):
        missing = bounds[j] - speed_along(rows, j, v)
        if missing <= 0.0:
            continue
        for k in range(p):
            gradient[k] -= stiffness * missing * rows[j, k]
            for column in range(p):
                hessian[k, column] += stiffness * rows[j, k] * rows[j, column]


@inlined
def _solve(a: Array, b: Array, x: Array) -> None:
    """Solves a x = b for a symmetric positive definite matrix, which is used up; shape (p, p)."""
    p = b.shape[0]
    for k in range(p):
        x[k] = b[k]
    for k in range(p):
        for i in range(k + 1, p):
            factor = a[i, k] / a[k, k]
            x[i] -= factor * x[k]
            for j in range(k, p):
                a[i, j] -= factor * a[k, j]
    for back in range(p):
        k = p - 1 - back
        for j in range(k + 1, p):
            x[k] -= a[k, j] * x[j]
        x[k] /= a[k, k]
