"""The nearest velocity within half-spaces r . v >= b, by a quadratic program with slacks."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.outer_loops.passing import turn
from escort_mj.native.kernels import inlined, matrix_at, stack_memory, vector_at
from escort_mj.native.vectors import (
    Vec,
    dot,
    norm,
    numbers_at,
    numbers_from,
    set_numbers,
    set_numbers_at,
    unit_axis,
    zero_like,
)

Array = NDArray[np.float64]

STIFFNESS = 1e4  # penalty weight of violations against the change of velocity: violations of 1e-4 of it
MOST_STEPS = 60  # of the minimization; a handful is needed
HALVINGS = 40  # of the step of the line search
CLOSE = 1e-13  # of the velocities involved: a step that changes nothing
MOST_SOFTENINGS = 40  # of the search for the speed limit; three to ten are needed
INFEASIBLE = 1e-2  # violation, as a share of the change of velocity, from which on no velocity satisfies all
LEAST_WEIGHT = 0.1  # of gaps of the scale and more; nearer ones weigh up to 1
AT_LIMIT = 1e-11  # share of the limit by which what is found may miss it


@inlined
def nearest_velocity(rows: Array, bounds: Array, count: int, stiffness: float, v: Vec) -> tuple[bool, Vec]:
    """Find the velocity nearest to a nominal one that satisfies all constraints r . v >= b.

    Minimizes |v - v_nominal|^2 / 2 + stiffness / 2 sum_j max(0, b_j - r_j . v)^2, a quadratic program with
    one slack per constraint: where constraints contradict each other, the sum of the squared violations is
    least. The function is convex and piecewise quadratic: Newton's method with a line search ends after about
    as many steps as the set of violated constraints changes.

    Args:
        rows: Unit vectors r, shape (at least count, p).
        bounds: b [m/s].
        count: Number of constraints.
        stiffness: Weight of violations, `STIFFNESS` where they are to be as small as they can.
        v: The nominal velocity [m/s].

    Returns:
        Whether it is another one, and the nearest one [m/s].
    """
    only, number = -1, 0
    for j in range(count):
        if speed_along(rows, j, v) < bounds[j]:
            only, number = j, number + 1
    if number == 0:
        return False, v
    if number == 1:
        r = numbers_at(v, rows, only)
        change = (bounds[only] - dot(r, v)) * stiffness / (1.0 + stiffness)
        if not _is_broken(rows, bounds, count, only, v + change * r):
            return True, v + change * r
    return True, _minimize(rows, bounds, count, stiffness, v)


@inlined
def _is_broken(rows: Array, bounds: Array, count: int, but: int, v: Vec) -> bool:
    """Whether a velocity breaks a constraint other than one."""
    for j in range(count):
        if j != but and speed_along(rows, j, v) < bounds[j]:
            return True
    return False


@inlined
def _minimize(rows: Array, bounds: Array, count: int, stiffness: float, nominal: Vec) -> Vec:
    """Return the velocity that `nearest_velocity` finds, where rows may be of any length."""
    p, v, square = len(nominal), nominal, dot(nominal, nominal)
    hessian = matrix_at(stack_memory(), p, p)
    for _ in range(MOST_STEPS):
        cost = _cost(rows, bounds, count, stiffness, nominal, v)
        gradient = _differentiate(rows, bounds, count, stiffness, nominal, v, hessian)
        step = _solution(hessian, gradient)
        slope, square = dot(gradient, step), max(square, dot(v, v))
        if dot(step, step) <= CLOSE * CLOSE * square:
            break
        length, trial = 1.0, v
        for _halving in range(HALVINGS):
            trial = v - length * step
            better = _cost(rows, bounds, count, stiffness, nominal, trial)
            if better <= cost - 1e-4 * length * slope + 1e-14 * cost:
                break
            length *= 0.5
        v = trial
    return v


@inlined
def keep_limit(rows: Array, bounds: Array, count: int, most: float, v: Vec) -> tuple[bool, Vec]:
    """Bring a velocity that satisfies constraints within a speed limit without breaking them, if it can be.

    It goes straight toward the slowest velocity that satisfies them: all in between do, too. A body that
    comes nearer asks for speed away from it; slowing down along the same direction would take that away.

    Args:
        rows: Unit vectors r, shape (at least count, p).
        bounds: b [m/s].
        count: Number of constraints.
        most: The limit [m/s].
        v: Velocity [m/s].

    Returns:
        Whether some velocity within the limit satisfies them, and it; if none does, v as it was [m/s].
    """
    if not norm(v) > most:
        return True, v
    _, slowest = nearest_velocity(rows, bounds, count, STIFFNESS, zero_like(v))
    return _slow_down(most, slowest, v)


@inlined
def contradict(rows: Array, bounds: Array, count: int, nominal: Vec, v: Vec) -> bool:
    """Return whether no velocity satisfies all constraints, v being the one nearest to a nominal one."""
    worst = 0.0
    for j in range(count):
        worst = max(worst, bounds[j] - speed_along(rows, j, v))
    return worst > INFEASIBLE * norm(v - nominal)


@inlined
def break_least(
    rows: Array, bounds: Array, gaps: Array, count: int, scale: float, most: float, v: Vec
) -> Vec:  # fmt: skip
    """Find the velocity within a speed limit that breaks constraints least, of near bodies least of all.

    The sum of the squared violations is least, each divided by the time in which the body could touch the
    robot. That is the program of `nearest_velocity` with the nominal velocity 0 and the penalty weight, a
    Lagrange multiplier, at which |v| is the limit: 1 / |v| is nearly linear in 1 / weight (More, Sorensen
    1983).

    Args:
        rows: Unit vectors r, shape (at least count, p); used up.
        bounds: b [m/s]; used up.
        gaps: How far the robot goes, at its speed limit, before each body could touch it [m].
        count: Number of constraints.
        scale: Gap from which on all weigh the same [m].
        most: The limit [m/s].
        v: The nominal velocity, where the search begins: it counts only if what it leads to is slow enough
            [m/s].
    """
    soft, low, high, rest = 1.0 / STIFFNESS, 1.0 / STIFFNESS, 0.0, zero_like(v)
    for j in range(count):
        weight = LEAST_WEIGHT * min(max(scale / max(gaps[j], 1e-300), 1.0), 1.0 / LEAST_WEIGHT)
        bounds[j] *= weight
        high += (max(bounds[j], 0.0) / most) ** 2  # bounds 1 / weight from above
        set_numbers_at(rows, j, weight * numbers_at(v, rows, j))
    v = _minimize(rows, bounds, count, STIFFNESS, v)
    if not norm(v) > most:
        return v
    before = inverse = 0.0
    slowest = rest
    for step in range(MOST_SOFTENINGS):
        slowest = _minimize(rows, bounds, count, 1.0 / soft, rest)
        length = norm(slowest)
        if step == 0:
            kept, v = _slow_down(most, slowest, v)
            if kept:
                return v
        if abs(length - most) <= AT_LIMIT * most:
            break
        slope = 1.0 / (length * (1.0 + soft)) if step == 0 else (1.0 / length - inverse) / (soft - before)
        before, inverse = soft, 1.0 / length
        low, high = (soft, high) if length > most else (low, soft)
        soft += (1.0 / most - inverse) / slope
        if not low < soft < high:
            soft = 0.5 * (low + high)
    return (most / norm(slowest)) * slowest


@inlined
def _slow_down(most: float, slowest: Vec, v: Vec) -> tuple[bool, Vec]:
    """Bring a velocity within a limit on the straight way to the slowest one, unless that is above it."""
    length = norm(slowest)
    if length > most:
        return False, v
    return True, slowest + _blend_within(length, most, slowest, v) * (v - slowest)


@inlined
def _blend_within(least: float, most: float, slowest: Vec, v: Vec) -> float:
    """Return how far the way from the slowest velocity to v can be gone within the limit, from 0 to 1."""
    way, room = v - slowest, most * most - least * least
    along, square = dot(slowest, way), dot(way, way)
    if room <= 0.0 or square == 0.0:
        return 0.0
    return (math.sqrt(along * along + square * room) - along) / square


@inlined
def step_aside(ratio: float, rows: Array, bounds: Array, count: int, speed: float, v: Vec) -> Vec:
    """Add a velocity across the constraint that is violated most, so that robots do not stop in front of it.

    If the speed across it is less than a ratio of the violation, what is missing is added counterclockwise
    (remark 6).
    """
    worst, blocked = -1, 0.0
    for j in range(count):
        missing = bounds[j] - speed_along(rows, j, v)
        if missing > blocked:
            worst, blocked = j, missing
    if worst < 0 or ratio == 0.0:
        return v
    along = speed_along(rows, worst, v)
    add = ratio * blocked - math.sqrt(max(speed * speed - along * along, 0.0))
    return v + add * turn(numbers_at(v, rows, worst)) if add > 0.0 else v


@inlined
def speed_along(rows: Array, j: int, v: Vec) -> float:
    """Return r . v for the row r of a constraint [m/s]."""
    along: float = dot(numbers_at(v, rows, j), v)
    return along


@inlined
def _cost(rows: Array, bounds: Array, count: int, stiffness: float, nominal: Vec, v: Vec) -> float:
    """Return what `nearest_velocity` minimizes."""
    cost: float = 0.5 * dot(v - nominal, v - nominal)
    for j in range(count):
        missing = bounds[j] - speed_along(rows, j, v)
        if missing > 0.0:
            cost += 0.5 * stiffness * missing * missing
    return cost


@inlined
def _differentiate(
    rows: Array, bounds: Array, count: int, stiffness: float, nominal: Vec, v: Vec, hessian: Array
) -> Vec:
    """Return the gradient of that, and write the second derivatives, shape (p, p)."""
    gradient = v - nominal
    for a in range(len(v)):
        set_numbers_at(hessian, a, unit_axis(v, a))
    for j in range(count):
        r = numbers_at(v, rows, j)
        missing = bounds[j] - dot(r, v)
        if missing <= 0.0:
            continue
        gradient = gradient - stiffness * missing * r
        for a in range(len(v)):
            set_numbers_at(hessian, a, numbers_at(v, hessian, a) + stiffness * rows[j, a] * r)
    return gradient


@inlined
def _solution(a: Array, b: Vec) -> Vec:
    """Return x of a x = b for a symmetric positive definite matrix, which is used up; shape (p, p)."""
    p = len(b)
    x = vector_at(stack_memory(), p)
    set_numbers(x, 0, b)
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
    return numbers_from(b, x, 0)
