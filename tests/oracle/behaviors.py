"""Behaviors as tasks of the whole team: the paper's equations with its matrices, and the others alike."""

from __future__ import annotations

import math
from functools import singledispatch
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors.avoid_obstacles import POLAR, AvoidObstacles
from escort_mj.behaviors.behavior import Behavior
from escort_mj.behaviors.chords import Chords
from escort_mj.behaviors.connect import Connect
from escort_mj.behaviors.goal import Headed
from escort_mj.behaviors.guard import NEAR, Guard
from escort_mj.behaviors.intercept import Intercept
from escort_mj.behaviors.orbit import Orbit
from escort_mj.behaviors.repulsion import Repulsion
from escort_mj.behaviors.spacing import TURN, Spacing
from escort_mj.behaviors.surface import SOFT, Surface, _lead_radius, _obstacle_clearance, fitted
from escort_mj.behaviors.vertices import Vertices
from escort_mj.components.parameters import UNLIMITED
from escort_mj.control.setup import Setup
from escort_mj.native.vectors import Vec
from tests.oracle.setup import setup_now
from tests.oracle.task import (
    Situation,
    Task,
    directions,
    distance,
    half_squared_distance,
    resolve_all,
    tangential,
)
from tests.oracle.teammates import Heard

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@singledispatch
def team_tasks(behavior: Behavior, now: Situation) -> tuple[Task, ...]:
    """Return its tasks, summed up where there are several; by default as plugins ask, of all robots."""
    return _tasks_by_robot(behavior, now)


def asked(behavior: Behavior, now: Situation) -> tuple[Task, ...]:
    """Return `team_tasks`, found once."""
    return now.once((id(behavior), "asked"), lambda: team_tasks(behavior, now))


def resolved(behavior: Behavior, now: Situation) -> tuple[Array, Array]:
    """Return velocity and null space of its tasks, see `resolve_all`."""
    return now.once((id(behavior), "resolved"), lambda: resolve_all(asked(behavior, now)))


@singledispatch
def is_active(behavior: Behavior, now: Situation) -> Mask:
    """Return which robots it asks for anything, shape (n,)."""
    return np.ones(len(now.q), dtype=bool)


@singledispatch
def task_error(behavior: Behavior, now: Situation) -> Array:
    """Return how far each robot is from done, shape (n,) [m]."""
    raise NotImplementedError


@singledispatch
def beside(behavior: Behavior, now: Situation, below: Array) -> Array:
    """Return what it adds to its own velocity, shape (n, p) [m/s].

    Args:
        now: The situation.
        below: Velocity wanted by everything of lower priority, shape (n, p) [m/s].
    """
    return np.zeros_like(below)


def wish(behavior: Behavior, now: Situation) -> Array:
    """Return what it wishes by itself, shape (n, p) [m/s]."""
    return resolved(behavior, now)[0].reshape(now.q.shape)


def _tasks_by_robot(behavior: Any, now: Situation) -> tuple[Task, ...]:
    """Ask a behavior as it is written, of arrays of all robots."""
    (n, p), setup = now.q.shape, now.setup
    jacobian, rate = np.zeros((n, p, n, p)), np.zeros((n, p))
    robots = SimpleNamespace(
        q=Vec(tuple(now.q.T)), v=Vec(tuple(now.v.T)), target=Vec(tuple(now.c.T)),
        target_velocity=Vec(tuple(now.c_dot.T)), radius=setup.radius, time=now.time,
    )  # fmt: skip
    asked = behavior.task(robots)
    for i in range(n):
        x = np.array([_of(part, i, n) for part in asked.x])
        along = np.outer(x, x) / (x @ x)
        jacobian[i, :, i] = np.eye(p) - along if _of(asked.across, i, n) > 0.5 else along
        rate[i] = [_of(part, i, n) for part in asked.velocity]
    return (Task(jacobian.reshape(n * p, n * p), rate.ravel()),)


