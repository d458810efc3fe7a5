"""Where straight lines meet obstacles: closed forms, for sight, radio and lidars. All obstacles are convex.

A line is a point and a vector; places on it are multiples of that vector. What a line has in common with a
convex body is one stretch of it, from `first` to `last`; where it misses the body, first is not before last.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np

from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import DOUBLE, inlined, kernel, stack_memory, vector_at
from escort_mj.native.vectors import Vec, dot, numbers_at, set_numbers
from escort_mj.plan import Plan, State

KINDS = {"sphere": 2, "capsule": 3, "ellipsoid": 4, "cylinder": 5, "box": 6, "mesh": 7}
"""Shapes, numbered as in MuJoCo."""
CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH = 3, 4, 5, 6, 7
PARALLEL = 1e-200


class ShapeParameters(Fields):
    """Obstacles that are no spheres, in missions in which lines must meet them."""

    shape_kind: Annotated[Array, "formed", Value("1", "number in KINDS")]
    shape_size: Annotated[Array, "formed", 3, Value("m", "half-sizes and radii")]
    shape_turn: Annotated[Array, "formed", 9, Value("1", "from its own axes to the world's, row by row")]
    shape_lift: Annotated[Array, "formed", Value("m", "of its center above a planar mission's plane")]
    shape_reach: Annotated[Array, "formed", Value("m", "of a ball around its center that contains it")]
    shape_planes: Annotated[
        Array, "planes", 5, Value("1 or m", "of meshes: obstacle, outward normal, offset, in its own axes")
    ]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        shapes = setup.shapes
        planes = [np.insert(shape.planes, 0, number, axis=1) for number, shape in enumerate(shapes)]
        return {
            "shape_kind": [shape.kind for shape in shapes],
            "shape_size": np.reshape([shape.size for shape in shapes], (-1, 3)),
            "shape_turn": np.reshape([shape.turn for shape in shapes], (-1, 9)),
            "shape_lift": [shape.lift for shape in shapes],
            "shape_reach": [shape.reach for shape in shapes],
            "shape_planes": np.concatenate([np.zeros((0, 5)), *planes]),
        }


@inlined
def is_between(origin: Vec, way: Vec, but: int, plan: Plan, state: State) -> bool:
    """Whether some obstacle but one (-1: any) is between a point [m] and where a vector leads [m]."""
    for j in range(plan.obstacle_radius.shape[0]):
        first, last = stretch_in(j, origin, way, plan, state)
        if j != but and first < last and first < 1.0 and last > 0.0:
            return True
    return False


@inlined
def mate_between(i: int, origin: Vec, way: Vec, plan: Plan, state: State) -> bool:
    """Whether a teammate of robot i is between a point [m] and the one that a vector leads to [m]."""
    for j in range(state.q.shape[0]):
        first, last = _stretch_in_ball(origin - numbers_at(state, state.q, j), way, plan.robot_radius[j], 0.0)
        if j != i and first < last and first < 1.0 and last > 0.0:
            return True
    return False


@inlined
def stretch_in(j: int, origin: Vec, way: Vec, plan: Plan, state: State) -> tuple[float, float]:
    """Return the stretch of a line that is inside an obstacle.

    Args:
        j: The obstacle, from 0.
        origin: A point of the line [m].
        way: Its vector [m].
        plan: Gives the shapes.
        state: Gives where they are.
    """
    ball, lift = plan.obstacle_radius[j], 0.0
    is_ball = ball > 0.0
    if not is_ball:
        ball, lift = plan.shape_reach[j], plan.shape_lift[j]
    offset = origin - numbers_at(state, state.obstacle_position, j)
    first, last = _stretch_in_ball(offset, way, ball, lift)
    if not is_ball and first < last:
        first, last = _stretch_in_shape(j, offset, way, plan)
    return first, last


@inlined
def _stretch_in_ball(offset: Vec, way: Vec, ball: float, lift: float) -> tuple[float, float]:
    """The same for a ball of a radius, whose center is so far above the plane of a planar mission [m]."""
    return roots(dot(way, way), dot(way, offset), dot(offset, offset) + (lift * lift - ball * ball))


@inlined
def _stretch_in_shape(j: int, offset: Vec, way: Vec, plan: Plan) -> tuple[float, float]:
    """The same for an obstacle that is no sphere, from whose center the line's point is so far."""
    memory, turn = stack_memory(), plan.shape_turn[j]
    x, ray = vector_at(memory, 3), vector_at(memory + DOUBLE * 3, 3)
    at, along = vector_at(memory + DOUBLE * 6, 3), vector_at(memory + DOUBLE * 9, 3)
    at[2] = along[2] = 0.0
    set_numbers(at, 0, offset)
    set_numbers(along, 0, way)
    at[2] -= plan.shape_lift[j]
    for axis in range(3):
        x[axis] = turn[axis] * at[0] + turn[3 + axis] * at[1] + turn[6 + axis] * at[2]
        ray[axis] = turn[axis] * along[0] + turn[3 + axis] * along[1] + turn[6 + axis] * along[2]
    shape = int(plan.shape_kind[j])
    if shape != MESH:
        return stretch(shape, plan.shape_size[j], x, ray)
    first, last = -math.inf, math.inf
    for f in range(plan.shape_planes.shape[0]):
        plane = plan.shape_planes[f]
        if plane[0] == float(j):
            rate = plane[1] * ray[0] + plane[2] * ray[1] + plane[3] * ray[2]
            height = plane[1] * x[0] + plane[2] * x[1] + plane[3] * x[2] + plane[4]
            first, last = _below(height, rate, first, last)
    return first, last


