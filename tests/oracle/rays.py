"""How far rays are inside shapes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.rays import BOX, CYLINDER, ELLIPSOID, MESH
from escort_mj.components.setup import Shape
from escort_mj.control.setup import Setup

Array = NDArray[np.float64]


def stretches_inside(origin: Array, ways: Array, setup: Setup) -> tuple[Array, Array]:
    """Return the stretches of lines through a point that are inside each obstacle, shape (k, m) each.

    Args:
        origin: The point, shape (p,) [m].
        ways: Vectors of the lines, shape (k, p) [m].
        setup: Gives the obstacles.
    """
    m = len(setup.obstacle_radius)
    first, last = np.empty((len(ways), m)), np.empty((len(ways), m))
    for j, radius in enumerate(setup.obstacle_radius):
        x = origin - setup.obstacle_position[j]
        if radius > 0.0:
            first[:, j], last[:, j] = _in_ball(x, ways, radius)
            continue
        shape, pad = setup.shapes[j], (0, 3 - len(x))
        x = (np.pad(x, pad) - [0.0, 0.0, shape.lift]) @ shape.turn
        first[:, j], last[:, j] = _in_shape(shape, x, np.pad(ways, ((0, 0), pad)) @ shape.turn)
    return first, last


def _in_shape(shape: Shape, x: Array, rays: Array) -> tuple[Array, Array]:
    """The same for one shape that is no sphere, in its own axes."""
    walls = np.concatenate([np.eye(3), -np.eye(3)])
    if shape.kind == BOX:
        return _under(np.column_stack([walls, -np.tile(shape.size, 2)]), x, rays)
    if shape.kind == MESH:
        return _under(shape.planes, x, rays)
    if shape.kind == ELLIPSOID:
        return _in_ball(x / shape.size, rays / shape.size, 1.0)
    radius, half = shape.size[:2]
    sides = _in_ball(x[:2], rays[:, :2], radius)
    lids = _under(np.column_stack([walls[[2, 5]], [-half, -half]]), x, rays)
    first, last = np.maximum(sides[0], lids[0]), np.minimum(sides[1], lids[1])
    if shape.kind == CYLINDER:
        return first, last
    parts = [(first, last), *(_in_ball(x + [0.0, 0.0, end], rays, radius) for end in (half, -half))]
    met = [one < other for one, other in parts]
    first = np.min([np.where(hit, one, np.inf) for hit, (one, _) in zip(met, parts, strict=True)], axis=0)
    last = np.max([np.where(hit, other, -np.inf) for hit, (_, other) in zip(met, parts, strict=True)], axis=0)
    return first, last


def _in_ball(x: Array, rays: Array, radius: float) -> tuple[Array, Array]:
    """Stretches in a ball, or a disk, around the origin."""
    a, b, c = (rays * rays).sum(axis=1), rays @ x, x @ x - radius * radius
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b * b - a * c)
        first, last = (-b - root) / a, (-b + root) / a
    along, missed = a == 0.0, ~(b * b - a * c > 0.0)
    first = np.where(along, -np.inf if c < 0.0 else np.inf, np.where(missed, np.inf, first))
    return first, np.where(along, -first, np.where(missed, -np.inf, last))


def _under(planes: Array, x: Array, rays: Array) -> tuple[Array, Array]:
    """Stretches below planes (outward normal and offset), shape (k, 4)."""
    heights, rates = planes[:, :3] @ x + planes[:, 3], rays @ planes[:, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -heights / rates
    above = (rates == 0.0) & (heights >= 0.0)
    first = np.where(rates < 0.0, at, np.where(above, np.inf, -np.inf)).max(axis=1)
    last = np.where(rates > 0.0, at, np.where(above, -np.inf, np.inf)).min(axis=1)
    return first, last


def hidden(
    origin: Array, way: Array, setup: Setup, balls: tuple[Array, Array] | None = None, but: int = -1
) -> bool:
    """Return whether something is between a point and the one that a vector leads to.

    Args:
        origin: The point, shape (p,) [m].
        way: The vector, shape (p,) [m].
        setup: Gives the obstacles.
        balls: Centers, shape (k, p), and radii, shape (k,), of balls to look for in place of obstacles [m].
        but: An obstacle that hides nothing; -1 for none.
    """
    if balls is None:
        kept = np.arange(len(setup.obstacle_radius)) != but
        first, last = (each[0, kept] for each in stretches_inside(origin, way[None], setup))
    else:
        ends = [_in_ball(origin - place, way[None], size) for place, size in zip(*balls, strict=True)]
        first, last = np.reshape(ends, (-1, 2)).T
    return bool(((first < last) & (first < 1.0) & (last > 0.0)).any())