def _of(values: Any, i: int, count: int) -> float:
    """Return what a robot has of values, or of the same number in eight lanes."""
    return float(values[i] if len(values) == count else values[0])


@team_tasks.register
def _team_tasks_of_avoid_obstacles(behavior: AvoidObstacles, now: Situation) -> tuple[Task, ...]:
    """Return eq. 3 with the gain of eqs. 23, 24: sigma = |q - o| is to grow to the safe distance."""
    depth, intruder = worst(behavior, now)
    active = is_active(behavior, now)
    jacobian = np.where(active[:, None], distance(now.q, intruder).jacobian, 0.0)
    speed, error = np.linalg.norm(now.v, axis=1), np.linalg.norm(now.e, axis=1)
    rate = np.zeros(len(now.q))
    slope = now.setup.by_robot("slope", now.members)[active]
    gain = escape_gain(behavior, depth[active], speed[active], error[active], slope)
    rate[active] = gain * depth[active]
    return (Task(jacobian, rate),)


@is_active.register
def _active_of_avoid_obstacles(behavior: AvoidObstacles, now: Situation) -> Mask:
    """Return whose safe sphere something is in."""
    return (worst(behavior, now)[0] > 0.0) & ~now.team.lost


@task_error.register
def _error_of_avoid_obstacles(behavior: AvoidObstacles, now: Situation) -> Array:
    """Return how deep the worst intruder is in each safe sphere."""
    return worst(behavior, now)[0]


def worst(behavior: AvoidObstacles, now: Situation) -> tuple[Array, Array]:
    lost, heard = now.team.lost, now.heard
    return now.once((id(behavior), "worst"), lambda: intrusion(behavior, now.q, now.setup, lost, heard))


def teammates_of(
    behavior: AvoidObstacles, q: Array, setup: Setup, lost: Mask | bool, heard: Heard | None
) -> tuple[Array, Array, Array]:
    """Return where each robot takes its teammates to be.

    Args:
        q: Measured positions, shape (n, p) [m].
        setup: Gives distances.
        lost: Robots that are obstacles, shape (n,).
        heard: What robots have heard of teammates.

    Returns:
        Places, shape (n, n, p), how far from there teammates may be, and the least distances to keep,
        0 for those that are not avoided, shape (n, n) [m].
    """
    n, p = q.shape
    places, balls = np.broadcast_to(q, (n, n, p)), np.zeros((n, n))
    safe = np.full((n, n), behavior.distance_of_teammates(setup))
    safe[:, lost] = max(behavior.safe_distance, behavior.distance_of_teammates(setup))
    if heard is not None and behavior.hears(setup):
        places, balls = heard.place, heard.ball
        safe = np.where(heard.known, behavior.distance_of_teammates(setup), behavior.safe_distance * lost)
    np.fill_diagonal(safe, 0.0)
    return places, balls, safe


def intrusion(
    behavior: AvoidObstacles, q: Array, setup: Setup, lost: Mask | bool = False, heard: Heard | None = None
) -> tuple[Array, Array]:
    """Return how deep the worst intruder is in each safe sphere, and where it is (eq. 3, remark 2).

    Args:
        q: Measured positions, shape (n, p) [m].
        setup: Gives obstacles, radii and distances.
        lost: Robots that are obstacles, shape (n,).
        heard: What robots have heard of teammates.

    Returns:
        sigma~, not positive where nothing intrudes, shape (n,) [m], and positions, shape (n, p) [m].
    """
    teammates, balls, safe = teammates_of(behavior, q, setup, lost, heard)
    centers = np.concatenate([setup_now(setup).obstacles_seen()[:-1], teammates], axis=1)  # by each robot
    gaps = np.linalg.norm(q[:, None] - centers, axis=2)
    if behavior.measure == "surface":
        radii = np.concatenate([setup.seen_radius, setup.robot_radius])
        gaps -= setup.robot_radius[:, None] + radii
    obstacles, robots = len(setup.obstacle_position), np.arange(len(q))
    reach = np.where(safe > 0.0, safe + balls, -np.inf)
    depth = np.hstack([np.full((len(q), obstacles), behavior.safe_distance), reach]) - gaps
    worst = np.argmax(depth, axis=1)
    return depth[robots, worst], centers[robots, worst]


