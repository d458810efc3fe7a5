"""Points, primitive shapes and the distances between them, exactly, in plain NumPy.

Everything happens in three dimensions: a planar mission is the plane z = 0 at the height of its robots'
centers. The simulation measures with MuJoCo's own geometry; tests hold the two side by side.
"""

from __future__ import annotations

from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BISECTIONS = 200
OUTLINE_POINTS = {2: (121,), 3: (17, 33)}
"""Points of an outline: around it; in space rings, and points of each."""


class Solid(NamedTuple):
    """A shape where it is.

    Attributes:
        shape: One of `obstacle_tables.Shape`.
        size: Its half-sizes as MuJoCo has them [m]; none for a mesh.
        center: Shape (3,) [m].
        rotation: From its own axes to the world's, shape (3, 3).
        vertices: Corners of a mesh in its own axes, shape (k, 3) [m]; (0, 3) for the others.
    """

    shape: str
    size: tuple[float, ...]
    center: Array
    rotation: Array
    vertices: Array


def quaternion(orientation: float | tuple[float, ...]) -> tuple[float, float, float, float]:
    """The unit quaternion (w, x, y, z) of an orientation as scenarios give it [rad]."""
    if isinstance(orientation, tuple) and len(orientation) == 4:
        w, x, y, z = np.array(orientation) / np.linalg.norm(orientation)
        return float(w), float(x), float(y), float(z)
    angles = orientation if isinstance(orientation, tuple) else (0.0, 0.0, orientation)
    (cr, cp, cy), (sr, sp, sy) = np.cos(0.5 * np.array(angles)), np.sin(0.5 * np.array(angles))
    return (
        float(cr * cp * cy + sr * sp * sy),
        float(sr * cp * cy - cr * sp * sy),
        float(cr * sp * cy + sr * cp * sy),
        float(cr * cp * sy - sr * sp * cy),
    )


def rotation_matrix(q: tuple[float, ...]) -> Array:
    """Rotation matrix of a unit quaternion (w, x, y, z), shape (3, 3)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def in_space(points: Array) -> Array:
    """Points of a mission of two or three axes, shape (k, p), as points in space, shape (k, 3) [m]."""
    points = np.asarray(points, dtype=float)
    found = np.zeros((len(points), 3))
    found[:, : points.shape[1]] = points
    return found


def nearest_on_shape(solid: Solid, points: Array) -> tuple[Array, Array]:
    """The points of a solid's surface that are nearest to points, and how far those are outside.

    Args:
        solid: A shape where it is.
        points: Shape (k, 3) [m].

    Returns:
        Nearest points, shape (k, 3) [m], and signed distances, negative inside, shape (k,) [m].
    """
    local = (points - solid.center) @ solid.rotation
    surface, inside = {
        "sphere": _on_sphere,
        "box": _on_box,
        "cylinder": _on_cylinder,
        "capsule": _on_capsule,
        "ellipsoid": _on_ellipsoid,
        "mesh": _on_hull,
    }[solid.shape](local, solid)
    distance = np.linalg.norm(local - surface, axis=1)
    return surface @ solid.rotation.T + solid.center, np.where(inside, -distance, distance)


def extent(solid: Solid) -> tuple[Array, Array]:
    """Lower and upper corner of the upright box around a solid, shape (3,) each [m]."""
    if solid.shape == "mesh":
        corners = solid.vertices @ solid.rotation.T + solid.center
        return corners.min(axis=0), corners.max(axis=0)
    half = half_extent(solid, np.eye(3))
    return solid.center - half, solid.center + half


def half_extent(solid: Solid, directions: Array) -> Array:
    """How far a solid that is no mesh reaches from its center along unit vectors, (k, 3) -> (k,) [m]."""
    turned, size = directions @ solid.rotation, np.array(solid.size)
    if solid.shape == "sphere":
        return np.full(len(directions), size[0])
    if solid.shape == "box":
        return np.asarray(np.abs(turned) @ size)
    if solid.shape == "ellipsoid":
        return np.asarray(np.sqrt((turned * turned) @ (size * size)))
    along = turned[:, 2]
    if solid.shape == "capsule":
        return np.asarray(size[0] + np.abs(along) * size[1])
    return np.asarray(size[0] * np.sqrt(np.maximum(1.0 - along * along, 0.0)) + np.abs(along) * size[1])


def outline(solid: Solid, axes: int) -> Array:
    """The points of a solid that lie farthest along `outward(axes)`, relative to its center, (k, p) [m].

    In the plane they run around what a planar mission meets of it, counterclockwise.
    """
    far = 1e4 * max(bounding_radius(solid.shape, solid.size, solid.vertices), 1e-3)
    center = solid.center * ([1.0, 1.0, 0.0] if axes == 2 else [1.0, 1.0, 1.0])
    points = nearest_on_shape(solid, center + far * in_space(outward(axes)))[0] - center
    return np.asarray(points[:, :axes])


@cache
def outward(axes: int) -> Array:
    """Unit vectors all around: a circle of them, shape (k, 2), or rings from pole to pole, shape (k, 3)."""
    turn = np.linspace(0.0, 2.0 * np.pi, OUTLINE_POINTS[axes][-1])
    if axes == 2:
        return np.column_stack([np.cos(turn), np.sin(turn)])
    polar, turn = np.meshgrid(np.linspace(0.0, np.pi, OUTLINE_POINTS[axes][0]), turn, indexing="ij")
    rings = [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)]
    return np.stack(rings, axis=-1).reshape(-1, 3)


def bounding_radius(shape: str, size: tuple[float, ...], vertices: Array) -> float:
    """Radius of the smallest sphere about a shape's center that holds all of it [m]."""
    if shape == "mesh":
        return float(np.linalg.norm(vertices, axis=1).max())
    if shape == "box":
        return float(np.linalg.norm(size))
    if shape == "cylinder":
        return float(np.hypot(size[0], size[1]))
    return float(sum(size)) if shape == "capsule" else float(max(size))


