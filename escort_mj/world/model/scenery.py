"""Reads surroundings from MJCF or a mesh: where each geom that can collide stands, and what shape it has."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from mujoco import mjtGeom
from numpy.typing import NDArray

from escort_mj.errors import RobotError
from escort_mj.robots.modeled import Source
from escort_mj.world.model.robot.files import read_files
from escort_mj.world.model.robot.reading import compiled

Array = NDArray[np.float64]

SHAPES = {
    mjtGeom.mjGEOM_SPHERE: ("sphere", 1),
    mjtGeom.mjGEOM_BOX: ("box", 3),
    mjtGeom.mjGEOM_CYLINDER: ("cylinder", 2),
    mjtGeom.mjGEOM_CAPSULE: ("capsule", 2),
    mjtGeom.mjGEOM_ELLIPSOID: ("ellipsoid", 3),
    mjtGeom.mjGEOM_MESH: ("mesh", 0),
}
"""The shapes of obstacles, and how many numbers their sizes have."""


class Part(NamedTuple):
    """One geom of the surroundings.

    Attributes:
        name: Its own, its body's, or that of its shape.
        shape: One of `obstacle_tables.Shape`.
        size: Half-sizes as MuJoCo has them [m]; none for a mesh.
        position: Center, in the file's axes, shape (3,) [m].
        orientation: Unit quaternion (w, x, y, z), from the geom's axes to the file's.
        vertices: Of a mesh's convex hull, in the geom's axes, shape (k, 3) [m]; (0, 3) for others.
    """

    name: str
    shape: str
    size: tuple[float, ...]
    position: Array
    orientation: tuple[float, ...]
    vertices: Array


def read_parts(source: Source) -> list[Part]:
    """Return the geoms of a file that can collide, but for planes: the floor is the scenario's.

    Args:
        source: An MJCF file or a mesh.

    Raises:
        RobotError: If the file is missing or wrong, or something of it that can collide moves.
    """
    name = source.name
    model, _ = compiled(read_files(source), name)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    parts = []
    for geom in np.flatnonzero(model.geom_contype | model.geom_conaffinity).tolist():
        kind, body = mjtGeom(model.geom_type[geom]), model.body(model.geom_bodyid[geom])
        if kind == mjtGeom.mjGEOM_PLANE:
            continue
        if model.body_weldid[body.id]:
            raise RobotError(
                f"{name}: the body {body.name} moves; scenery stands: expected no joints, no mocap"
            )
        if kind not in SHAPES:
            word = kind.name.removeprefix("mjGEOM_").lower()
            raise RobotError(f"{name}: found a geom of type {word}; expected primitives and meshes")
        shape, numbers = SHAPES[kind]
        turned = np.zeros(4)
        mujoco.mju_mat2Quat(turned, data.geom_xmat[geom])
        own = "" if body.id == 0 or body.name.startswith("unnamed_") else body.name
        parts.append(
            Part(
                name=model.geom(geom).name or own or shape,
                shape=shape,
                size=tuple(model.geom_size[geom, :numbers].tolist()),
                position=data.geom_xpos[geom].copy(),
                orientation=tuple(turned.tolist()),
                vertices=_hull(model, model.geom_dataid[geom]) if shape == "mesh" else np.zeros((0, 3)),
            )
        )
    if not parts:
        raise RobotError(f"{name}: has no geom that can collide, besides planes")
    return parts


def _hull(model: mujoco.MjModel, mesh: int) -> Array:
    """Vertices of the convex hull of a mesh, which MuJoCo collides, shape (k, 3) [m]."""
    first = model.mesh_vertadr[mesh]
    vertices = np.asarray(model.mesh_vert[first : first + model.mesh_vertnum[mesh]], dtype=float)
    if (graph := model.mesh_graphadr[mesh]) < 0:
        return vertices
    count = model.mesh_graph[graph]
    return np.asarray(vertices[model.mesh_graph[graph + 2 + count : graph + 2 + 2 * count]])
