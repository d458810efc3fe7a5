"""The baselines of the outer loop: potential fields, and the barrier filter by a least-distance program."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from escort_mj.behaviors import AvoidObstacles, Behavior
from escort_mj.behaviors.task import Situation
from escort_mj.control.outer_loops import BarrierFilter, PotentialField
from escort_mj.control.outer_loops.barrier_filter import STIFFNESS
from escort_mj.control.reference.outer import outer_loop
from escort_mj.control.setup import Setup
from escort_mj.sensing.instruments import in_range

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def reference_velocity(behaviors: tuple[Behavior, ...], now: Situation) -> tuple[Array, Mask]:
    """The outer loop that the mission asks for; arguments and results as of `outer.outer_loop`."""
    setup, q, lost = now.setup, now.q, now.team.lost
    loop = setup.outer
    escorting = tuple(b for b in behaviors if b.frame == "target")
    avoiding = [b for b in behaviors if isinstance(b, AvoidObstacles)]
    active = np.zeros(len(q), dtype=bool)
    if isinstance(loop, BarrierFilter):
        velocity, _ = outer_loop(escorting, now)
        for avoid in avoiding:
            velocity, active = filtered(loop, avoid, velocity, q, setup, lost)
    elif isinstance(loop, PotentialField):
        velocity = np.tile(now.c_dot * setup.target_feedforward, (len(q), 1))
        for behavior in escorting:
            velocity = velocity + behavior.velocity(now)
        for avoid in avoiding:
            push, active = repulsions(loop, avoid, q, setup, lost)
            velocity = velocity + push
    else:
        return outer_loop(behaviors, now)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(speed > setup.max_speed, setup.max_speed / speed, 1.0)
    return velocity * share, active


def surroundings(avoid: AvoidObstacles, q: Array, setup: Setup, lost: Mask) -> tuple[Array, Array, Array]:
    """Every obstacle and teammate as each robot sees it, obstacles first.

    Returns:
        Unit vectors away from them, shape (n, m + n, p); distances as the behavior measures them, and the
        least ones [m], shape (n, m + n), the latter 0 where nothing is avoided.
    """
    teammates = np.broadcast_to(q, (len(q), *q.shape))
    offsets = q[:, None] - np.concatenate([setup.obstacles_seen()[:-1], teammates], axis=1)
    distance = np.linalg.norm(offsets, axis=2)
    away = np.where(distance[..., None] > 0.0, offsets, np.eye(q.shape[1])[0])
    away = away / np.linalg.norm(away, axis=2, keepdims=True)
    if avoid.measure == "surface":
        radii = np.concatenate([setup.obstacle_radius, setup.robot_radius])
        distance = distance - setup.robot_radius[:, None] - radii
    mates = np.full((len(q), len(q)), setup.teammate_distance(avoid))
    mates[:, lost] = max(avoid.safe_distance, setup.teammate_distance(avoid))
    np.fill_diagonal(mates, 0.0)
    safe = np.hstack([np.full((len(q), len(setup.obstacle_position)), avoid.safe_distance), mates])
    return away, distance, safe


def repulsions(
    field: PotentialField, avoid: AvoidObstacles, q: Array, setup: Setup, lost: Mask
) -> tuple[Array, Mask]:
    """What obstacles and teammates add to each robot's velocity, shape (n, p) [m/s], and to whose, (n,)."""
    away, distance, safe = surroundings(avoid, q, setup, lost)
    near = (distance < safe) & (safe > 0.0)
    d = np.maximum(distance, field.least_distance)
    with np.errstate(divide="ignore"):
        speed = np.where(near, field.gain * np.maximum(1.0 / d - 1.0 / safe, 0.0) / d**2, 0.0)
    return np.einsum("ij,ijk->ik", speed, away), np.asarray(near.any(axis=1))


def filtered(
    barrier: BarrierFilter, avoid: AvoidObstacles, nominal: Array, q: Array, setup: Setup, lost: Mask
) -> tuple[Array, Mask]:
    """Each robot's velocity behind the filter, shape (n, p) [m/s], and whose it changed, shape (n,)."""
    away, distance, safe = surroundings(avoid, q, setup, lost)
    share = np.where(lost, 1.0, 0.5)
    radii = np.concatenate([setup.obstacle_radius, setup.robot_radius])
    gaps = distance if avoid.measure == "surface" else distance - setup.robot_radius[:, None] - radii
    obstacles = len(setup.obstacle_radius)
    known = np.hstack(
        [
            in_range(gaps[:, :obstacles], setup.sensing.obstacles),
            in_range(gaps[:, obstacles:], setup.sensing.robots),
        ]
    )
    bound = -barrier.rate * (distance - safe) * np.concatenate([np.ones(len(setup.obstacle_radius)), share])
    velocities, changed = nominal.copy(), np.zeros(len(q), dtype=bool)
    for i, own in enumerate((safe > 0.0) & np.isfinite(known)):
        missing = bound[i, own] - away[i, own] @ nominal[i]
        if np.any(missing > 0.0):
            velocities[i] += least_change(away[i, own], missing)
            changed[i] = True
    return velocities, changed


def least_change(rows: Array, missing: Array) -> Array:
    """The change x of a velocity with slacks s, rows x + s >= missing, of least |x|^2 + STIFFNESS |s|^2.

    Lawson and Hanson's least-distance programming: with z = (x, sqrt(STIFFNESS) s) it is the shortest z in a
    polyhedron G z >= h, which the residual of a non-negative least-squares problem gives.

    Args:
        rows: Shape (k, p).
        missing: Shape (k,) [m/s].
    """
    weights = np.hstack([rows, np.eye(len(rows)) / np.sqrt(STIFFNESS)])
    system = np.vstack([weights.T, missing])
    goal = np.zeros(len(system))
    goal[-1] = 1.0
    multipliers, _ = nnls(system, goal)
    residual = goal - system @ multipliers
    return -residual[: rows.shape[1]] / residual[-1]
