"""The law once more, in plain NumPy and straight from the paper: the twin of the compiled kernels.

Here the team is one vector of p n coordinates. A behavior is a task with the paper's block-diagonal
Jacobian J, shape (n, p n); its velocity is J^+ Lambda sigma~ and its null space I - J^+ J, with
`numpy.linalg.pinv` for J^+. Nothing is simplified, so this code and the kernels share neither a line
nor a closed form. It is slow, and it is what the kernels are held against.

Unless said otherwise q, v, e are of the whole team, shape (n, p) [m], [m/s], [m], world frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.behaviors import AvoidObstacles, Chords, Repulsion, Surface, Vertices
from escort_mj.control.setup import Setup

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

NOISE_KEY = 0x6573636F72745F6D  # "escort_m": the second word of the generator's key


class ReferenceSignals(NamedTuple):
    """One evaluation of the law; names, units and meanings as in `escort_mj.signals`."""

    q_measured: Array  # (n, p)
    v_measured: Array  # (n, p)
    q_d: Array  # (n, p)
    v_d: Array  # (n, p)
    e: Array  # (n, p)
    e_dot: Array  # (n, p)
    s: Array  # (n, p)
    tau: Array  # (n, p)
    rho_hat: Array  # (n, p)
    disturbance: Array  # (n, p)
    target_position: Array  # (p,)
    target_velocity: Array  # (p,)
    avoidance_active: Mask  # (n,)


class Task(NamedTuple):
    """A task function sigma of the team; J differentiates each robot's row by its own position only."""

    value: Array  # (n,)
    jacobian: Array  # (n, p n)


def half_squared_distance(q: Array, anchors: Array) -> Task:
    """Task of the escort behaviors: sigma_i = |q_i - a_i|^2 / 2 (eqs. 4 and 5).

    Args:
        q: Positions.
        anchors: Each robot's predecessor, or the target, shape (n, p) or (p,) [m].
    """
    x = q - anchors
    return Task(0.5 * np.sum(x * x, axis=1), block_diagonal(x))


def distance(q: Array, anchors: Array) -> Task:
    """Task of obstacle avoidance: sigma_i = |q_i - o_i|, whose gradient is r_i (eq. 3).

    Where a robot stands exactly on o_i every direction leads away, and the first axis is taken.

    Args:
        q: Positions.
        anchors: Each robot's obstacle, shape (n, p) or (p,) [m].
    """
    x = q - anchors
    value = np.linalg.norm(x, axis=1)
    r = np.where(value[:, None] > 0.0, x, np.eye(q.shape[1])[0])
    return Task(value, block_diagonal(r / np.linalg.norm(r, axis=1, keepdims=True)))


def block_diagonal(rows: Array) -> Array:
    """Stacks one row per robot into blockdiag{row_1, ..., row_n}, shape (n, p n)."""
    count, axes = rows.shape
    blocks = np.zeros((count, count, axes))
    blocks[np.arange(count), np.arange(count)] = rows
    return blocks.reshape(count, count * axes)


def resolve(jacobian: Array, rate: Array) -> tuple[Array, Array]:
    """Least velocity that changes a task at a rate, and its null space: J^+ rate and I - J^+ J (eq. 2).

    Args:
        jacobian: J, shape (n, p n).
        rate: Lambda sigma~, shape (n,).

    Returns:
        Velocity of the team, shape (p n,) [m/s], and projector, shape (p n, p n).
    """
    inverse = np.linalg.pinv(jacobian)
    return inverse @ rate, np.eye(jacobian.shape[1]) - inverse @ jacobian


def escort(behavior: Chords | Surface, q: Array, c: Array, setup: Setup) -> tuple[Array, Array]:
    """Velocity and null space of an escort behavior, summed over the formation's cycles (eqs. 2, 4, 5).

    Returns:
        Velocity, shape (p n,) [m/s], and projector, shape (p n, p n).
    """
    if isinstance(behavior, Chords):
        assert setup.arrangement is not None
        length, anchors = setup.arrangement.length, [q[robots] for robots in setup.arrangement.predecessors]
    else:
        length, anchors = setup.radius, [np.broadcast_to(c, q.shape)]
    velocity, projector = np.zeros(q.size), np.zeros((q.size, q.size))
    for anchor in anchors:
        sigma, jacobian = half_squared_distance(q, anchor)
        v_c, projector_c = resolve(jacobian, behavior.gain * (0.5 * length**2 - sigma))
        velocity, projector = velocity + v_c, projector + projector_c
    return velocity, projector