def escape_gain(
    behavior: AvoidObstacles, depth: Array, speed: Array, error: Array, slope: Array | float
) -> Array:
    """Return the gain lambda = lambda* + rho by the quadratic of eq. 24, shape (k,) [1/s].

    Args:
        depth: sigma~, positive, shape (k,) [m].
        speed: |v|, shape (k,) [m/s].
        error: |e|, shape (k,) [m].
        slope: gamma of the sliding surface, one or shape (k,) [1/s].
    """
    g, printed = slope * error, behavior.gain == "printed"
    a, b = depth**2, 2.0 * depth * (speed - (2.0 * g if printed else g))
    # b^2 + 4ac with c = g^2 + 2g|v| - |v|^2, multiplied out: where g << |v| it cancels to rounding noise.
    discriminant = 4.0 * a * (5.0 * g**2 - 2.0 * g * speed if printed else 2.0 * g**2)
    return (b + np.sqrt(np.maximum(discriminant, 0.0))) / (2.0 * a) + behavior.gain_margin


@beside.register
def _beside_of_avoid_obstacles(behavior: AvoidObstacles, now: Situation, below: Array) -> Array:
    """Return the sidestep: what goes along the safe sphere against head-on approaches (remark 6).

    Args:
        now: The situation.
        below: What the behaviors below want within the speed limit, shape (n, p) [m/s].
    """
    q, (depth, intruder) = now.q, worst(behavior, now)
    robots, axes = np.arange(len(q)), q.shape[1]
    r = distance(q, intruder).jacobian.reshape(len(q), *q.shape)[robots, robots]
    outward = np.sum(r * below, axis=1)
    left = np.linalg.norm(below - outward[:, None] * r, axis=1)
    speed = np.where(depth > 0.0, np.maximum(-behavior.sidestep * outward - left, 0.0), 0.0)
    pairs = np.kron(np.eye(axes // 2), np.array([[0.0, -1.0], [1.0, 0.0]]))
    odd = axes % 2
    equatorial = np.pad(pairs, (0, odd))  # turns all axes but, where they are odd, the last one
    polar = np.pad(pairs, (odd, 0))
    turned_r = np.where(np.abs(r[:, -1:]) > POLAR, r @ polar.T, r @ equatorial.T)
    return np.asarray(speed[:, None] * turned_r)


@team_tasks.register
def _team_tasks_of_chords(behavior: Chords, now: Situation) -> tuple[Task, ...]:
    """Return eq. 4 of each cycle: sigma = |q_i - q_j|^2 / 2, j before i, is to become length^2 / 2."""
    sigmas = [half_squared_distance(now.q, now.q[row]) for row in now.team.predecessors]
    wanted = 0.5 * now.team.chord_length**2
    return tuple(Task(jacobian, behavior.gain * (wanted - sigma)) for sigma, jacobian in sigmas)


@task_error.register
def _error_of_chords(behavior: Chords, now: Situation) -> Array:
    """Return the root mean square of the chords' deviations in length."""
    chords = [np.linalg.norm(now.q - now.q[row], axis=1) for row in now.team.predecessors]
    return np.asarray(np.sqrt(np.mean((np.array(chords) - now.team.chord_length) ** 2, axis=0)))


@team_tasks.register
def _team_tasks_of_connect(behavior: Connect, now: Situation) -> tuple[Task, ...]:
    """Return the task along the way to the farthest neighbor: back to the distance."""
    n, p = now.q.shape
    ways, _ = strained(behavior, now)
    jacobian, rate = np.zeros((n, n, p)), np.zeros(n)
    for i, way in enumerate(ways):
        apart = float(np.linalg.norm(way))
        if apart > behavior.distance:
            jacobian[i, i] = way / apart
            rate[i] = behavior.gain * (apart - behavior.distance)
    return (Task(jacobian.reshape(n, n * p), rate),)


def strained(behavior: Connect, now: Situation) -> tuple[Array, Array]:
    """Return the ways to the farthest neighbors, shape (n, p) [m], and who has one, shape (n,)."""
    q = now.q
    mates = np.broadcast_to(q, (len(q), *q.shape)) if now.mates is None else now.mates
    ways, some = np.zeros_like(q), np.zeros(len(q), dtype=bool)
    for i in range(len(q)):
        known = [j for j in range(len(q)) if j != i and np.isfinite(mates[i, j, 0]) and not now.team.lost[j]]
        offset = {j: mates[i, j] - q[i] for j in known}
        for j in known:
            own = float(np.linalg.norm(offset[j]))
            between = [
                k for k in known
                if k != j and max(np.linalg.norm(offset[k]), np.linalg.norm(offset[k] - offset[j])) < own
            ]  # fmt: skip
            if not between and (not some[i] or own > np.linalg.norm(ways[i])):
                ways[i], some[i] = offset[j], True
    return ways, some


@is_active.register
def _active_of_connect(behavior: Connect, now: Situation) -> Mask:
    """Return which robots are beyond the distance, shape (n,)."""
    return np.asarray(np.linalg.norm(strained(behavior, now)[0], axis=1) > behavior.distance)


@task_error.register
def _error_of_connect(behavior: Connect, now: Situation) -> Array:
    """Return by how much each robot is beyond the distance."""
    return np.maximum(np.linalg.norm(strained(behavior, now)[0], axis=1) - behavior.distance, 0.0)


@team_tasks.register
def _team_tasks_of_headed(behavior: Headed, now: Situation) -> tuple[Task, ...]:
    """Return the task sigma = q, which is to become the goal: it takes all directions."""
    return (Task(np.eye(now.q.size), (behavior.gain * (now.goal - now.q) + now.goal_velocity).ravel()),)


@task_error.register
def _error_of_headed(behavior: Headed, now: Situation) -> Array:
    """Return the distance to the goal."""
    return np.asarray(np.linalg.norm(now.goal - now.q, axis=1))


@team_tasks.register
def _team_tasks_of_guard(behavior: Guard, now: Situation) -> tuple[Task, ...]:
    """Return the task sigma = q of the robots that guard, which takes all directions."""
    way, velocity = way_to_stand(behavior, now)
    active = is_active(behavior, now)
    rate = np.where(active[:, None], behavior.gain * way + velocity, 0.0)
    return (Task(np.diag(np.repeat(active, now.q.shape[1]).astype(float)), rate.ravel()),)


@is_active.register
def _active_of_guard(behavior: Guard, now: Situation) -> Any:
    """Return which robots guard, shape (n,)."""
    return guarding(now, behavior.alert)


@task_error.register
def _error_of_guard(behavior: Guard, now: Situation) -> Array:
    """Return the distance that is left."""
    return np.where(is_active(behavior, now), np.linalg.norm(way_to_stand(behavior, now)[0], axis=1), 0.0)


def way_to_stand(behavior: Guard, now: Situation) -> tuple[Array, Array]:
    """Return the way to where each robot stands, and how fast that moves, shape (n, p) each."""
    assert now.threats is not None
    y, w = now.threats.position - now.c, now.threats.velocity - now.c_dot
    far = np.maximum(np.linalg.norm(y, axis=1, keepdims=True), NEAR)
    u, distance = y / far, behavior.distance or now.radius[:, None]
    aside = w - u * np.sum(u * w, axis=1, keepdims=True)
    return now.c + distance * u - now.q, now.c_dot + distance / far * aside


def guarding(now: Situation, alert: float | None) -> Any:
    """Return which robots guard against an opponent within a distance [m] of the target, shape (n,)."""
    assert now.threats is not None
    distance = np.linalg.norm(now.threats.position - now.c, axis=1)
    return (now.threats.number > 0) & (distance <= (UNLIMITED if alert is None else alert))


@team_tasks.register
def _team_tasks_of_intercept(behavior: Intercept, now: Situation) -> tuple[Task, ...]:
    """Return the task sigma = q, which takes all directions: the velocity of the interception."""
    point, course = quarry(behavior, now)
    way = point - now.q
    left = np.maximum(np.linalg.norm(way, axis=1) - behavior.within, 0.0)
    speed = min(behavior.speed or UNLIMITED, now.setup.max_speed)
    velocity = toward_meeting(way, course, speed, behavior.gain * left)
    active = is_active(behavior, now)
    wanted = np.where(active[:, None], velocity, 0.0)
    return (Task(np.diag(np.repeat(active, now.q.shape[1]).astype(float)), wanted.ravel()),)


@is_active.register
def _active_of_intercept(behavior: Intercept, now: Situation) -> NDArray[np.bool_]:
    """Return which robots go for something, shape (n,)."""
    return guarding(now, behavior.alert) if behavior.guards else np.ones(len(now.q), dtype=bool)


@task_error.register
def _error_of_intercept(behavior: Intercept, now: Situation) -> Array:
    """Return the distance that is left."""
    point, _ = quarry(behavior, now)
    left = np.maximum(np.linalg.norm(point - now.q, axis=1) - behavior.within, 0.0)
    return np.where(is_active(behavior, now), left, 0.0)


def quarry(behavior: Intercept, now: Situation) -> tuple[Array, Array]:
    """Return where each robot believes its quarry to be [m], and how fast it moves [m/s]."""
    if not behavior.guards:
        return now.c, now.c_dot
    assert now.threats is not None
    return now.threats.position, now.threats.velocity


def toward_meeting(way: Array, course: Array, speed: float, closing: Array | float = np.inf) -> Array:
    """Return the velocities of robots that go straight to where they meet what moves straight.

    Args:
        way: To where it is now, shape (n, p) [m].
        course: How fast it moves, likewise [m/s].
        speed: Of the robots, at most [m/s].
        closing: Velocity relative to it, at most, as far as they still meet it, shape (n,) [m/s].
    """
    recedes, far, fast = (np.sum(a * b, axis=1) for a, b in ((way, course), (way, way), (course, course)))
    lead = speed**2 - fast
    slack = recedes**2 + lead * far
    rise = np.sqrt(np.maximum(slack, 0.0))
    passes = (lead < 0.0) & ((recedes > 0.0) | (slack < 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.where(recedes > 0.0, lead / (rise + recedes), (rise - recedes) / far)
        slowest = np.where(lead < 0.0, -lead / (rise - recedes), 0.0)
        rate = np.minimum(np.maximum(closing / np.sqrt(far), slowest), rate)
        aside = np.sqrt(np.maximum(far * fast - recedes**2, 0.0) / -lead)
        later = np.maximum(speed * aside - recedes, 0.0) / fast
    meeting = course + np.where(far > 0.0, rate, 0.0)[:, None] * way
    nearest = speed * directions(way + np.where(passes, later, 0.0)[:, None] * course)
    return np.where(passes[:, None], nearest, meeting)


@team_tasks.register
def _team_tasks_of_vertices(behavior: Vertices, now: Situation) -> tuple[Task, ...]:
    """Return the task across the way to the target: toward the robot's vertex, R u_i - (q_i - c)."""
    x = now.q - now.c
    across = tangential(x)
    wanted = behavior.gain * (
        now.radius[:, None] * np.einsum("iab,ib->ia", now.rotation, now.team.vertices) - x
    )
    return (Task(across, across @ wanted.ravel()),)


@task_error.register
def _error_of_vertices(behavior: Vertices, now: Situation) -> Array:
    """Return the way to the vertex along the sphere."""
    return np.asarray(np.linalg.norm(wish(behavior, now), axis=1) / behavior.gain)


def turned_rotation(rotation: Array, q: Array, c: Array, vertices: Array, share: float = 1.0) -> Array:
    """One step of the rotation that fits the even figure to the robots, shape (p, p).

    A skew step to where the correlation of robots and turned vertices is symmetric, then one Newton-Schulz
    step back to the rotations.
    """
    m = directions(q - c).T @ vertices @ rotation.T
    if np.trace(m) <= 0.0:
        return rotation
    scale = max(np.trace(m), np.linalg.norm(m - m.T) / np.sqrt(2.0))
    rotation = rotation + share * (m - m.T) / scale @ rotation
    return np.asarray(0.5 * rotation @ (3.0 * np.eye(len(rotation)) - rotation.T @ rotation))


@team_tasks.register
def _team_tasks_of_orbit(behavior: Orbit, now: Situation) -> tuple[Task, ...]:
    """Return the task of `vertices` with the rotation added: it is across q - c, as the task is."""
    x = now.q - now.c
    turn = np.zeros_like(x)
    turn[:, 0], turn[:, 1] = -behavior.rate * x[:, 1], behavior.rate * x[:, 0]
    (task,) = _team_tasks_of_vertices(behavior, now)
    return (Task(task.jacobian, task.rate + tangential(x) @ turn.ravel()),)


@task_error.register
def _error_of_orbit(behavior: Orbit, now: Situation) -> Array:
    """Return the way to the vertex along the sphere; the rotation is no error."""
    (task,) = _team_tasks_of_vertices(behavior, now)
    return np.asarray(np.linalg.norm(task.rate.reshape(now.q.shape), axis=1) / behavior.gain)


@team_tasks.register
def _team_tasks_of_repulsion(behavior: Repulsion, now: Situation) -> tuple[Task, ...]:
    """Return the task across the way to the target: down the Coulomb energy of the directions."""
    x, setup, lost = now.q - now.c, now.setup, now.team.lost
    mates = np.broadcast_to(now.q, (len(x), *x.shape)) if now.mates is None else now.mates
    across, u = tangential(x), directions(x)
    others = mates - now.c[:, None]
    offset = u[:, None] - directions(others.reshape(-1, x.shape[1])).reshape(others.shape)
    apart = np.linalg.norm(offset, axis=2)
    with np.errstate(divide="ignore"):
        weight = np.where(apart > 1e-12, apart**-3.0, 0.0)
    weight[(np.linalg.norm(others, axis=2) == 0.0) | lost] = 0.0
    gaps = np.linalg.norm(now.q[:, None] - now.q, axis=2) - setup.robot_radius[:, None] - setup.robot_radius
    np.fill_diagonal(gaps, 0.0)
    near = (gaps <= setup.sensing.robots) | (setup.radio is not None)
    known = near & np.isfinite(mates).all(axis=2) & ~lost
    push = np.einsum("ij,ijk->ik", np.where(known, weight, 0.0), np.where(known[..., None], offset, 0.0))
    push = (across @ push.ravel()).reshape(x.shape)
    push /= np.maximum(known.sum(axis=1, keepdims=True), 1)
    push[np.linalg.norm(x, axis=1) == 0.0] = 0.0
    speed = np.linalg.norm(push, axis=1, keepdims=True)
    wanted = behavior.gain * now.radius[:, None] * push / np.maximum(speed, 1.0)
    return (Task(across, across @ wanted.ravel()),)


@task_error.register
def _error_of_repulsion(behavior: Repulsion, now: Situation) -> Array:
    """Return what it wishes for, as a length."""
    return np.asarray(np.linalg.norm(wish(behavior, now), axis=1) / behavior.gain)


@team_tasks.register
def _team_tasks_of_spacing(behavior: Spacing, now: Situation) -> tuple[Task, ...]:
    """Return the task across the way to the target: half the difference of both angles, as a way."""
    x = now.q - now.c
    wanted = np.zeros_like(x)
    wanted[:, 0], wanted[:, 1] = -x[:, 1], x[:, 0]
    wanted *= behavior.gain * off_middle(behavior, now)[:, None]
    across = tangential(x)
    return (Task(across, across @ wanted.ravel()),)


def off_middle(behavior: Spacing, now: Situation) -> Array:
    """Return the angle from each robot to the middle between its neighbors, shape (n,) [rad]."""
    setup, q = now.setup, now.q
    mates = np.broadcast_to(q, (len(q), *q.shape)) if now.mates is None else now.mates
    gaps = np.linalg.norm(q[:, None] - mates, axis=2) - setup.robot_radius[:, None] - setup.robot_radius
    known = np.isfinite(gaps) & ~now.team.lost
    if now.mates is None or setup.radio is None:
        known &= gaps <= setup.sensing.robots
    angle = np.arctan2(mates[..., 1] - now.c[:, None, 1], mates[..., 0] - now.c[:, None, 0])
    found = np.zeros(len(q))
    for i in range(len(q)):
        others = np.flatnonzero(known[i] & (np.arange(len(q)) != i))
        own = math.atan2(q[i, 1] - now.c[i, 1], q[i, 0] - now.c[i, 0])
        ahead = np.mod(angle[i, others] - own, TURN)
        found[i] = 0.5 * (ahead.min() + ahead.max() - TURN) if len(others) else 0.0
    return found


@task_error.register
def _error_of_spacing(behavior: Spacing, now: Situation) -> Array:
    """Return the way to the middle along the circle."""
    return np.asarray(np.linalg.norm(wish(behavior, now), axis=1) / behavior.gain)


@team_tasks.register
def _team_tasks_of_surface(behavior: Surface, now: Situation) -> tuple[Task, ...]:
    """Return eq. 5: sigma = |q - c|^2 / 2 is to become radius^2 / 2, which may change."""
    sigma, jacobian = half_squared_distance(now.q, now.c)
    ahead: Array | float = now.radius
    if behavior.has_own_radius:
        ahead = _lead_radius(*radius_now(behavior, now), behavior.gain)
    return (Task(jacobian, behavior.gain * (0.5 * ahead**2 - sigma)),)


@task_error.register
def _error_of_surface(behavior: Surface, now: Situation) -> Array:
    """Return | |q - c| - radius |."""
    radius = radius_now(behavior, now)[0] if behavior.has_own_radius else now.radius
    return np.abs(np.linalg.norm(now.q - now.c, axis=1) - radius)


def radius_now(behavior: Surface, now: Situation) -> tuple[float, float]:
    setup, place = now.setup, int(behavior.packed(now.setup)["radius_index"])
    wanted, rate = (float(f(now.time)[0]) for f in (setup.radii[place].position, setup.radii[place].velocity))
    if not behavior.fit:
        return wanted, rate
    room, opening = math.inf, 0.0
    for point, size, velocity in zip(
        setup.obstacles_seen()[-1], setup.obstacle_radius, setup.obstacle_velocities(), strict=True
    ):
        way = now.c[0] - point
        apart = float(np.linalg.norm(way))
        if apart - size < min(room, wanted + setup.sensing.obstacles):
            room, opening = apart - size, float(way @ (now.c_dot[0] - velocity)) / max(apart, 1e-300)
    soft = SOFT * setup.radius
    return fitted(
        wanted, rate, room - _obstacle_clearance(setup), opening, soft, behavior.least_radius(setup)
    )
