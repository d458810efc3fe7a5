"""How deep a point lies inside a shape that is no sphere, and which way leads out of it: closed forms.

MuJoCo's distances are exact as long as a body's center is outside; inside they may be those to some other
face. In a planar mission nothing can leave its plane: there the way out leads along it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.rays import BOX, CAPSULE, CYLINDER, ELLIPSOID, MESH, stretch
from escort_mj.monitor.mass import INT
from escort_mj.native.kernels import DOUBLE, inlined, int_at, pointer_at, stack_memory, vector_at
from escort_mj.native.on_demand import on_demand
from escort_mj.plan import State
from escort_mj.robots.addresses import Addresses
from escort_mj.world.loop.layout import offset

Array = NDArray[np.float64]

MODEL_TYPE, MODEL_SIZE = offset("mjModel", "geom_type"), offset("mjModel", "geom_size")
DATA_PLACE, DATA_TURN = offset("mjData", "geom_xpos"), offset("mjData", "geom_xmat")
RAYS = 72  # in a plane: those among which the shortest way out is looked for, before it is refined
HALVINGS = 60
BISECTIONS = 120
TINY = 1e-12


@on_demand
def depth_inside(
    m: int, d: int, geom: int, obstacle: int, body: Array, state: State, addresses: Addresses, way: Array
) -> float:
    """How deep a point lies inside a box, cylinder, capsule, ellipsoid or convex mesh.

    Args:
        m: Address of MuJoCo's model.
        d: Address of its data, in which geoms are where they are now.
        geom: The shape's.
        obstacle: The same as an obstacle, from 0.
        body: The point, shape (3,) [m].
        state: Tells the number of axes.
        addresses: Has the faces of meshes.
        way: Result where it is inside: the unit vector that leads out along the axes, shape (p,).

    Returns:
        The distance to the nearest point of the surface, in a planar mission within its plane [m]; 0 where
        the point is not inside.
    """
    p = state.q.shape[1]
    place = vector_at(pointer_at(d + DATA_PLACE()) + 3 * DOUBLE * geom, 3)
    turn = vector_at(pointer_at(d + DATA_TURN()) + 9 * DOUBLE * geom, 9)
    size = vector_at(pointer_at(m + MODEL_SIZE()) + 3 * DOUBLE * geom, 3)
    shape = int_at(pointer_at(m + MODEL_TYPE()) + INT * geom)
    memory = stack_memory()
    x, out = vector_at(memory, 3), vector_at(memory + 3 * DOUBLE, 3)
    for axis in range(3):
        x[axis] = 0.0
        for k in range(3):
            x[axis] += turn[3 * k + axis] * (body[k] - place[k])
    if shape == BOX or shape == MESH:
        return _among_faces(shape == BOX, obstacle, x, size, turn, addresses.faces, p, way)
    if not _is_inside(shape, size, x):
        return 0.0
    if p == 2:
        return _in_plane(shape, size, x, turn, out, way)
    depth = _in_space(shape, size, x, out)
    for k in range(p):
        way[k] = 0.0
        for axis in range(3):
            way[k] += turn[3 * k + axis] * out[axis]
    return depth


@inlined
def _among_faces(
    box: bool, obstacle: int, x: Array, size: Array, turn: Array, faces: Array, p: int, way: Array
) -> float:
    """Depth below the nearest face of a box or of a mesh's hull; 0 outside."""
    best = math.inf
    for f in range(6 if box else faces.shape[0]):
        a, b, c, depth = 0.0, 0.0, 0.0, 0.0
        if box:
            axis, side = f // 2, 1.0 if f % 2 == 0 else -1.0
            a, b, c = side * (axis == 0), side * (axis == 1), side * (axis == 2)
            depth = size[axis] - side * x[axis]
        elif faces[f, 0] == float(obstacle):
            a, b, c = faces[f, 1], faces[f, 2], faces[f, 3]
            depth = -(a * x[0] + b * x[1] + c * x[2] + faces[f, 4])
        else:
            continue
        if depth <= 0.0:
            return 0.0
        square = 0.0
        for k in range(p):
            square += (turn[3 * k] * a + turn[3 * k + 1] * b + turn[3 * k + 2] * c) ** 2
        along = math.sqrt(square)  # in a plane, its share of the face's normal
        if along > TINY and depth < best * along:
            best = depth / along
            for k in range(p):
                way[k] = (turn[3 * k] * a + turn[3 * k + 1] * b + turn[3 * k + 2] * c) / along
    return best


