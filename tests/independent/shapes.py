"""Signed distances from points to solid shapes, in plain NumPy: negative inside, exact to rounding.

Every function takes points in the shape's own frame, shape (k, 3) or (k, p) [m], and returns shape (k,) [m].
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

Array = NDArray[np.float64]


def ball(points: Array, radius: float) -> Array:
    """Return the distance to a ball of any number of axes."""
    return np.linalg.norm(points, axis=1) - radius


def box(points: Array, half: Array) -> Array:
    """Return the distance to a box of half-sizes `half`."""
    beyond = np.abs(points) - half
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)


def cylinder(points: Array, radius: float, half: float) -> Array:
    """Return the distance to a cylinder about z, of half-length `half`."""
    across = np.linalg.norm(points[:, :2], axis=1)
    return box(np.column_stack([across, points[:, 2]]), np.array([radius, half]))


def capsule(points: Array, radius: float, half: float) -> Array:
    """Return the distance to a capsule about z, whose segment reaches `half` to either side."""
    nearest = np.zeros_like(points)
    nearest[:, 2] = np.clip(points[:, 2], -half, half)
    return ball(points - nearest, radius)


def ellipsoid(points: Array, axes: Array) -> Array:
    """Return the distance to an ellipsoid of half-axes `axes`.

    The nearest point is e_i^2 y_i / (t + e_i^2), with t the largest root of
    sum (e_i y_i / (t + e_i^2))^2 = 1; without such a root it lies above the middle plane of the least axis.
    """
    least = axes.min()
    tied = axes - least < 1e-12
    e = np.append(axes[~tied], least)
    y = np.column_stack([np.abs(points[:, ~tied]), np.linalg.norm(points[:, tied], axis=1)])
    low = -(least**2) + least * y[:, -1]
    high = -(least**2) + np.linalg.norm(e * y, axis=1) + 1e-300
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(80):
            middle = 0.5 * (low + high)
            terms = np.where(y > 0.0, e * y / (middle[:, None] + e**2), 0.0)
            outward = (terms**2).sum(axis=1) > 1.0
            low, high = np.where(outward, middle, low), np.where(outward, high, middle)
        t = 0.5 * (low + high)[:, None]
        others = e[:-1] ** 2 * y[:, :-1] / (t + e[:-1] ** 2)
        direct = e[-1] ** 2 * y[:, -1] / (t[:, 0] + e[-1] ** 2)
    rest = least * np.sqrt(np.maximum(1.0 - ((others / e[:-1]) ** 2).sum(axis=1), 0.0))
    last = np.where(t[:, 0] + least**2 > 1e-6 * least**2, direct, rest)
    nearest = np.column_stack([others, last])
    inside = ((y / e) ** 2).sum(axis=1) < 1.0
    distance = np.linalg.norm(y - nearest, axis=1)
    return np.where(inside, -distance, distance)


def hull(points: Array, vertices: Array) -> Array:
    """Return the distance to the convex hull of `vertices`, shape (v, 3)."""
    solid = ConvexHull(vertices)
    heights = points @ solid.equations[:, :3].T + solid.equations[:, 3]
    inside = heights.max(axis=1)
    outside = np.min([_triangle(points, *vertices[corners]) for corners in solid.simplices], axis=0)
    return np.where(inside <= 0.0, inside, outside)


def in_section_of_hull(points: Array, vertices: Array) -> Array:
    """Return minus the way out of a convex hull along x and y, from points inside it."""
    faces = ConvexHull(vertices).equations
    along = np.linalg.norm(faces[:, :2], axis=1)
    sides = along > 1e-9
    heights = points @ faces[sides, :3].T + faces[sides, 3]
    return (heights / along[sides]).max(axis=1)


def least_width(vertices: Array) -> float:
    """Return the least distance of two parallel planes that hold a convex hull between them [m]."""
    solid = ConvexHull(vertices)
    edges = {tuple(sorted(pair)) for corners in solid.simplices for pair in combinations(corners, 2)}
    along = np.array([vertices[a] - vertices[b] for a, b in edges])
    across = np.cross(along[:, None], along[None]).reshape(-1, 3)
    sizes = np.linalg.norm(across, axis=1)
    normals = np.vstack([solid.equations[:, :3], across[sizes > 1e-9] / sizes[sizes > 1e-9, None]])
    return float(np.ptp(vertices @ normals.T, axis=0).min())


def _triangle(points: Array, a: Array, b: Array, c: Array) -> Array:
    """Return the distance to a triangle."""
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    height = (points - a) @ normal
    foot = points - height[:, None] * normal
    above = np.all([(foot - p) @ np.cross(normal, q - p) >= 0.0 for p, q in ((a, b), (b, c), (c, a))], axis=0)
    edges = np.min([_segment(points, p, q) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    return np.where(above, np.abs(height), edges)


def _segment(points: Array, a: Array, b: Array) -> Array:
    """Return the distance to a segment."""
    along = b - a
    share = np.clip((points - a) @ along / (along @ along), 0.0, 1.0)
    return np.linalg.norm(points - a - share[:, None] * along, axis=1)
