"""The behaviors as tasks: velocity J^+ Lambda sigma~ and null space I - J^+ J of each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.behaviors import AvoidObstacles, Chords, Repulsion, Surface, Vertices
from escort_mj.control.reference.failure import Team
from escort_mj.control.reference.measure import in_range
from escort_mj.control.reference.tasks import (
    block_diagonal,
    directions,
    distance,
    half_squared_distance,
    resolve,
)
from escort_mj.control.setup import Setup

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def escort(behavior: Chords | Surface, q: Array, c: Array, team: Team, setup: Setup) -> tuple[Array, Array]:
    """Velocity and null space of an escort behavior, summed over the formation's cycles (eqs. 2, 4, 5).

    Returns:
        Velocity, shape (p n,) [m/s], and projector, shape (p n, p n).
    """
    if isinstance(behavior, Chords):
        length, anchors = team.chord_length, [q[robots] for robots in team.predecessors]
    else:
        length, anchors = setup.radius, [np.broadcast_to(c, q.shape)]
    velocity, projector = np.zeros(q.size), np.zeros((q.size, q.size))
    for anchor in anchors:
        sigma, jacobian = half_squared_distance(q, anchor)
        v_c, projector_c = resolve(jacobian, behavior.gain * (0.5 * length**2 - sigma))
        velocity, projector = velocity + v_c, projector + projector_c
    return velocity, projector


def spread(
    behavior: Vertices | Repulsion, q: Array, c: Array, team: Team, rotation: Array, setup: Setup
) -> tuple[Array, Array]:
    """Velocity and null space of a behavior that moves robots along the sphere (remark 1).

    Its task is all that is tangential: J is the projector on the tangent spaces, shape (p n, p n).

    Args:
        behavior: Its parameters.
        q: Positions.
        c: Position of the target, shape (p,) [m].
        team: Who is left, and the vertices.
        rotation: Of the even figure, shape (p, p).
        setup: Gives the radius.

    Returns:
        Velocity, shape (p n,) [m/s], and projector, shape (p n, p n).
    """
    x = q - c
    radial = block_diagonal(x)
    tangential = np.eye(q.size) - np.linalg.pinv(radial) @ radial
    if isinstance(behavior, Vertices):
        wish = behavior.gain * (setup.radius * team.vertices @ rotation.T - x)
    else:
        u = directions(x)
        offset = u[:, None] - u
        apart = np.linalg.norm(offset, axis=2)
        with np.errstate(divide="ignore"):
            weight = np.where(apart > 1e-12, apart**-3.0, 0.0)
        weight[:, (np.linalg.norm(x, axis=1) == 0.0) | team.lost] = 0.0
        gaps = np.linalg.norm(q[:, None] - q, axis=2) - setup.robot_radius[:, None] - setup.robot_radius
        np.fill_diagonal(gaps, 0.0)
        known = np.isfinite(in_range(gaps, setup.sensing.robots)) & ~team.lost
        push = (tangential @ np.einsum("ij,ijk->ik", weight * known, offset).ravel()).reshape(q.shape)
        push /= np.maximum(known.sum(axis=1, keepdims=True), 1)
        push[np.linalg.norm(x, axis=1) == 0.0] = 0.0
        speed = np.linalg.norm(push, axis=1, keepdims=True)
        wish = behavior.gain * setup.radius * push / np.maximum(speed, 1.0)
    return tangential @ wish.ravel(), np.eye(q.size) - tangential


def turned(rotation: Array, q: Array, c: Array, vertices: Array) -> Array:
    """One step of the rotation that fits the even figure to the robots, shape (p, p).

    A skew step to where the correlation of robots and turned vertices is symmetric, then one Newton-Schulz
    step back to the rotations.
    """
    m = directions(q - c).T @ vertices @ rotation.T
    if np.trace(m) <= 0.0:
        return rotation
    rotation = rotation + (m - m.T) / np.trace(m) @ rotation
    return np.asarray(0.5 * rotation @ (3.0 * np.eye(len(rotation)) - rotation.T @ rotation))


def intrusion(
    avoid: AvoidObstacles, q: Array, setup: Setup, lost: Mask | bool = False
) -> tuple[Array, Array]:
    """How deep the worst intruder is in each robot's safe sphere, and where it stands (eq. 3, remark 2).

    Robots in `lost`, shape (n,), are obstacles too.

    Returns:
        sigma~, not positive where nobody intrudes, shape (n,) [m], and positions, shape (n, p) [m].
    """
    teammates = np.broadcast_to(q, (len(q), *q.shape))
    centers = np.concatenate([setup.obstacles_seen()[:-1], teammates], axis=1)  # by each robot
    gaps = np.linalg.norm(q[:, None] - centers, axis=2)
    if avoid.measure == "surface":
        radii = np.concatenate([setup.obstacle_radius, setup.robot_radius])
        gaps -= setup.robot_radius[:, None] + radii
    obstacles, robots = len(setup.obstacle_position), np.arange(len(q))
    teammate_distance = setup.teammate_distance(avoid) if avoid.teammates else -np.inf
    reach = np.repeat([avoid.safe_distance, teammate_distance], [obstacles, len(q)])
    reach[obstacles:][lost] = max(avoid.safe_distance, teammate_distance)
    depth = reach - gaps
    depth[robots, obstacles + robots] = -np.inf  # nobody avoids itself
    worst = np.argmax(depth, axis=1)
    return depth[robots, worst], centers[robots, worst]


def escape_gain(avoid: AvoidObstacles, depth: Array, speed: Array, error: Array, slope: float) -> Array:
    """State-dependent gain lambda = lambda* + rho by the quadratic of eq. 24, shape (k,) [1/s].

    Args:
        avoid: The behavior's parameters.
        depth: sigma~, positive, shape (k,) [m].
        speed: |v|, shape (k,) [m/s].
        error: |e|, shape (k,) [m].
        slope: gamma of the sliding surface [1/s].
    """
    g = slope * error
    a, b = depth**2, 2.0 * depth * (speed - (2.0 * g if avoid.gain == "printed" else g))
    # b^2 + 4ac with c = g^2 + 2g|v| - |v|^2, multiplied out: where g << |v| it cancels to rounding noise.
    discriminant = 4.0 * a * (5.0 * g**2 - 2.0 * g * speed if avoid.gain == "printed" else 2.0 * g**2)
    return (b + np.sqrt(np.maximum(discriminant, 0.0))) / (2.0 * a) + avoid.gain_margin


def avoidance(
    avoid: AvoidObstacles, q: Array, v: Array, e: Array, setup: Setup, lost: Mask | bool = False
) -> tuple[Array, Array, Mask]:
    """Velocity and null space of obstacle avoidance; zero and the identity where it is inactive (eqs. 2, 3).

    Returns:
        Velocity, shape (p n,) [m/s], projector, shape (p n, p n), and who avoids, shape (n,).
    """
    depth, intruder = intrusion(avoid, q, setup, lost)
    active = (depth > 0.0) & np.logical_not(lost)
    jacobian = np.where(active[:, None], distance(q, intruder).jacobian, 0.0)
    speed, error = np.linalg.norm(v, axis=1), np.linalg.norm(e, axis=1)
    rate = np.zeros(len(q))
    gain = escape_gain(avoid, depth[active], speed[active], error[active], setup.law.slope)
    rate[active] = gain * depth[active]
    return *resolve(jacobian, rate), active


def sidestep(
    avoid: AvoidObstacles, q: Array, wanted: Array, setup: Setup, lost: Mask | bool = False
) -> Array:
    """What avoidance adds along the safe sphere against head-on approaches (remark 6), shape (n, p) [m/s].

    Args:
        avoid: The behavior's parameters.
        q: Positions.
        wanted: Velocity wanted by everything below avoidance, shape (n, p) [m/s].
        setup: Gives bodies and distances.
        lost: Robots that are obstacles, shape (n,).
    """
    depth, intruder = intrusion(avoid, q, setup, lost)
    axes = q.shape[1]
    r = np.stack([distance(q, intruder).jacobian[i, i * axes : (i + 1) * axes] for i in range(len(q))])
    outward = np.sum(r * wanted, axis=1)
    left = np.linalg.norm(wanted - outward[:, None] * r, axis=1)
    speed = np.where(depth > 0.0, np.maximum(-avoid.sidestep * outward - left, 0.0), 0.0)
    pairs = np.kron(np.eye(axes // 2), np.array([[0.0, -1.0], [1.0, 0.0]]))
    odd = axes % 2
    equatorial = np.pad(pairs, (0, odd))  # turns all axes but, where they are odd, the last one
    polar = np.pad(pairs, (odd, 0))
    turned_r = np.where(np.abs(r[:, -1:]) > 0.9, r @ polar.T, r @ equatorial.T)
    return np.asarray(speed[:, None] * turned_r)
