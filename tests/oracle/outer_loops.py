"""How behaviors become one velocity: eq. 2 with projectors, and the other outer loops with NumPy."""

from __future__ import annotations

import math
from functools import singledispatch

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import AvoidObstacles, Behavior
from escort_mj.components.parameters import UNLIMITED
from escort_mj.control.outer_loops.barrier_filter import BarrierFilter
from escort_mj.control.outer_loops.nsb import Nsb
from escort_mj.control.outer_loops.outer_loop import OuterLoop
from escort_mj.control.outer_loops.passing import Rules
from escort_mj.control.outer_loops.potential_field import PotentialField
from tests.oracle.behaviors import beside, is_active, resolved, wish
from tests.oracle.constraints import Constraints, bodies_nearby, constraints_of
from tests.oracle.nearest_velocity import nearest
from tests.oracle.task import Situation

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def outer_loop(behaviors: tuple[Behavior, ...], now: Situation) -> tuple[Array, Mask]:
    """Composes the behaviors from the lowest priority to the highest (eq. 2); v_d and who avoids.

    Avoidance and goals work in the world's frame: w -> v1 + N1 w. Escort behaviors work in the target's,
    where the behaviors below move at w - c_dot: w -> c_dot + sum_c [v2_c + N2_c (w - c_dot)].

    Args:
        behaviors: By priority, the most important first.
        now: The situation.

    Returns:
        v_d, shape (n, p) [m/s], and who avoids, shape (n,).
    """
    q = now.q
    c_dot = now.c_dot.ravel() * now.setup.target_feedforward
    carried = c_dot  # what the projections leave of c_dot
    parts: list[Array] = []
    place = 0  # of c_dot among the parts: right before the highest escort behavior
    avoiding = np.zeros(len(q), dtype=bool)
    for behavior in reversed(behaviors):
        velocity, projector = resolved(behavior, now)
        if behavior.frame == "world":
            velocity = velocity + beside(behavior, now, _spent(parts, carried, place, now)).ravel()
            carried, place = projector @ carried, place + 1
            if isinstance(behavior, AvoidObstacles):
                avoiding = avoiding | is_active(behavior, now)
        else:
            carried, place = c_dot + projector @ (carried - c_dot), 0
        parts = [velocity, *(projector @ part for part in parts)]
    return _spent(parts, carried, place, now), avoiding


def _spent(parts: list[Array], carried: Array, place: int, now: Situation) -> Array:
    """Return what the speed limit leaves of parts and of the feed-forward, which has its place among them."""
    together = [*parts[:place], carried, *parts[place:]]
    if not np.isfinite(now.setup.max_speed):
        return np.sum(together, axis=0).reshape(now.q.shape)
    by_robot = np.array(together).reshape(len(together), *now.q.shape).swapaxes(0, 1)
    return np.array([spend(robot, now.setup.max_speed) for robot in by_robot])


def spend(contributions: Array, max_speed: float) -> Array:
    """Adds one robot's contributions by priority, each as far as the speed limit leaves room for it.

    Args:
        contributions: Velocities, the most important first, shape (k, p) [m/s].
        max_speed: Largest speed [m/s].
    """
    total: Array = np.zeros(contributions.shape[1])
    for part in contributions:
        square, along = float(part @ part), float(total @ part)
        room = max_speed**2 - float(total @ total)
        room *= room > 1e-12 * max_speed**2  # the root below would make 1e-8 of what is only rounding
        if square + 2.0 * along <= room:
            total = total + part
        else:  # cut where |total + alpha part| = max_speed
            root = math.sqrt(along**2 + square * room)
            total = total + (room / (root + along) if along > 0.0 else (root - along) / square) * part
    return total


@singledispatch
def velocities(loop: OuterLoop, behaviors: tuple[Behavior, ...], now: Situation) -> tuple[Array, Mask]:
    """Return v_d, shape (n, p) [m/s], and who avoids, shape (n,).

    Args:
        behaviors: By priority, the most important first.
        now: The situation.
    """
    raise NotImplementedError


