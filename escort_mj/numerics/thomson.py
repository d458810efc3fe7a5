"""Even points on a sphere in any dimension: the Thomson problem, solved once and kept (paper remark 1).

The tests ask for the best known energies of 4, 5, 6, 8, 12, 20 and 32 points in space.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.native import cache
from escort_mj.numerics.assignment import best_assignment

Array = NDArray[np.float64]

STARTS = 24  # random starts of the optimiser
LARGE = 64  # from so many points on, few starts: the energies of the minima lie close together
CROWD = 200  # from so many points on, from a lattice, and no further than where steps gain nothing to see
CROWD_STEPS = 60  # energy of 1000 points within 2e-5 of a minimum, least spacing within 2 %
ROWS = 32  # of the points' distances at once
SETTLED, SETTLED_RELATIVE = 1e-12, 1e-5  # change of a rotation's entries that is none
ROTATIONS = 200  # starts of the search for the best assignment; fewer for a large team, which fits any turn
PLANAR = 60  # the most in the plane, where a rotation is one angle: more of them find nothing better


class Figure(NamedTuple):
    """An even figure, and the place of each robot in it.

    Attributes:
        vertices: Unit vector of each robot's place, turned to where the robots start, shape (n, p).
        edges: Nearest neighbors, lower robot first, shape (edges, 2).
        lengths: Distance of each edge on the unit sphere, shape (edges,).
    """

    vertices: Array
    edges: NDArray[np.int64]
    lengths: Array


def coulomb_energy(points: Array) -> float:
    """Coulomb energy sum 1 / |x_i - x_j| of unit vectors, shape (n, p)."""
    i, j = np.triu_indices(len(points), 1)
    return float((1.0 / np.linalg.norm(points[i] - points[j], axis=1)).sum())


def least_energy(count: int, axes: int) -> float:
    """Least known Coulomb energy of so many points on the unit sphere; the polygon's where axes is 2."""
    return coulomb_energy(even_points(count, axes))


@lru_cache(maxsize=64)
def even_points(count: int, axes: int) -> Array:
    """Points of least energy on the unit sphere, shape (count, axes): a regular polygon where axes is 2.

    Found by many starts of an optimiser, and kept in the user's cache.
    """
    if count == 1:
        return np.eye(1, axes)
    if axes == 2:
        angle = 2.0 * math.pi * np.arange(count) / count
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)
    name, size = f"{axes}-{count}.f64", 8 * count * axes
    kept = cache.formations.read(name)
    if kept is not None and len(kept) == size:
        return np.frombuffer(kept, dtype="<f8").reshape(count, axes).astype(float)
    points = _solve(count, axes)
    cache.formations.write(name, points.astype("<f8").tobytes())
    return points


def _solve(count: int, axes: int) -> Array:
    """Least energy over the starts of L-BFGS on unnormalised points; few steps for a crowd."""
    from scipy.optimize import minimize

    def loss(flat: Array) -> tuple[float, Array]:
        raw = flat.reshape(count, axes)
        length = np.linalg.norm(raw, axis=1, keepdims=True)
        x = raw / length
        total, push = _energy_and_push(x)
        slope = (push - (push * x).sum(axis=1, keepdims=True) * x) / length
        return total, slope.ravel()

    steps = 5000 if count < CROWD else CROWD_STEPS
    best: tuple[float, Array] | None = None
    for start in _starts(count, axes):
        found = minimize(
            loss, start.ravel(), jac=True, method="L-BFGS-B",
            options={"maxiter": steps, "maxfun": 20000, "ftol": 1e-15, "gtol": 1e-9},
        )  # fmt: skip
        if best is None or found.fun < best[0] - 1e-9:
            points = found.x.reshape(count, axes)
            best = (float(found.fun), points / np.linalg.norm(points, axis=1, keepdims=True))
    assert best is not None
    return best[1]


def _starts(count: int, axes: int) -> list[Array]:
    """Where the optimiser starts, each (count, axes): the lattice for a crowd in space, else at random."""
    if count >= CROWD and axes == 3:
        return [lattice(count)]
    starts = STARTS if count < LARGE else 3 if count < CROWD else 1
    return [2.0 * np.random.Generator(np.random.Philox(k)).random((count, axes)) - 1.0 for k in range(starts)]


