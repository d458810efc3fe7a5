"""Lines, balls and discs drawn into MuJoCo's scene beside the model.

Everything long is made of mjGEOM_LINE, which costs a software renderer almost nothing; capsules cost
forty times as much. So do cylinders, hundreds of faces each: discs are made of a few triangles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.palette import Color

Array = NDArray[np.float64]

_IDENTITY = np.eye(3).ravel()
_ORIGIN = np.zeros(3)
_UNIT = np.ones(3)


class Pen:
    """Adds marks to a scene that was just updated from the data.

    Attributes:
        scene: MuJoCo's scene; marks beyond its `maxgeom` are left out.
    """

    def __init__(self, scene: mujoco.MjvScene) -> None:
        self.scene = scene

    def path(
        self, points: Array, color: Color, width: float, alpha: float | Array = 1.0, dashed: bool = False
    ) -> None:
        """A line through points.

        Args:
            points: Shape (k, 3) [m].
            color: Its color.
            width: Its width [pixel].
            alpha: Its opacity, one for all or one per piece, shape (k-1,).
            dashed: Whether every other piece is left out.
        """
        pieces = len(points) - 1
        opacity = np.broadcast_to(alpha, (max(pieces, 0),))
        for piece in range(0, pieces, 2 if dashed else 1):
            if geom := self._add((*color, float(opacity[piece]))):
                mujoco.mjv_connector(
                    geom, mujoco.mjtGeom.mjGEOM_LINE, width, points[piece], points[piece + 1]
                )

    def ball(self, center: Array, radius: float, color: Color, alpha: float) -> None:
        """A sphere, mostly a see-through one."""
        if geom := self._add((*color, alpha)):
            geom.type = mujoco.mjtGeom.mjGEOM_SPHERE
            geom.size[:] = radius
            geom.pos[:] = center

    def disc(self, center: Array, radius: float, color: Color, alpha: float, pieces: int) -> None:
        """A flat disc lying on the floor: a fan of triangles, whose corners their frames are bent to."""
        rim = radius * _rim(pieces)
        for piece in range(pieces):
            if geom := self._add((*color, alpha)):
                geom.type = mujoco.mjtGeom.mjGEOM_TRIANGLE
                geom.pos[:] = center
                geom.mat[:, 0], geom.mat[:, 1] = rim[piece], rim[piece + 1]

    def _add(self, rgba: Sequence[float]) -> mujoco.MjvGeom | None:
        """A geom of this color at the end of the scene; None where the scene is full."""
        scene = self.scene
        if scene.ngeom >= scene.maxgeom:
            return None
        geom = scene.geoms[scene.ngeom]
        scene.ngeom += 1
        mujoco.mjv_initGeom(
            geom, mujoco.mjtGeom.mjGEOM_SPHERE, _UNIT, _ORIGIN, _IDENTITY, np.array(rgba, dtype=np.float32)
        )
        geom.specular = 0.0
        return geom


@cache
def _rim(pieces: int) -> Array:
    """A closed circle of radius 1 on the floor, shape (pieces + 1, 3)."""
    return circle(_ORIGIN, 1.0, pieces, _IDENTITY[:3], _IDENTITY[3:6])


def circle(center: Array, radius: float, pieces: int, across: Array, up: Array) -> Array:
    """A closed circle in the plane of two unit vectors, shape (pieces + 1, 3) [m]."""
    angle = np.linspace(0.0, 2.0 * math.pi, pieces + 1)[:, None]
    return center + radius * (np.cos(angle) * across + np.sin(angle) * up)
