"""Tasks: what a behavior asks of each robot, and what that leaves to behaviors of lower priority.

A task of eight robots at once is one value. Its task functions have Jacobians of one row, the gradient x, so
that the pseudoinverse is x / |x|^2 and the null-space projector I - x x^T / |x|^2: dot products are enough.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import Lanes, everywhere, gather, greatest, root, scatter
from escort_mj.native.vectors import Vec, dot, norm, rows_at, set_rows, where

MAX_DIRECTIONS = 2  # of a task: chords in space keep two distances
MAX_LEVELS = 8  # behaviors by priority that a mission or a phase may have
WEIGHT, OTHER_WEIGHT, DIRECTIONS, ACROSS, ACTIVE, ERROR, VALUE, LEAST_RATE, SIDESTEP = range(9)
TRAITS = 9  # numbers of a task beside its vectors, at these places


class Task(NamedTuple):
    """What a behavior asks of robots i to i + 7; 1 and 0 in lanes stand for true and false.

    Attributes:
        velocity: What the robot is to do; 0 where the task is inactive [m/s].
        x: Gradient of the task function.
        weight: 1 / |x|^2; 0 where the task takes nothing [1/m^2].
        other: Gradient of a second task function, where there are two.
        other_weight: 1 / |x|^2 of it.
        directions: How many task functions there are: 1 or 2.
        across: Where it takes all directions but x.
        active: Where it asks for anything.
        error: How far it is from done [m].
        value: The task function, for checks of its gradient.
        least_rate: Of an inequality, the least rate of its function that is allowed.
        sidestep: Share of the blocked speed with which robots go around what they meet; 0 for none.
    """

    velocity: Vec
    x: Vec
    weight: Lanes
    other: Vec
    other_weight: Lanes
    directions: int
    across: Lanes
    active: Lanes
    error: Lanes
    value: Lanes
    least_rate: Lanes
    sidestep: float


class Inequality(NamedTuple):
    """A function of the position that is to stay above a bound, see `at_least`.

    Attributes:
        value: The function.
        bound: What it is not to fall below.
        x: Its gradient, not 0.
        rate: Share of what is left above the bound that a robot may use up per second [1/s].
    """

    value: Lanes
    bound: Lanes | float
    x: Vec
    rate: Lanes | float


@inlined
def along(
    x: Vec, weight: Lanes, velocity: Vec, active: Lanes, error: Lanes, value: Lanes, sidestep: float = 0.0
) -> Task:  # fmt: skip
    """A task along one direction: it takes x alone."""
    nothing = everywhere(0.0)
    return Task(velocity, x, weight, x, nothing, 1, nothing, active, error, value, nothing, sidestep)


@inlined
def keep(value: Lanes, wanted: Lanes | float, x: Vec, gain: float) -> Task:
    """Keep a function of the position at a value, which the behavior's frame carries along.

    The velocity is x Lambda (wanted - value) / |x|^2.

    Args:
        value: The task function.
        wanted: Its value when the task is done.
        x: Its gradient with respect to the position.
        gain: Lambda [1/s].
    """
    weight, off = inverse_square(x), wanted - value
    velocity = (gain * off * weight) * x
    return along(x, weight, velocity, everywhere(1.0), abs(off) * root(weight), value)


@inlined
def keep_distance(x: Vec, distance: Lanes | float, gain: float) -> Task:
    """Keep a distance d: sigma = |x|^2 / 2 is to become d^2 / 2 (eqs. 4, 5), with x relative to what moves.

    Args:
        x: Where robots are, as seen from what they keep the distance to [m].
        distance: d [m].
        gain: Lambda [1/s].
    """
    square = dot(x, x)
    weight = where(square > 0.0, 1.0 / square, 0.0)
    velocity = (gain * 0.5 * (distance * distance - square) * weight) * x
    return along(x, weight, velocity, everywhere(1.0), abs(root(square) - distance), 0.5 * square)


@inlined
def across(x: Vec, velocity: Vec, error: Lanes) -> Task:
    """A task in all directions but one, which the velocity has no part of: it leaves x alone."""
    nothing, on = everywhere(0.0), everywhere(1.0)
    return Task(
        velocity, x, inverse_square(x), x, nothing, 1, on, on, error, nothing, nothing, 0.0
    )  # fmt: skip


@inlined
def move(velocity: Vec, active: Lanes, error: Lanes) -> Task:
    """A task in all directions, of those robots for which it is active; it asks nothing of others."""
    nothing, velocity = everywhere(0.0), where(active > 0.0, velocity, 0.0)
    return Task(
        velocity, velocity, nothing, velocity, nothing, 1, active, active, error, nothing, nothing, 0.0
    )  # fmt: skip


@inlined
def both(first: Task, second: Task) -> Task:
    """Two tasks along one direction each, at one level: their velocities add up."""
    error = root(0.5 * (first.error * first.error + second.error * second.error))
    return Task(
        first.velocity + second.velocity, first.x, first.weight, second.x, second.weight, MAX_DIRECTIONS,
        everywhere(0.0), everywhere(1.0), error, first.value, everywhere(0.0), 0.0,
    )  # fmt: skip


@inlined
def only(condition: Any, task: Task) -> Task:
    """Return a task that asks nothing of robots for which a condition does not hold."""
    return Task(
        where(condition, task.velocity, 0.0), task.x, where(condition, task.weight, 0.0), task.other,
        where(condition, task.other_weight, 0.0), task.directions, where(condition, task.across, 0.0),
        where(condition, task.active, 0.0), where(condition, task.error, 0.0), task.value, task.least_rate,
        task.sidestep,
    )  # fmt: skip


@inlined
def at_least(value: Lanes, bound: Lanes | float, x: Vec, rate: Lanes | float) -> Inequality:
    """Keep a function of the position from falling below a bound, by what robots do before it does.

    With h = value - bound, robots may go on as they like while h' >= -rate h (a control barrier function,
    Ames et al. 2017). Else the velocities of lower priority lose their part along the gradient, in place of
    which comes the least one allowed, so that nothing jumps where the task sets in.

    Args:
        value: The function.
        bound: What it is not to fall below.
        x: Its gradient with respect to the position, not 0.
        rate: Share of h that a robot may use up per second [1/s].
    """
    return Inequality(value, bound, x, rate)


@inlined
def as_task(asked: Inequality) -> Task:
    """Return the task of an inequality by itself: active where the function is below its bound."""
    short: Lanes = asked.bound - asked.value
    weight = inverse_square(asked.x)
    least_rate, nothing = asked.rate * short, everywhere(0.0)
    task = Task(
        (least_rate * weight) * asked.x, asked.x, weight, asked.x, nothing, 1, nothing, everywhere(1.0),
        greatest(short, 0.0) * root(weight), asked.value, least_rate, 0.0,
    )  # fmt: skip
    return only(short > 0.0, task)


@inlined
def enforced(task: Task, wanted: Vec) -> Task:
    """Return the task of an inequality, active where a lower velocity w has x . w < least rate."""
    weight = inverse_square(task.x)
    short = dot(task.x, wanted) < task.least_rate
    velocity = where(short, (task.least_rate * weight) * task.x, 0.0)
    on, nothing = where(short, 1.0, everywhere(0.0)), everywhere(0.0)
    return Task(
        velocity, task.x, where(short, weight, 0.0), task.x, nothing, 1, nothing, on, task.error, task.value,
        task.least_rate, 0.0,
    )  # fmt: skip


@inlined
def inverse_square(x: Vec) -> Lanes:
    """Return 1 / |x|^2, 0 where x is 0."""
    square = dot(x, x)
    weight: Lanes = where(square > 0.0, 1.0 / square, 0.0)
    return weight


@inlined
def without(x: Vec, velocity: Vec) -> Vec:
    """Return what is left of a velocity across x."""
    return velocity - (dot(velocity, x) * inverse_square(x)) * x


@inlined
def speed_error(velocity: Vec, gain: float) -> Lanes:
    """Return how far a task is from done whose velocity is a gain times that [m]."""
    found: Lanes = norm(velocity) / gain
    return found


@inlined
def leave(task: Task, velocity: Vec) -> Vec:
    """Return what a task leaves of a velocity w of lower priority, with N = I - x x^T / |x|^2.

    Of a task along x, N w; of one across x, what is along x, (I - N) w; of two tasks at one level,
    N_1 w + N_2 w, as each is composed with w by itself and the results add up (chords in space).
    """
    share = dot(task.x, velocity) * task.weight
    if task.directions == MAX_DIRECTIONS:
        other = dot(task.other, velocity) * task.other_weight
        left = 2.0 * velocity - share * task.x - other * task.other
        return where(task.active > 0.5, left, velocity)
    part_along_x = share * task.x
    kept: Vec = where(task.across > 0.5, part_along_x, velocity - part_along_x)
    return kept


@inlined
def keep_task(task: Task, view: Any, i: int) -> None:
    """Write the task of robots i to i + 7 where `kept_task` finds it."""
    set_rows(view.asked_velocity, i, task.velocity)
    set_rows(view.asked_x, i, task.x)
    set_rows(view.asked_other, i, task.other)
    at, rows = TRAITS * i, view.asked
    scatter(rows, at + WEIGHT, TRAITS, task.weight)
    scatter(rows, at + OTHER_WEIGHT, TRAITS, task.other_weight)
    scatter(rows, at + DIRECTIONS, TRAITS, everywhere(float(task.directions)))
    scatter(rows, at + ACROSS, TRAITS, task.across)
    scatter(rows, at + ACTIVE, TRAITS, task.active)
    scatter(rows, at + ERROR, TRAITS, task.error)
    scatter(rows, at + VALUE, TRAITS, task.value)
    scatter(rows, at + LEAST_RATE, TRAITS, task.least_rate)
    scatter(rows, at + SIDESTEP, TRAITS, everywhere(task.sidestep))


@inlined
def kept_task(view: Any, i: int) -> Task:
    """Return the task of robots i to i + 7 that was kept."""
    return Task(
        rows_at(view, view.asked_velocity, i), rows_at(view, view.asked_x, i), _kept(view, i, WEIGHT),
        rows_at(view, view.asked_other, i), _kept(view, i, OTHER_WEIGHT), int(view.asked[i, DIRECTIONS]),
        _kept(view, i, ACROSS), _kept(view, i, ACTIVE), _kept(view, i, ERROR), _kept(view, i, VALUE),
        _kept(view, i, LEAST_RATE), view.asked[i, SIDESTEP],
    )  # fmt: skip


@inlined
def _kept(view: Any, i: int, trait: int) -> Lanes:
    """Return a trait of the tasks that are kept of robots i to i + 7."""
    found: Lanes = gather(view.asked, TRAITS * i + trait, TRAITS)
    return found