def slowed(velocity: Array, max_speed: float) -> Array:
    """Return velocities within the speed limit, along the same directions, shape (n, p) [m/s]."""
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        return velocity * np.where(speed > max_speed, max_speed / speed, 1.0)


def split(behaviors: tuple[Behavior, ...]) -> tuple[tuple[Behavior, ...], list[AvoidObstacles]]:
    """Return the behaviors that say where to go, and those that avoid obstacles."""
    going = tuple(behavior for behavior in behaviors if not isinstance(behavior, AvoidObstacles))
    return going, [behavior for behavior in behaviors if isinstance(behavior, AvoidObstacles)]


@velocities.register
def _velocities_of_nsb(loop: Nsb, behaviors: tuple[Behavior, ...], now: Situation) -> tuple[Array, Mask]:
    """Return the behaviors composed by priority, and who avoids."""
    return outer_loop(behaviors, now)


@velocities.register
def _velocities_of_barrier_filter(
    loop: BarrierFilter, behaviors: tuple[Behavior, ...], now: Situation
) -> tuple[Array, Mask]:
    """Return the escort behaviors' velocities, changed by as little as safety takes, and whose are.

    Slowing down the result breaks no constraint unless a distance is too small already: rest keeps them.
    """
    escorting, avoiding = split(behaviors)
    active = np.zeros(len(now.q), dtype=bool)
    velocity = escorting_velocity(escorting, now)
    for avoid in avoiding:
        rules = Rules(loop.rate, UNLIMITED, 0.0, 0.0, 0.0, 0.0)
        for i, found in enumerate(constraints_of(avoid, rules, now)):
            velocity[i], active[i] = filtered(found, velocity[i])
    return slowed(velocity, now.setup.max_speed), active


def escorting_velocity(behaviors: tuple[Behavior, ...], now: Situation) -> Array:
    """Return what escort behaviors want, or what robots hold of it, shape (n, p) [m/s]."""
    velocity, _ = outer_loop(behaviors, now)
    return velocity if now.held is None else np.where(np.isnan(now.held), velocity, now.held)


def filtered(found: Constraints, wanted: Array) -> tuple[Array, bool]:
    """Return the velocity nearest to a wanted one, shape (p,) [m/s], and whether it is another."""
    v = wanted
    while True:
        speed = float(np.linalg.norm(v))
        v, moved = nearest(*found.within(speed, speed)[:2], wanted)
        if not np.linalg.norm(v) > speed:
            return v, moved


@velocities.register
def _velocities_of_potential_field(
    loop: PotentialField, behaviors: tuple[Behavior, ...], now: Situation
) -> tuple[Array, Mask]:
    """Return the sum of all wishes and repulsions, within the speed limit, and who is repelled."""
    escorting, avoiding = split(behaviors)
    active = np.zeros(len(now.q), dtype=bool)
    moving = now.setup.target_feedforward and any(one.frame != "world" for one in escorting)
    velocity = now.c_dot * moving
    for behavior in escorting:
        velocity = velocity + wish(behavior, now)
    for avoid in avoiding:
        push, active = repulsions(loop, avoid, now)
        velocity = velocity + push
    return slowed(velocity, now.setup.max_speed), active


def repulsions(field: PotentialField, avoid: AvoidObstacles, now: Situation) -> tuple[Array, Mask]:
    """What obstacles and teammates add to each robot's velocity, shape (n, p) [m/s], and to whose, (n,)."""
    away, distance, safe = bodies_nearby(avoid, now)
    near = (distance < safe) & (safe > 0.0)
    d = np.maximum(distance, field.least_distance)
    with np.errstate(divide="ignore"):
        speed = np.where(near, field.gain * np.maximum(1.0 / d - 1.0 / safe, 0.0) / d**2, 0.0)
    return np.einsum("ij,ijk->ik", speed, away), np.asarray(near.any(axis=1))
