"""Walls and corridors as boxes: one for each stretch between corners and doors, and above and below doors."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.scenario.geometry.obstacle_body import Body
from escort_mj.scenario.geometry.shapes import quaternion
from escort_mj.scenario.schema.obstacle_tables import Wall
from escort_mj.scenario.schema.scenario import Scenario

Array = NDArray[np.float64]

LEAST = 1e-3  # what is shorter than that is left out [m]


class Stretch(NamedTuple):
    """A straight part of a wall.

    Attributes:
        start: Where it begins along the wall's points [m].
        length: How long it is there [m].
        foot: Its first point, shape (2,) [m].
        along: Unit vector of its direction, shape (2,).
        before: How far it begins before its first point, to fill the corner [m].
        behind: How far it ends behind its last [m].
    """

    start: float
    length: float
    foot: Array
    along: Array
    before: float
    behind: float


def wall_name(wall: Wall, index: int) -> str:
    """Name of a wall, given or numbered."""
    return wall.name or f"wall_{index + 1}"


def wall_boxes(scenario: Scenario) -> Iterator[Body]:
    """The boxes of all walls of a scenario."""
    for index, wall in enumerate(scenario.walls):
        boxes = [box for side in sides_of(wall) for stretch in side for box in _boxes(wall, stretch)]
        for number, (middle, half, bottom, top, along) in enumerate(boxes, 1):
            name = wall_name(wall, index) + (f"_{number}" if len(boxes) > 1 else "")
            size = (half, 0.5 * wall.thickness, 0.5 * (top - bottom))
            height = 0.5 * (bottom + top)
            foot = wall.points[0][2] if scenario.axes == 3 else -scenario.robots.height
            position = middle if scenario.axes == 2 else np.array([*middle, foot + height])
            yield Body(
                name=name,
                group="walls",
                shape="box",
                size=size,
                position=position,
                bounding_radius=float(np.linalg.norm(size)),
                path=("walls", index),
                orientation=quaternion(float(np.arctan2(along[1], along[0]))),
                lift=foot + height if scenario.axes == 2 else 0.0,
                color=wall.color,
            )


def sides_of(wall: Wall) -> list[list[Stretch]]:
    """The stretches of a wall, or of the two of a corridor: to the left of its points first."""
    if wall.corridor is None:
        return [offset_stretches(wall, 0.0)]
    aside = 0.5 * (wall.corridor + wall.thickness)
    return [offset_stretches(wall, aside), offset_stretches(wall, -aside)]


def offset_stretches(wall: Wall, aside: float) -> list[Stretch]:
    """The straight parts of a line at a distance to the left of a wall's points."""
    points = np.array(wall.points, dtype=float)[:, :2]
    legs = np.diff(points, axis=0)
    lengths = np.linalg.norm(legs, axis=1)
    along = legs / lengths[:, np.newaxis]
    left = np.column_stack([-along[:, 1], along[:, 0]])
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    found = []
    for k, length in enumerate(lengths):
        ends = []
        for other in (k - 1, k + 1):  # the corner before, and the one behind
            if not 0 <= other < len(lengths):
                ends.append(0.0)
                continue
            turn = along[min(k, other)], along[max(k, other)]
            sine, cosine = turn[0][0] * turn[1][1] - turn[0][1] * turn[1][0], float(turn[0] @ turn[1])
            half_tangent = sine / (1.0 + cosine)
            ends.append(0.5 * wall.thickness * abs(half_tangent) - aside * half_tangent)
        found.append(Stretch(float(starts[k]), float(length), points[k] + aside * left[k], along[k], *ends))
    return found


def _boxes(wall: Wall, stretch: Stretch) -> Iterator[tuple[Array, float, float, float, Array]]:
    """Middle, half length, bottom, top and direction of the boxes of a stretch."""
    doors = sorted(
        (door for door in wall.doors if stretch.start <= door.at < stretch.start + stretch.length),
        key=lambda door: door.at,
    )
    edges = [-stretch.before]
    for door in doors:
        low = door.at - stretch.start - 0.5 * door.width
        edges += [low, low + door.width]
    edges.append(stretch.length + stretch.behind)
    spans = [(low, high, 0.0, wall.height) for low, high in zip(edges[::2], edges[1::2], strict=True)]
    for number, door in enumerate(doors):
        low, high = edges[1 + 2 * number], edges[2 + 2 * number]
        top = wall.height if door.height is None else door.sill + door.height
        spans += [(low, high, 0.0, door.sill), (low, high, top, wall.height)]
    for low, high, bottom, top in spans:
        if high - low > LEAST and top - bottom > LEAST:
            middle = stretch.foot + 0.5 * (low + high) * stretch.along
            yield middle, 0.5 * (high - low), bottom, top, stretch.along
