"""Tasks: what a behavior asks of each robot, and what that leaves to behaviors of lower priority.

A task of eight robots at once is one value. Its task functions have Jacobians of one row, the gradient x, so
that the pseudoinverse is x / |x|^2 and the null-space projector I - x x^T / |x|^2: dot products are enough.
"""

from __future__ import annotations

from typing import NamedTuple

from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import Lanes, everywhere, root
from escort_mj.native.vectors import Vec, dot, norm, where

MAX_DIRECTIONS = 2  # of a task: chords in space keep two distances
MAX_LEVELS = 8  # behaviors by priority that a mission or a phase may have


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
    sidestep: float


@inlined
def along(x: Vec, weight: Lanes, velocity: Vec, active: Lanes, error: Lanes) -> Task:
    """A task along one direction: it takes x alone."""
    return Task(velocity, x, weight, x, everywhere(0.0), 1, everywhere(0.0), active, error, 0.0)


@inlined
def across(x: Vec, velocity: Vec, error: Lanes) -> Task:
    """A task in all directions but one: it leaves x alone."""
    nothing, on = everywhere(0.0), everywhere(1.0)
    return Task(velocity, x, inverse_square(x), x, nothing, 1, on, on, error, 0.0)


@inlined
def move(velocity: Vec, active: Lanes, error: Lanes) -> Task:
    """A task in all directions, of those robots for which it is active."""
    nothing = everywhere(0.0)
    return Task(velocity, velocity, nothing, velocity, nothing, 1, active, active, error, 0.0)


@inlined
def keep_distance(x: Vec, distance: Lanes | float, gain: float) -> Task:
    """Keep a distance d: sigma = |x|^2 / 2 is to become d^2 / 2 (eqs. 4, 5), with x relative to what moves.

    The velocity is x Lambda sigma~ / |x|^2, with sigma~ = (d^2 - |x|^2) / 2.

    Args:
        x: Where robots are, as seen from what they keep the distance to [m].
        distance: d [m].
        gain: Lambda [1/s].
    """
    square = dot(x, x)
    weight = where(square > 0.0, 1.0 / square, 0.0)
    velocity = (gain * 0.5 * (distance * distance - square) * weight) * x
    return along(x, weight, velocity, everywhere(1.0), abs(root(square) - distance))


@inlined
def both(first: Task, second: Task) -> Task:
    """Two tasks along one direction each, at one level: their velocities add up."""
    error = root(0.5 * (first.error * first.error + second.error * second.error))
    return Task(
        first.velocity + second.velocity, first.x, first.weight, second.x, second.weight, MAX_DIRECTIONS,
        everywhere(0.0), everywhere(1.0), error, 0.0,
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
    return norm(velocity) / gain


@inlined
def with_velocity(task: Task, velocity: Vec) -> Task:
    """Return a task with another velocity."""
    return Task(
        velocity, task.x, task.weight, task.other, task.other_weight, task.directions, task.across,
        task.active, task.error, task.sidestep,
    )  # fmt: skip


@inlined
def with_error(task: Task, error: Lanes) -> Task:
    """Return a task with another error [m]."""
    return Task(
        task.velocity, task.x, task.weight, task.other, task.other_weight, task.directions, task.across,
        task.active, error, task.sidestep,
    )  # fmt: skip


@inlined
def beside(task: Task, share: float) -> Task:
    """Return a task that leads around what it blocks, at least at a share of the blocked speed."""
    return Task(
        task.velocity, task.x, task.weight, task.other, task.other_weight, task.directions, task.across,
        task.active, task.error, share,
    )  # fmt: skip


@inlined
def leave(task: Task, velocity: Vec) -> Vec:
    """Return what is left of a velocity of lower priority: its part in the null space of the task."""
    along = dot(task.x, velocity) * task.weight
    if task.directions == MAX_DIRECTIONS:
        other = dot(task.other, velocity) * task.other_weight
        return 2.0 * velocity - along * task.x - other * task.other
    removed = along * task.x
    return where(task.across > 0.5, removed, velocity - removed)