def spread(
    behavior: Vertices | Repulsion, q: Array, c: Array, rotation: Array, setup: Setup
) -> tuple[Array, Array]:
    """Velocity and null space of a behavior that moves robots along the sphere (remark 1).

    Its task is all that is tangential: J is the projector on the tangent spaces, shape (p n, p n).

    Args:
        behavior: Its parameters.
        q: Positions.
        c: Position of the target, shape (p,) [m].
        rotation: Of the even figure, shape (p, p).
        setup: Gives the radius and the figure.

    Returns:
        Velocity, shape (p n,) [m/s], and projector, shape (p n, p n).
    """
    x = q - c
    radial = block_diagonal(x)
    tangential = np.eye(q.size) - np.linalg.pinv(radial) @ radial
    if isinstance(behavior, Vertices):
        assert setup.figure is not None
        wish = behavior.gain * (setup.radius * setup.figure.vertices @ rotation.T - x)
    else:
        u = directions(x)
        offset = u[:, None] - u
        apart = np.linalg.norm(offset, axis=2)
        with np.errstate(divide="ignore"):
            weight = np.where(apart > 1e-12, apart**-3.0, 0.0)
        weight[:, np.linalg.norm(x, axis=1) == 0.0] = 0.0
        push = (tangential @ np.einsum("ij,ijk->ik", weight, offset).ravel()).reshape(q.shape) / len(q)
        push[np.linalg.norm(x, axis=1) == 0.0] = 0.0
        speed = np.linalg.norm(push, axis=1, keepdims=True)
        wish = behavior.gain * setup.radius * push / np.maximum(speed, 1.0)
    return tangential @ wish.ravel(), np.eye(q.size) - tangential


def directions(x: Array) -> Array:
    """Unit vectors, zero where x is zero; shape of x."""
    length = np.linalg.norm(x, axis=1, keepdims=True)
    return np.divide(x, length, out=np.zeros_like(x), where=length > 0.0)


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


def intrusion(avoid: AvoidObstacles, q: Array, setup: Setup) -> tuple[Array, Array]:
    """How deep the worst intruder is in each robot's safe sphere, and where it stands (eq. 3, remark 2).

    Returns:
        sigma~, not positive where nobody intrudes, shape (n,) [m], and positions, shape (n, p) [m].
    """
    centers = np.concatenate([setup.obstacle_position, q])
    gaps = np.linalg.norm(q[:, None] - centers, axis=2)
    if avoid.measure == "surface":
        radii = np.concatenate([setup.obstacle_radius, setup.robot_radius])
        gaps -= setup.robot_radius[:, None] + radii
    obstacles, robots = len(setup.obstacle_position), np.arange(len(q))
    teammate_distance = setup.teammate_distance(avoid) if avoid.teammates else -np.inf
    depth = np.repeat([avoid.safe_distance, teammate_distance], [obstacles, len(q)]) - gaps
    depth[robots, obstacles + robots] = -np.inf  # nobody avoids itself
    worst = np.argmax(depth, axis=1)
    return depth[robots, worst], centers[worst]


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


def avoidance(avoid: AvoidObstacles, q: Array, v: Array, e: Array, setup: Setup) -> tuple[Array, Array, Mask]:
    """Velocity and null space of obstacle avoidance; zero and the identity where it is inactive (eqs. 2, 3).

    Returns:
        Velocity, shape (p n,) [m/s], projector, shape (p n, p n), and who avoids, shape (n,).
    """
    depth, intruder = intrusion(avoid, q, setup)
    active = depth > 0.0
    jacobian = np.where(active[:, None], distance(q, intruder).jacobian, 0.0)
    speed, error = np.linalg.norm(v, axis=1), np.linalg.norm(e, axis=1)
    rate = np.zeros(len(q))
    gain = escape_gain(avoid, depth[active], speed[active], error[active], setup.law.slope)
    rate[active] = gain * depth[active]
    return *resolve(jacobian, rate), active


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


def switching(s: Array, smoothing: str, width: float) -> Array:
    """What stands for sgn(s) in eq. 9: tanh (eq. 17), a clipped line, or the sign itself; shape of s."""
    if smoothing == "sign":
        return np.sign(s)
    return np.tanh(s / width) if smoothing == "tanh" else np.clip(s / width, -1.0, 1.0)


def ball_noise(seed: int, robot: int, step: int, axes: int, balls: int = 2) -> Array:
    """Draws points from the unit ball, uniformly, by rejection; shape (balls, axes).

    Each (robot from 0, physics step) has a stream of its own: Philox4x64-10, counted from block 1, each of
    its words giving two coordinates, the lower half first. The points follow each other in the stream.
    """
    generator = np.random.Philox(
        key=np.array([seed, NOISE_KEY], dtype=np.uint64),
        counter=np.array([0, 0, robot, step], dtype=np.uint64),
    )
    points: list[Array] = []
    waiting = np.zeros(0)
    while len(points) < balls:
        if len(waiting) < axes:
            words = generator.random_raw(4)
            halves = np.stack([words & np.uint64(2**32 - 1), words >> np.uint64(32)], axis=1).ravel()
            waiting = np.concatenate([waiting, (halves.astype(np.float64) + 0.5) * 2.0**-31 - 1.0])
        point, waiting = waiting[:axes], waiting[axes:]
        if point @ point <= 1.0:
            points.append(point)
    return np.array(points)


