"""What is seen of a line or plane in a picture: its part in a box, and the part of the box behind it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def cut(point: Array, normal: Array, low: Array, high: Array) -> Array:
    """Return the ends or corners of a line's or plane's part in a box, in their order, shape (k, p) [m].

    Args:
        point: On it, shape (p,) [m].
        normal: Of it, shape (p,).
        low: Lower corner of the box, shape (p,) [m].
        high: Its upper corner.
    """
    return _around(_crossings(_corners(low, high), point, normal))


def behind(point: Array, normal: Array, low: Array, high: Array) -> Array:
    """Return the corners of the part of a rectangle that is behind a line, in their order, shape (k, 2) [m].

    Args are those of `cut`; the normal points to the front.
    """
    corners = _corners(low, high)
    inside = corners[(corners - point) @ normal < 0.0]
    return _around(np.concatenate([inside, _crossings(corners, point, normal)]))


def hatched(rim: Array, step: float) -> Iterator[Array]:
    """Yield lines across a convex polygon in two directions, shape (2, p) each [m].

    Args:
        rim: Its corners in their order, shape (k, p) [m].
        step: Between two parallel lines [m].
    """
    off, following = rim - rim.mean(axis=0), np.roll(rim, -1, axis=0)
    for direction in np.linalg.svd(off)[2][:2]:
        place = off @ direction
        ahead = np.roll(place, -1)
        for at in step * np.arange(np.ceil(place.min() / step), place.max() / step):
            edges = (place - at) * (ahead - at) < 0.0
            share = ((at - place[edges]) / (ahead[edges] - place[edges]))[:, None]
            if edges.sum() == 2:
                yield rim[edges] + share * (following[edges] - rim[edges])


def _corners(low: Array, high: Array) -> Array:
    return np.array([*product(*zip(low, high, strict=True))])


def _crossings(corners: Array, point: Array, normal: Array) -> Array:
    """Where the edges of a box cross a line or plane, shape (k, p)."""
    side = (corners - point) @ normal
    edges, back = (corners[:, None] != corners).sum(axis=2) == 1, side < 0.0
    first, second = np.nonzero(np.triu(edges & (back[:, None] != back)))
    share = (side[first] / (side[first] - side[second]))[:, None]
    return np.asarray(corners[first] + share * (corners[second] - corners[first]))


def _around(points: Array) -> Array:
    """The corners of a convex polygon one after the other."""
    if len(points) < 3:
        return points
    off = points - points.mean(axis=0)
    across, up = np.linalg.svd(off)[2][:2]
    return points[np.argsort(np.arctan2(off @ up, off @ across))]
