"""Marks drawn into MuJoCo's scene beside the model.

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
from escort_mj.report.video.marks import Mark, marks
from escort_mj.report.video.replay import Flags, Moment, Replay

Array = NDArray[np.float64]

NOT_DRAWN = ("velocities", "numbers")  # layers that MuJoCo's pictures do not have
DASHES = 24  # pieces of a dashed line, gaps included

_IDENTITY = np.eye(3).ravel()
_ORIGIN = np.zeros(3)
_UNIT = np.ones(3)


def draw_marks(
    scene: mujoco.MjvScene,
    replay: Replay,
    moment: Moment,
    trail: float,
    flags: tuple[Flags, Flags] | None,
    width: int,
) -> None:
    """Add the marks of a moment, but arrows and texts, to a scene that was just updated from the data.

    Args:
        scene: MuJoCo's scene.
        replay: As of `marks`.
        moment: As of `marks`.
        trail: As of `marks`.
        flags: As of `marks`.
        width: Of the picture [pixel].
    """
    writer, pixel = SceneWriter(scene), max(width / 1280.0, 0.5)
    forward = np.array(scene.camera[0].forward, dtype=float)
    for mark in marks(replay, moment, trail, flags, forward, NOT_DRAWN):
        if mark.kind in ("line", "trail", "circle"):
            writer.path(path_of(mark), mark.color, pixel * mark.width, opacity_of(mark), mark.dashed)
        elif mark.kind == "outline":
            ring = circle(mark.placed[0], mark.radius, mark.pieces, *writer.facing)
            writer.path(ring, mark.color, pixel * mark.width, mark.alpha)
        elif mark.kind == "ball":
            writer.ball(mark.placed[0], mark.radius, mark.color, mark.alpha)
        elif mark.kind == "disc":
            writer.disc(mark.placed[0], mark.radius, mark.color, mark.alpha, mark.pieces)


def path_of(mark: Mark) -> Array:
    """Points that a line, a trail or a circle goes through, shape (k, 3) [m]."""
    points = mark.placed
    if mark.kind == "circle":
        return circle(points[0], mark.radius, mark.pieces, *np.delete(np.eye(3), mark.normal, axis=0))
    return np.linspace(points[0], points[-1], DASHES) if mark.dashed else points


def opacity_of(mark: Mark) -> float | Array:
    """Opacity of each piece of a line, shape (k - 1,), or of all: trails fade."""
    return np.linspace(0.05, 0.9, max(len(mark.points) - 1, 0)) if mark.kind == "trail" else mark.alpha


def lines_of(mark: Mark) -> tuple[Array, Array]:
    """Pieces of a line and their colors, shape (k, 2, 3) each [m]: trails fade toward white."""
    path = path_of(mark)
    pieces = np.stack([path[:-1], path[1:]], axis=1)
    fading = np.broadcast_to(opacity_of(mark) if mark.kind == "trail" else 1.0, len(pieces))[:, None, None]
    inks = np.broadcast_to(1.0 - fading * (1.0 - np.array(mark.color)), pieces.shape)
    step = 2 if mark.dashed else 1
    return pieces[::step], inks[::step]


class SceneWriter:
    """Adds marks to a scene that was just updated from the data.

    Attributes:
        scene: MuJoCo's scene; marks beyond its `maxgeom` are left out.
    """

    def __init__(self, scene: mujoco.MjvScene) -> None:
        self.scene = scene

    @property
    def facing(self) -> tuple[Array, Array]:
        """Unit vectors of the camera's picture, across and up."""
        camera = self.scene.camera[0]
        up = np.array(camera.up, dtype=float)
        return np.cross(np.array(camera.forward, dtype=float), up), up

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