class ReferenceController:
    """The whole law with its state: reference position q_d [m] and estimate rho_hat [N], both (n, p)."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.gains = setup.law.gains()

    def reset(self, q0: Array) -> None:
        """Starts a mission at the true initial positions: q_d(0) = q(0), rho_hat(0) as the law says."""
        self.q_d = np.array(q0, dtype=np.float64)
        self.rho_hat = np.full_like(self.q_d, self.gains.rho_hat_0)
        self._time: float | None = None
        self._rotation = np.eye(self.setup.axes)
        self._q_d_rate = np.zeros_like(self.q_d)
        self._rho_hat_rate = np.zeros_like(self.q_d)

    def evaluate(self, t: float, q: Array, v: Array) -> ReferenceSignals:
        """Advances the state if time has advanced, then evaluates the law.

        Args:
            t: Time [s]; the state moves one timestep if this is later than at the last evaluation.
            q: True positions, shape (n, p) [m].
            v: True velocities, shape (n, p) [m/s].
        """
        setup, law = self.setup, self.setup.law
        moved = self._time is None or t > self._time
        if self._time is not None and moved:
            self.q_d = self.q_d + setup.timestep * self._q_d_rate
            self.rho_hat = self.rho_hat + setup.timestep * self._rho_hat_rate
        self._time = t

        noise_q, noise_v = self._noise(t)
        q_m, v_m = q + noise_q, v + noise_v
        target, target_velocity = setup.target.position(t), setup.target.velocity(t)
        push = np.zeros(q.shape)
        if setup.disturbance is not None:
            push += setup.disturbance.position(t)

        if moved and setup.figure is not None:
            self._rotation = turned(self._rotation, q_m, target, setup.figure.vertices)
        e = self.q_d - q_m
        v_d, active = self._outer_loop(q_m, v_m, e, target, target_velocity)
        e_dot = v_d - v_m
        s = e_dot + law.slope * e
        sw = switching(s, law.smoothing, law.boundary_layer)
        tau = self.rho_hat + self.gains.kp * e + self.gains.kd * e_dot + self.gains.k * sw

        outward = (np.abs(tau) > setup.force_limit[:, None]) & (s * tau > 0.0) & law.anti_windup
        self._q_d_rate = np.where(outward, v_m, v_d)
        self._rho_hat_rate = np.where(outward, 0.0, self.gains.mu * s)
        return ReferenceSignals(
            q_m, v_m, self.q_d, v_d, e, e_dot, s, tau, self.rho_hat, push, target, target_velocity, active
        )

    def _noise(self, t: float) -> tuple[Array, Array]:
        """Measurement noise of all robots at t, of positions [m] and velocities [m/s], shape (n, p) each.

        A ball of radius 0 draws nothing, so that the other ball's points come first in the stream.
        """
        setup = self.setup
        step = round(t / setup.timestep)
        radii = [setup.noise_position, setup.noise_velocity]
        noise = np.zeros((2, setup.count, setup.axes))
        drawn = [channel for channel, radius in enumerate(radii) if radius > 0.0]
        for robot in range(setup.count if drawn else 0):
            points = ball_noise(setup.seed, robot, step, setup.axes, len(drawn))
            for channel, point in zip(drawn, points, strict=True):
                noise[channel, robot] = radii[channel] * point
        return noise[0], noise[1]

    def _outer_loop(self, q: Array, v: Array, e: Array, c: Array, c_dot: Array) -> tuple[Array, Mask]:
        """Composes the behaviors from the lowest priority to the highest (eq. 2); v_d and who avoids.

        Avoidance works in the world's frame: w -> v1 + N1 w. Escort behaviors work in the target's,
        where the behaviors below move at w - c_dot: w -> c_dot + sum_c [v2_c + N2_c (w - c_dot)].
        """
        setup = self.setup
        c_dot = np.tile(c_dot, len(q)) * setup.target_feedforward
        carried = c_dot  # what the projections leave of c_dot
        parts: list[Array] = []
        place = 0  # of c_dot among the parts: right before the highest escort behavior
        avoiding = np.zeros(len(q), dtype=bool)
        for behavior in reversed(setup.behaviors):
            if isinstance(behavior, AvoidObstacles):
                velocity, projector, active = avoidance(behavior, q, v, e, setup)
                carried, place, avoiding = projector @ carried, place + 1, avoiding | active
            else:
                if isinstance(behavior, Vertices | Repulsion):
                    velocity, projector = spread(behavior, q, c, self._rotation, setup)
                else:
                    velocity, projector = escort(behavior, q, c, setup)
                carried, place = c_dot + projector @ (carried - c_dot), 0
            parts = [velocity, *(projector @ part for part in parts)]
        parts.insert(place, carried)
        if not np.isfinite(setup.max_speed):
            return np.sum(parts, axis=0).reshape(q.shape), avoiding
        by_robot = np.array(parts).reshape(len(parts), *q.shape).swapaxes(0, 1)
        return np.array([spend(robot, setup.max_speed) for robot in by_robot]), avoiding