@inlined
def _is_inside(shape: int, size: Array, x: Array) -> bool:
    """Whether a point in the shape's own axes is inside an ellipsoid, a cylinder or a capsule."""
    if shape == ELLIPSOID:
        return (x[0] / size[0]) ** 2 + (x[1] / size[1]) ** 2 + (x[2] / size[2]) ** 2 < 1.0
    across, beyond = math.hypot(x[0], x[1]), abs(x[2]) - size[1]
    if shape == CYLINDER:
        return across < size[0] and beyond < 0.0
    return math.hypot(across, max(beyond, 0.0)) < size[0]


@inlined
def _in_space(shape: int, size: Array, x: Array, out: Array) -> float:
    """Depth of a point inside an ellipsoid, a cylinder or a capsule, and the way out in the shape's axes."""
    if shape == ELLIPSOID:
        return _in_ellipsoid(size, x, out)
    core = min(max(x[2], -size[1]), size[1]) if shape == CAPSULE else x[2]
    across = math.hypot(math.hypot(x[0], x[1]), x[2] - core)
    depth = size[0] - across
    if shape == CYLINDER and size[1] - abs(x[2]) < depth:
        out[0], out[1], out[2] = 0.0, 0.0, math.copysign(1.0, x[2])
        return size[1] - abs(x[2])
    out[0], out[1], out[2] = 1.0, 0.0, 0.0  # from the axis all ways are alike
    if across > 0.0:
        out[0], out[1], out[2] = x[0] / across, x[1] / across, (x[2] - core) / across
    return depth


@inlined
def _in_ellipsoid(size: Array, x: Array, out: Array) -> float:
    """Eberly's method: the nearest point is a_k^2 x_k / (s + a_k^2 - a_min^2), s the root of its equation."""
    least = min(size[0], size[1], size[2])
    low, high = 0.0, 0.0
    for k in range(3):
        out[k] = max(abs(x[k]), TINY * size[k])  # on a plane of symmetry: a step off it
        high += (size[k] * out[k]) ** 2
        if size[k] == least:
            low = least * out[k]  # one term alone is 1 there
    high = math.sqrt(high)  # all terms are at most 1 in all
    for _ in range(BISECTIONS):
        s, total = 0.5 * (low + high), 0.0
        for k in range(3):
            total += (size[k] * out[k] / (s + (size[k] - least) * (size[k] + least))) ** 2
        if total > 1.0:
            low = s
        else:
            high = s
    square = 0.0
    for k in range(3):
        s = 0.5 * (low + high)
        share = size[k] * size[k] / (s + (size[k] - least) * (size[k] + least))
        out[k] = math.copysign(share * out[k] - abs(x[k]), x[k])
        square += out[k] * out[k]
    depth = math.sqrt(square)
    for k in range(3):
        out[k] = out[k] / depth if depth > 0.0 else 0.0
    return depth


@inlined
def _in_plane(shape: int, size: Array, x: Array, turn: Array, ray: Array, way: Array) -> float:
    """Depth within the plane of x and y: the shortest of all rays that lead out of the shape."""
    best, chosen, width = math.inf, 0.0, 2.0 * math.pi / RAYS
    for trial in range(RAYS + 2 * HALVINGS):
        angle = trial * width
        if trial >= RAYS:  # to both sides of the best one, ever nearer
            halving = (trial - RAYS) // 2
            angle = chosen + (1.0 if trial % 2 == 0 else -1.0) * width / 2.0 ** (halving // 2)
        cosine, sine = math.cos(angle), math.sin(angle)
        for axis in range(3):
            ray[axis] = turn[axis] * cosine + turn[3 + axis] * sine
        _, length = stretch(shape, size, x, ray)
        if length < best:
            best, chosen = length, angle
            way[0], way[1] = cosine, sine
    return best
