"""Directions to choose from, spread evenly: on the circle, or on the sphere by Fibonacci's spiral."""

from __future__ import annotations

import math

from escort_mj.native.kernels import inlined
from escort_mj.native.vectors import Vec, dot, of_numbers
from escort_mj.policies.body import Body

IN_PLANE, IN_SPACE = 360, 1000
"""Directions that policies choose from: one degree apart, and about four."""
_TURN = math.pi * (3.0 - math.sqrt(5.0))  # the golden angle [rad]
NEAR = 1e-9  # m; ways that are shorter have no direction


@inlined
def count_of(r: Body) -> int:
    """Return the number of directions."""
    return IN_PLANE if len(r.q) == 2 else IN_SPACE


@inlined
def direction(k: int, r: Body) -> Vec:
    """Return direction k, of unit length, in two axes or three."""
    if len(r.q) == 2:
        angle = 2.0 * math.pi * k / IN_PLANE
        return of_numbers(r.q, math.cos(angle), math.sin(angle), 0.0)
    height, angle = 1.0 - (2.0 * k + 1.0) / IN_SPACE, _TURN * k
    across = math.sqrt(1.0 - height * height)
    return of_numbers(r.q, across * math.cos(angle), across * math.sin(angle), height)


@inlined
def freest(r: Body, power: int) -> Vec:
    """Return the direction u with the least max_i u . d_i / |d_i|^power, d_i the way to robot i.

    With the power 1 it is the middle of the largest gap between robots as seen from the body. With 2, half
    the reciprocal of the largest is how far u stays within the points that are nearer to the body than to any
    robot: the longest way within the Voronoi cell.

    Args:
        r: The body.
        power: 1 or 2.
    """
    found, least = direction(0, r), math.inf
    for k in range(count_of(r)):
        tried, most = direction(k, r), -math.inf
        for i in range(r.robots):
            way = r.robot(i) - r.q
            square = dot(way, way)
            if square > 0.0:
                most = max(most, dot(tried, way) / (square if power == 2 else math.sqrt(square)))
        if most < least:
            found, least = tried, most
    return found
