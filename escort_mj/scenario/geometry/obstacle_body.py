"""One obstacle or a part of a wall, with everything about it resolved."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.policies import Policy
from escort_mj.scenario.findings import Path
from escort_mj.scenario.geometry.shapes import Solid, extent, in_space, nearest_on_shape, rotation_matrix
from escort_mj.scenario.schema.obstacle_tables import Drive, Motion

Array = NDArray[np.float64]
Group = Literal["obstacles", "walls"]
NO_VERTICES = np.zeros((0, 3))


class Body(NamedTuple):
    """One obstacle or a part of a wall.

    Attributes:
        name: As given, or numbered.
        group: What verdicts and contacts count it among.
        shape: Of its one geom: one of `obstacle_tables.Shape`.
        size: Numbers of the shape, as MuJoCo has them: half-sizes and radii [m]; none for a mesh.
        position: Center at the start, shape (p,) [m].
        bounding_radius: Of the smallest sphere around `position` that holds all of it [m].
        path: Where the scenario says it.
        orientation: Unit quaternion (w, x, y, z).
        vertices: Corners of a mesh in its own axes, shape (k, 3) [m]; (0, 3) for the others.
        lift: In a planar mission, how far its center is above the robots' centers [m].
        motion: How it moves; None for what stands still.
        drive: Mass and drive of what moves; None for what stands still.
        color: Name of its color; None for the default.
        policy: What an opponent or a target of a team wants; None for what follows its motion.
    """

    name: str
    group: Group
    shape: str
    size: tuple[float, ...]
    position: Array
    bounding_radius: float
    path: Path
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    vertices: Array = NO_VERTICES
    lift: float = 0.0
    motion: Motion | None = None
    drive: Drive | None = None
    color: str | None = None
    policy: Policy | None = None

    @property
    def is_sphere(self) -> bool:
        """Whether distances to it are those to its center less its radius."""
        return self.shape == "sphere"

    @property
    def solid(self) -> Solid:
        """Its shape where it is at the start; two or three axes only."""
        center = in_space(self.position[np.newaxis])[0]
        center[2] += self.lift
        return Solid(self.shape, self.size, center, rotation_matrix(self.orientation), self.vertices)

    def gaps(self, points: Array) -> Array:
        """How far points are outside it at the start, shape (k, p) -> (k,) [m]; negative inside."""
        if self.is_sphere:
            return np.asarray(np.linalg.norm(points - self.position, axis=1) - self.size[0])
        return nearest_on_shape(self.solid, in_space(points))[1]

    def corners(self, axes: int) -> tuple[Array, Array]:
        """Lower and upper corner of the upright box around it at the start, shape (p,) each [m]."""
        if self.is_sphere:
            return self.position - self.size[0], self.position + self.size[0]
        low, high = extent(self.solid)
        return low[:axes], high[:axes]


def clear_of(bodies: Iterable[Body], points: Array, apart: float) -> NDArray[np.bool_]:
    """Whether points, shape (k, p), are at least a distance [m] outside some bodies at the start, (k,)."""
    clear = np.ones(len(points), dtype=bool)
    for body in bodies:  # the sphere around it tells of most points, at a fraction of the time
        near = clear & (np.linalg.norm(points - body.position, axis=1) < apart + body.bounding_radius)
        if near.any():
            clear[near] = body.gaps(points[near]) >= apart
    return clear
