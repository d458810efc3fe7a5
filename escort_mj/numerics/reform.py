"""Re-forming: the even figure of the robots that are left, placed again in the middle of a mission.

The figures themselves are solved when the world is built. Which robot takes which vertex is found inside the
step that learns of the loss: assignment (exact) and rotation (best fit) in turn, from several rotations.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np

from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import inlined, kernel
from escort_mj.numerics.thomson import even_points

MOST_TURNS = 64  # rotations to start from, beside the present one
FEW = 32  # robots up to which so many are tried; the work of an assignment grows with the third power
ALTERNATIONS = 30
SWEEPS = 60
SAME = 1e-9  # alignments that differ by less are one
NOTHING = 1e-16  # share of a matrix that is rounding


class ReformingParameters(Fields):
    """What the controller needs to place the even figure of fewer robots."""

    figures: Annotated[Array, "points", "p", Value("1", "even points of n - 1, n - 2 ... robots")]
    turns: Annotated[Array, "turns*p", "p", Value("1", "rotations to start from, one below another")]

    @classmethod
    def packed(cls, setup: Any) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        figures, turns = setup.reforming or ((), np.zeros((0, setup.axes, setup.axes)))
        return {
            "figures": np.vstack([np.zeros((0, setup.axes)), *figures]),
            "turns": turns.reshape(-1, setup.axes),
        }


class ReformingState(Fields):
    """What `reform` works on."""

    scratch: Annotated[Array, "scratch", Value("1", "scratch, see `scratch_size`")]


class Reforming(NamedTuple):
    """What the controller needs to place the even figure of fewer robots.

    Attributes:
        figures: Even points of n - 1, n - 2 ... robots, one array of shape (count, p) each.
        turns: Rotations from which the search for a placing starts, shape (k, p, p).
    """

    figures: tuple[Array, ...]
    turns: Array


def reforming(count: int, axes: int, losses: int) -> Reforming:
    """Figures and rotations for a team that may lose robots.

    Args:
        count: Number of robots, n.
        axes: Dimension of the space, p.
        losses: How many of them fail.
    """
    figures = tuple(even_points(count - lost, axes) for lost in range(1, losses + 1))
    random = np.random.Generator(np.random.Philox(1))
    tries = min(MOST_TURNS, int(MOST_TURNS * (FEW / count) ** 3))
    turns = (
        np.linalg.qr(random.standard_normal((tries, axes, axes))).Q if tries else np.zeros((0, axes, axes))
    )
    turns[..., 0] *= np.linalg.det(turns)[:, None]
    return Reforming(figures, turns)


@inlined
def scratch_size(count: int, axes: int) -> int:
    """Numbers that `reform` needs to work with."""
    return 6 * (count + 1) + 2 * count + 3 * count * axes + 4 * axes * axes


@kernel
def reform(
    q: Array, center: Array, lost: Array, figures: Array, turns: Array, rotation: Array, vertices: Array,
    scratch: Array,
) -> None:  # fmt: skip
    """Gives each robot that is left a vertex of the smaller figure, so that all have the least way to go.

    Maximizes the sum of d_i . R f_a(i) over assignments a and rotations R, with d_i the robots' directions.

    Args:
        q: Measured positions, shape (n, p) [m].
        center: Position of the target, shape (p,) [m].
        lost: 1 for robots that do not count, shape (n,).
        figures: Points of the figures of n - 1, n - 2 ... robots, one figure below another, shape (rows, p).
        turns: Rotations to start from, one below another, shape (k p, p).
        rotation: The present rotation, tried first, shape (p, p); the identity afterward.
        vertices: Result, the vertices of the robots that are left, shape (n, p); zero for the others.
        scratch: Working memory, shape (>= scratch_size(n, p),).
    """
    n, p = q.shape
    robots, taken = scratch[:n], scratch[n : 2 * n]
    at = 2 * n
    directions = scratch[at : at + n * p]
    placed = scratch[at + n * p : at + 2 * n * p]
    best = scratch[at + 2 * n * p : at + 3 * n * p]
    at += 3 * n * p
    r, h = scratch[at : at + p * p], scratch[at + p * p : at + 2 * p * p]
    u, v = scratch[at + 2 * p * p : at + 3 * p * p], scratch[at + 3 * p * p : at + 4 * p * p]
    work = scratch[at + 4 * p * p :]
    left = first = 0
    for i in range(n):
        if lost[i] != 0.0:
            continue
        square = 0.0
        for k in range(p):
            square += (q[i, k] - center[k]) ** 2
        scale = 1.0 / math.sqrt(square) if square > 0.0 else 0.0
        for k in range(p):
            directions[left * p + k] = scale * (q[i, k] - center[k])
        robots[left] = i
        left += 1
    for count in range(left + 1, n):
        first += count

    highest = -math.inf
    for trial in range(turns.shape[0] // p + 1):
        for a in range(p):
            for b in range(p):
                r[a * p + b] = rotation[a, b] if trial == 0 else turns[(trial - 1) * p + a, b]
        for row in range(left):
            taken[row] = -1.0
        for _ in range(ALTERNATIONS):
            for row in range(left):
                for a in range(p):
                    total = 0.0
                    for b in range(p):
                        total += r[a * p + b] * figures[first + row, b]
                    placed[row * p + a] = total
            if not assign(directions, placed, left, p, work):
                return  # a position is not a number: the mission is lost anyway
            changed = False
            for row in range(left):
                changed = changed or taken[row] != work[row]
                taken[row] = work[row]
            if not changed:
                break
            for a in range(p):
                for b in range(p):
                    total = 0.0
                    for row in range(left):
                        total += directions[row * p + a] * figures[first + int(taken[row]), b]
                    h[a * p + b] = total
            fit_rotation(h, r, u, v, p)
        alignment = 0.0
        for row in range(left):
            for a in range(p):
                alignment += directions[row * p + a] * placed[int(taken[row]) * p + a]
        if alignment > highest + SAME:
            highest = alignment
            for row in range(left):
                for a in range(p):
                    best[row * p + a] = placed[int(taken[row]) * p + a]

    for i in range(n):
        for k in range(p):
            vertices[i, k] = 0.0
    for row in range(left):
        for k in range(p):
            vertices[int(robots[row]), k] = best[row * p + k]
    for a in range(p):
        for b in range(p):
            rotation[a, b] = 1.0 if a == b else 0.0


@inlined
def fit_rotation(h: Array, r: Array, u: Array, v: Array, p: int) -> None:
    """The rotation R for which tr(R^T H) is largest (orthogonal Procrustes, Kabsch).

    H becomes diagonal by rotations from the left, U, and from the right, V, of two axes at a time
    (Kogbetliantz): U^T H V = S, each pair of S with a sum that is not negative, and R = U V^T. No reflection
    ever enters.

    Args:
        h: Correlation H of directions and vertices, row after row, shape (p p,); becomes S.
        r: Result R, row after row, shape (p p,).
        u: Working memory, shape (p p,).
        v: Working memory, shape (p p,).
        p: Number of axes.
    """
    total = 0.0
    for k in range(p * p):
        u[k] = v[k] = 1.0 if k % (p + 1) == 0 else 0.0
        total += h[k] * h[k]
    small = NOTHING * math.sqrt(total)
    for _ in range(SWEEPS):
        done = True
        for a in range(p):
            for b in range(a):
                off = max(abs(h[a * p + b]), abs(h[b * p + a]))
                along = h[a * p + a] + h[b * p + b]
                if off <= small and along >= -small:
                    continue
                done = False
                across = h[b * p + a] - h[a * p + b]
                length = math.sqrt(along * along + across * across)
                if length > 0.0:  # makes the two by two block symmetric, and its trace as large as can be
                    cosine, sine = along / length, across / length
                    for k in range(p):
                        _turn(h, a * p + k, b * p + k, cosine, sine)
                        _turn(u, k * p + a, k * p + b, cosine, sine)
                if abs(h[a * p + b]) <= small:
                    continue
                ratio = 0.5 * (h[a * p + a] - h[b * p + b]) / h[a * p + b]
                tangent = 1.0 / (abs(ratio) + math.sqrt(ratio * ratio + 1.0))
                if ratio < 0.0:
                    tangent = -tangent
                cosine = 1.0 / math.sqrt(tangent * tangent + 1.0)
                sine = tangent * cosine
                for k in range(p):
                    _turn(h, a * p + k, b * p + k, cosine, sine)
                    _turn(u, k * p + a, k * p + b, cosine, sine)
                for k in range(p):
                    _turn(h, k * p + a, k * p + b, cosine, sine)
                    _turn(v, k * p + a, k * p + b, cosine, sine)
        if done:
            break
    for a in range(p):
        for b in range(p):
            total = 0.0
            for k in range(p):
                total += u[a * p + k] * v[b * p + k]
            r[a * p + b] = total


@inlined
def _turn(x: Array, i: int, j: int, cosine: float, sine: float) -> None:
    """Turns the pair of numbers at two places."""
    x[i], x[j] = cosine * x[i] + sine * x[j], cosine * x[j] - sine * x[i]


@inlined
def assign(rows: Array, columns: Array, count: int, p: int, work: Array) -> bool:
    """Gives each row vector the column vector of its own so that the sum of their products is largest.

    The Hungarian method by shortest augmenting paths (Jonker and Volgenant), O(count^3).

    Args:
        rows: Vectors, one after another, shape (>= count p,).
        columns: Vectors, one after another, shape (>= count p,).
        count: How many of each.
        p: Length of a vector.
        work: Working memory, shape (>= 6 (count + 1),); its first `count` numbers become each row's column.

    Returns:
        Whether there is an assignment: not where a number is none.
    """
    size = count + 1  # place 0 stands for "no column yet"
    u, v, path = work[:size], work[size : 2 * size], work[2 * size : 3 * size]
    least, seen, owner = work[3 * size : 4 * size], work[4 * size : 5 * size], work[5 * size : 6 * size]
    for j in range(size):
        u[j] = v[j] = owner[j] = 0.0
    for i in range(1, size):
        owner[0] = i
        for j in range(size):
            least[j] = math.inf
            seen[j] = 0.0
        j = 0
        while owner[j] != 0.0:
            seen[j] = 1.0
            row = int(owner[j])
            step, nearest = math.inf, 0
            for k in range(1, size):
                if seen[k] != 0.0:
                    continue
                cost = -u[row] - v[k]
                for a in range(p):
                    cost -= rows[(row - 1) * p + a] * columns[(k - 1) * p + a]
                if cost < least[k]:
                    least[k] = cost
                    path[k] = j
                if least[k] < step:
                    step = least[k]
                    nearest = k
            if nearest == 0:
                return False
            for k in range(size):
                if seen[k] != 0.0:
                    u[int(owner[k])] += step
                    v[k] -= step
                else:
                    least[k] -= step
            j = nearest
        while j != 0:
            before = int(path[j])
            owner[j] = owner[before]
            j = before
    for j in range(1, size):
        work[int(owner[j]) - 1] = j - 1
    return True
