"""Tasks of the whole team, with the paper's block-diagonal Jacobians, shape (n, p n), and numpy's pinv."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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


def directions(x: Array) -> Array:
    """Unit vectors, zero where x is zero; shape of x."""
    length = np.linalg.norm(x, axis=1, keepdims=True)
    return np.divide(x, length, out=np.zeros_like(x), where=length > 0.0)
