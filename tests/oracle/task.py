"""Tasks of the whole team in NumPy, with the paper's block-diagonal Jacobians and numpy's pinv."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from tests.oracle.setup import SetupNow, radius_at

if TYPE_CHECKING:
    from tests.oracle.failure import KnownRobots
    from tests.oracle.opponents import Threats
    from tests.oracle.teammates import Heard

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
T = TypeVar("T")


@dataclass(frozen=True)
class Situation:
    """What a behavior's NumPy form sees.

    Attributes:
        setup: What the controller knows of the mission.
        team: Who is left, and in which formation.
        rotation: Of the even figure as each robot has it, shape (n, p, p).
        q: Measured positions, shape (n, p) [m].
        v: Measured velocities, shape (n, p) [m/s].
        e: Tracking errors, shape (n, p) [m].
        c: Position of the target as each robot knows it, shape (n, p) [m].
        c_dot: Velocity of the target, likewise [m/s].
        mates: Where each robot knows its teammates to be, NaN for those that it does not know of, shape
            (n, n, p) [m]; None where all know the measured positions.
        heard: Where each robot's teammates may be after what they have sent; None without a radio.
        goal: Points that the robots go to, shape (n, p) [m].
        goal_velocity: How fast these move, shape (n, p) [m/s].
        time: [s].
        threats: What each robot guards against; None without opponents.
        members: Team of each robot, from 0, shape (n,); None where all are one team.
        held: Velocities that robots hold, NaN for those that run their outer loops now, shape (n, p) [m/s];
            None where all do.
        memory: State of the outer loop, arrays of shape (n,) by name; changed.
    """

    setup: SetupNow
    team: KnownRobots
    rotation: Array
    q: Array
    v: Array
    e: Array
    c: Array
    c_dot: Array
    goal: Array
    goal_velocity: Array
    time: float = 0.0
    mates: Array | None = None
    threats: Threats | None = None
    members: NDArray[np.int64] | None = None
    heard: Heard | None = None
    held: Array | None = None
    memory: dict[str, Array] = field(default_factory=dict)
    _known: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def radius(self) -> Array:
        """Distance that each robot keeps from its target, shape (n,) [m]."""
        if self.members is None:
            return np.full(len(self.q), self.setup.radius)
        moment = self.time + 0.5 * self.setup.timestep
        return np.array([radius_at(self.setup, team, moment) for team in self.setup.teams])[self.members]

    def once(self, key: Any, find: Callable[[], T]) -> T:
        """Return what is found, which a situation finds once for each key."""
        if key not in self._known:
            self._known[key] = find()
        found: T = self._known[key]
        return found


class Task(NamedTuple):
    """What a behavior asks: J v = rate, with J of shape (rows, p n), n or p n rows, in robots' order."""

    jacobian: Array
    rate: Array


class Function(NamedTuple):
    """A task function sigma of the team; J differentiates each robot's row by its own position only."""

    value: Array  # (n,)
    jacobian: Array  # (n, p n)


def resolve_all(tasks: tuple[Task, ...]) -> tuple[Array, Array]:
    """Return velocity and null space of tasks of one priority: sum J^+ rate, sum (I - J^+ J)."""
    parts = [resolve(*task) for task in tasks]
    if len(parts) == 1:
        return parts[0]
    return np.sum([part[0] for part in parts], axis=0), np.sum([part[1] for part in parts], axis=0)


def row_spaces(task: Task, axes: int) -> Array:
    """Return the rows of a task's Jacobian that move each robot, shape (n, rows, p)."""
    count = task.jacobian.shape[1] // axes
    robots = np.arange(count)
    return task.jacobian.reshape(count, -1, count, axes)[robots, :, robots]


def half_squared_distance(q: Array, anchors: Array) -> Function:
    """Task of the escort behaviors: sigma_i = |q_i - a_i|^2 / 2 (eqs. 4 and 5).

    Args:
        q: Positions.
        anchors: Each robot's predecessor, or the target, shape (n, p) or (p,) [m].
    """
    x = q - anchors
    return Function(0.5 * np.sum(x * x, axis=1), block_diagonal(x))


def distance(q: Array, anchors: Array) -> Function:
    """Task of obstacle avoidance: sigma_i = |q_i - o_i|, whose gradient is r_i (eq. 3).

    Where a robot stands exactly on o_i every direction leads away, and the first axis is taken.

    Args:
        q: Positions.
        anchors: Each robot's obstacle, shape (n, p) or (p,) [m].
    """
    x = q - anchors
    value = np.linalg.norm(x, axis=1)
    r = np.where(value[:, None] > 0.0, x, np.eye(q.shape[1])[0])
    return Function(value, block_diagonal(r / np.linalg.norm(r, axis=1, keepdims=True)))


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


def tangential(x: Array) -> Array:
    """Return the projector on what is across each robot's own x, shape (p n, p n); x has the shape (n, p)."""
    radial = block_diagonal(x)
    return np.eye(x.size) - np.linalg.pinv(radial) @ radial


def directions(x: Array) -> Array:
    """Unit vectors, zero where x is zero; shape of x."""
    length = np.linalg.norm(x, axis=1, keepdims=True)
    return np.divide(x, length, out=np.zeros_like(x), where=length > 0.0)