@kernel
def stretch(shape: int, size: Array, x: Array, ray: Array) -> tuple[float, float]:
    """Return the stretch of a line that is inside a box, an ellipsoid, a cylinder or a capsule.

    Args:
        shape: Number in KINDS.
        size: Half-sizes and radii, shape (3,) [m].
        x: A point of the line in the shape's axes, shape (3,) [m].
        ray: Its vector, likewise.
    """
    first, last = -math.inf, math.inf
    if shape == BOX:
        for k in range(3):
            first, last = _within(size[k], x[k], ray[k], first, last)
        return first, last
    a, b, c = 0.0, 0.0, -1.0
    for k in range(3 if shape == ELLIPSOID else 2):
        scale = size[k] if shape == ELLIPSOID else size[0]
        a += (ray[k] / scale) ** 2
        b += ray[k] * x[k] / (scale * scale)
        c += (x[k] / scale) ** 2
    first, last = roots(a, b, c)
    if shape == ELLIPSOID:
        return first, last
    first, last = _within(size[1], x[2], ray[2], first, last)  # the side, between the lids
    if shape == CYLINDER:
        return first, last
    if not first < last:
        first, last = math.inf, -math.inf
    for side in range(2):  # a capsule's caps
        z = x[2] + size[1] * (1.0 if side == 0 else -1.0)
        a = ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]
        b = x[0] * ray[0] + x[1] * ray[1] + z * ray[2]
        c = x[0] * x[0] + x[1] * x[1] + z * z - size[0] * size[0]
        enters, leaves = roots(a, b, c)
        if enters < leaves:
            first, last = min(first, enters), max(last, leaves)
    return first, last


@inlined
def roots(a: float, b: float, c: float) -> tuple[float, float]:
    """Return between which s the form a s^2 + 2 b s + c is negative, for a >= 0."""
    rest = b * b - a * c
    if a > PARALLEL:
        if rest > 0.0:
            root = math.sqrt(rest)
            return (-root - b) / a, (root - b) / a
        return math.inf, -math.inf
    return (-math.inf, math.inf) if c < 0.0 else (math.inf, -math.inf)


@inlined
def _below(height: float, rate: float, first: float, last: float) -> tuple[float, float]:
    """Return what of a stretch is below a plane, given the height of the point and its rate on the line."""
    if rate > PARALLEL:
        return first, min(last, -height / rate)
    if rate < -PARALLEL:
        return max(first, -height / rate), last
    return (first, last) if height < 0.0 else (math.inf, -math.inf)


@inlined
def _within(half: float, x: float, ray: float, first: float, last: float) -> tuple[float, float]:
    """Return what of a stretch is between two parallel planes."""
    first, last = _below(x - half, ray, first, last)
    return _below(-x - half, -ray, first, last)