def _directed(x: Array, fallback: int = 0) -> Array:
    """Unit vectors along the rows of x; along an axis where a row is zero."""
    length = np.linalg.norm(x, axis=1, keepdims=True)
    axis = np.eye(x.shape[1])[fallback]
    return np.asarray(np.where(length > 0.0, x / np.where(length > 0.0, length, 1.0), axis))


def _on_sphere(x: Array, solid: Solid) -> tuple[Array, Mask]:
    return solid.size[0] * _directed(x), np.asarray(np.linalg.norm(x, axis=1) < solid.size[0])


def _on_box(x: Array, solid: Solid) -> tuple[Array, Mask]:
    size = np.array(solid.size)
    surface = np.clip(x, -size, size)
    inside = np.asarray((np.abs(x) < size).all(axis=1))
    face = np.argmax(np.abs(x) - size, axis=1)
    rows = np.flatnonzero(inside)
    surface[rows, face[rows]] = np.copysign(size[face[rows]], x[rows, face[rows]])
    return surface, inside


def _on_capsule(x: Array, solid: Solid) -> tuple[Array, Mask]:
    radius, half = solid.size
    core = np.zeros_like(x)
    core[:, 2] = np.clip(x[:, 2], -half, half)
    return core + radius * _directed(x - core), np.asarray(np.linalg.norm(x - core, axis=1) < radius)


def _on_cylinder(x: Array, solid: Solid) -> tuple[Array, Mask]:
    radius, half = solid.size
    across = np.linalg.norm(x[:, :2], axis=1)
    out = _directed(x[:, :2])
    flat = np.column_stack([np.minimum(across, radius), np.clip(x[:, 2], -half, half)])
    inside = np.asarray((across < radius) & (np.abs(x[:, 2]) < half))
    to_side = inside & (radius - across <= half - np.abs(x[:, 2]))
    flat[to_side, 0] = radius
    to_lid = inside & ~to_side
    flat[to_lid, 1] = np.copysign(half, x[to_lid, 2])
    return np.column_stack([flat[:, :1] * out, flat[:, 1]]), inside


def _on_ellipsoid(x: Array, solid: Solid) -> tuple[Array, Mask]:
    """Eberly's method: the nearest point is a_k^2 x_k / (s + a_k^2 - a_min^2), s the root of its equation."""
    square = np.array(solid.size) ** 2
    inside = np.asarray((x * x / square).sum(axis=1) < 1.0)
    y = np.where(x == 0.0, 1e-12 * np.sqrt(square), np.abs(x))  # on a plane of symmetry: a step off it
    more, scaled = square - square.min(), np.sqrt(square) * y
    low = np.max(scaled - more, axis=1)  # one term alone is 1 there
    high = np.linalg.norm(scaled, axis=1)  # all terms are at most 1 in all
    for _ in range(BISECTIONS):
        s = 0.5 * (low + high)
        if ((s == low) | (s == high)).all():  # no number is between them
            break
        beyond = ((scaled / (s[:, None] + more)) ** 2).sum(axis=1) > 1.0
        low, high = np.where(beyond, s, low), np.where(beyond, high, s)
    surface = square * y / (0.5 * (low + high)[:, None] + more)
    return np.copysign(surface, x), inside


def _on_hull(x: Array, solid: Solid) -> tuple[Array, Mask]:
    triangles, planes = hull(tuple(map(tuple, solid.vertices)))
    candidates = np.stack([_on_triangle(x, *triangle) for triangle in triangles])
    nearest_one = np.argmin(np.linalg.norm(candidates - x, axis=2), axis=0)
    inside = (x @ planes[:, :3].T + planes[:, 3] < 0.0).all(axis=1)
    return candidates[nearest_one, np.arange(len(x))], np.asarray(inside)


@lru_cache(maxsize=64)
def hull(vertices: tuple[tuple[float, ...], ...]) -> tuple[Array, Array]:
    """Triangles of the convex hull of points, shape (k, 3, 3), and its planes (normal, offset), (k, 4).

    Raises:
        ValueError: If the points do not span a body.
    """
    from scipy.spatial import ConvexHull, QhullError  # slow to import, and few scenarios need it

    points = np.array(vertices)
    try:
        found = ConvexHull(points)
    except QhullError:
        raise ValueError("the points do not span a body") from None
    return points[found.simplices], np.asarray(found.equations)


def _on_triangle(x: Array, a: Array, b: Array, c: Array) -> Array:
    """The points of a triangle nearest to points (Ericson, Real-Time Collision Detection, 5.1.5)."""
    edges = [(a, b), (b, c), (c, a)]
    on_edges = []
    for start, end in edges:
        along = end - start
        share = np.clip((x - start) @ along / (along @ along), 0.0, 1.0)
        on_edges.append(start + share[:, None] * along)
    nearest_edge = np.argmin([np.linalg.norm(x - point, axis=1) for point in on_edges], axis=0)
    best = np.array(on_edges)[nearest_edge, np.arange(len(x))]
    normal = np.cross(b - a, c - a)
    normal = normal / np.linalg.norm(normal)
    flat = x - ((x - a) @ normal)[:, None] * normal
    within = np.all([np.cross(end - start, flat - start) @ normal >= 0.0 for start, end in edges], axis=0)
    return np.asarray(np.where(within[:, None], flat, best))