def lattice(count: int) -> Array:
    """Fibonacci's lattice on the unit sphere, shape (count, 3): nearly even."""
    turn = np.arange(count) + 0.5
    height = 1.0 - 2.0 * turn / count
    level = np.sqrt(1.0 - height**2)
    angle = math.pi * (1.0 + math.sqrt(5.0)) * turn
    return np.stack([level * np.cos(angle), level * np.sin(angle), height], axis=1)


def _energy_and_push(x: Array) -> tuple[float, Array]:
    """Coulomb energy of unit vectors, shape (n, p), and its slope with respect to them, shape (n, p).

    Some rows at a time, so that the distances of 2000 points stay in the processor's cache.
    """
    total, push = 0.0, np.empty_like(x)
    for first in range(0, len(x), ROWS):
        rows = x[first : first + ROWS]
        square = 2.0 - 2.0 * (rows @ x.T)
        square[np.arange(len(rows)), np.arange(first, first + len(rows))] = np.inf
        inverse = 1.0 / np.sqrt(square)
        total += 0.5 * float(inverse.sum())
        weight = inverse / square
        push[first : first + ROWS] = weight @ x - weight.sum(axis=1, keepdims=True) * rows
    return total, push


def even_figure(positions: Array, center: Array) -> Figure:
    """The even figure for a team, turned and assigned so that the robots have the least way to go.

    Args:
        positions: Initial positions, shape (n, p) [m].
        center: Initial position of the target, shape (p,) [m].
    """
    return _figure((positions - center).tobytes(), positions.shape[1])


@lru_cache(maxsize=64)
def _figure(offsets: bytes, axes: int) -> Figure:
    """Of the robots' places seen from the target: runs of a study have the same, and placing takes 40 ms."""
    offset = np.frombuffer(offsets).reshape(-1, axes)
    directions = offset / np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-12)
    vertices = _nearest_placing(even_points(len(offset), axes), directions)
    vertices.flags.writeable = False
    return Figure(vertices, *nearest_edges(vertices))


def nearest_edges(points: Array) -> tuple[NDArray[np.int64], Array]:
    """Edges of an even figure: pairs that are about as near as either end's nearest point.

    Args:
        points: Shape (n, p).

    Returns:
        Pairs, the lower first, shape (edges, 2), and their distances, shape (edges,).
    """
    i, j = np.triu_indices(len(points), 1)
    distance = np.linalg.norm(points[i] - points[j], axis=1)
    nearest = np.full(len(points), np.inf)
    np.minimum.at(nearest, i, distance)
    np.minimum.at(nearest, j, distance)
    edge = (
        distance <= 1.2 * np.maximum(nearest[i], nearest[j]) if len(points) > 1 else np.zeros(0, dtype=bool)
    )
    return np.stack([i[edge], j[edge]], axis=1).astype(np.int64), distance[edge]


def _nearest_placing(points: Array, directions: Array) -> Array:
    """Rotates points and gives one to each direction: assignment and rotation in turn, many times."""
    count, axes = points.shape
    share = min(1.0, (LARGE / count) ** 3)  # an assignment takes a time cubic in the number of points
    best: tuple[float, Array] | None = None
    fits: dict[bytes, tuple[Array, Array]] = {}
    starts = min(max(1, round(ROTATIONS * share)), PLANAR if axes == 2 else ROTATIONS)
    for rotation in _turns(axes, starts):
        for _ in range(max(2, round(30 * share))):
            turned = points @ rotation.T
            order = best_assignment(directions @ turned.T)
            if (key := order.tobytes()) not in fits:  # many rotations lead to the same assignment
                fits[key] = points[order], _rotation(directions.T @ points[order])
            placed, fitted = fits[key]
            if (np.abs(fitted - rotation) <= SETTLED + SETTLED_RELATIVE * np.abs(rotation)).all():
                break
            rotation = fitted
        alignment = float((directions * (placed @ rotation.T)).sum())
        if best is None or alignment > best[0] + 1e-9:
            best = (alignment, placed @ rotation.T)
    assert best is not None
    return best[1]


@lru_cache(maxsize=16)
def _turns(axes: int, count: int) -> list[Array]:
    """Return the rotations from which the search begins: none, and random ones, the same for every team."""
    random = np.random.Generator(np.random.Philox(0))
    return [np.eye(axes), *(_rotation(random.standard_normal((axes, axes))) for _ in range(count - 1))]


def _rotation(matrix: Array) -> Array:
    """The proper rotation nearest to a matrix (Kabsch)."""
    u, _, vt = np.linalg.svd(matrix)
    u[:, -1] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))
    return np.asarray(u @ vt)
