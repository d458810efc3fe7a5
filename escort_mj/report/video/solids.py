"""The solid bodies of a model as triangles, and where they are: for pictures that MuJoCo does not draw."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RunFolderError
from escort_mj.files import read_text

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SLICES, STACKS = 28, 14  # of a round shape
MOST_WORDS = 300  # letters of what MuJoCo says
_ROBOT = re.compile(r"robot_(\d+)(_|$)")
_GEOM = mujoco.mjtGeom


class Mesh(NamedTuple):
    """Triangles of a shape. Corners at which it has an edge stand there once for each face.

    Attributes:
        vertices: Shape (k, 3) [m], or of a shape of half size 1.
        faces: Indices into them, counterclockwise as seen from outside, shape (f, 3).
    """

    vertices: Array
    faces: Indices


@dataclass(frozen=True)
class Solids:
    """What is to be drawn of a model: bodies that share a few shapes.

    Attributes:
        meshes: The shapes.
        names: Of the geoms.
        geoms: Their indices in the model, shape (g,).
        kind: MuJoCo's type of each, shape (g,).
        mesh: Index of each geom's shape, shape (g,).
        scale: By what its shape is stretched along its own axes, shape (g, 3).
        color: Red, green, blue and opacity of each in 0..1, shape (g, 4).
        robot: The robot from 0 that it is a part of, -1 for none, shape (g,).
    """

    meshes: list[Mesh]
    names: list[str]
    geoms: Indices
    kind: Indices
    mesh: Indices
    scale: Array
    color: Array
    robot: Indices


def load_model(path: Path, coordinates: int) -> mujoco.MjModel:
    """The model of a run.

    Args:
        path: Its model.xml.
        coordinates: How many generalized positions the trace has.

    Raises:
        RunFolderError: If the model cannot be loaded, or does not fit the trace.
    """
    read_text(path)  # MuJoCo says less of what is no text
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, mujoco.FatalError) as fault:
        words = " ".join(str(fault).split())[:MOST_WORDS]
        raise RunFolderError(f"{path}: is damaged: MuJoCo refuses it: {words}") from None
    if model.nq != coordinates:
        raise RunFolderError(
            f"{path}: is damaged: it has {model.nq} coordinates, the trace has {coordinates}"
        )
    return model


def pose(model: mujoco.MjModel, data: mujoco.MjData, qpos: Array, target: Array) -> None:
    """Restore the position of every body.

    Args:
        model: The model.
        data: What to change.
        qpos: Generalized positions.
        target: Position of the target, shape (3,) [m].
    """
    data.qpos[:] = qpos
    mujoco.mj_normalizeQuat(model, data.qpos)
    mocap = model.body("target").mocapid[0]
    if mocap >= 0:  # one that can be bumped has coordinates
        data.mocap_pos[mocap] = target
    mujoco.mj_kinematics(model, data)


def solids_of(model: mujoco.MjModel) -> Solids:
    """The bodies of the mission's own place, without its floor and the stages of further axes."""
    chosen = np.flatnonzero((model.geom_group == 0) & (model.geom_type != _GEOM.mjGEOM_PLANE))
    meshes: dict[tuple[float, ...], tuple[int, Mesh]] = {}
    indices, scales = [], []
    for geom in chosen:
        key, scale = _shape(model, int(geom))
        if key not in meshes:
            meshes[key] = len(meshes), _mesh(model, key)
        indices.append(meshes[key][0])
        scales.append(scale)
    names = [model.geom(int(geom)).name for geom in chosen]
    bodies = [model.body(int(model.geom_bodyid[geom])).name for geom in chosen]
    found = [_ROBOT.match(body) for body in bodies]
    return Solids(
        meshes=[mesh for _, mesh in meshes.values()],
        names=names,
        geoms=chosen,
        kind=model.geom_type[chosen].astype(np.int64),
        mesh=np.array(indices, dtype=np.int64),
        scale=np.array(scales, dtype=float).reshape(-1, 3),
        color=model.geom_rgba[chosen].astype(float),
        robot=np.array([int(match[1]) - 1 if match else -1 for match in found], dtype=np.int64),
    )


def places(model: mujoco.MjModel, data: mujoco.MjData, geoms: Indices) -> tuple[Array, Array]:
    """Where geoms are: positions, shape (g, 3) [m], and orientations (wxyz), shape (g, 4)."""
    w, x, y, z = data.xquat[model.geom_bodyid[geoms]].T
    a, b, c, d = model.geom_quat[geoms].T
    turned = np.stack(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ],
        axis=1,
    )
    return data.geom_xpos[geoms].copy(), turned


def floor_of(model: mujoco.MjModel) -> tuple[Array, Array] | None:
    """Place (3,) [m] and orientation (wxyz) of the floor; None where there is none."""
    planes = np.flatnonzero(model.geom_type == _GEOM.mjGEOM_PLANE)
    if not len(planes):
        return None
    return model.geom_pos[planes[0]].copy(), model.geom_quat[planes[0]].copy()


def _shape(model: mujoco.MjModel, geom: int) -> tuple[tuple[float, ...], Array]:
    """What tells a geom's shape from others, and by what that is stretched, shape (3,)."""
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == _GEOM.mjGEOM_MESH:
        return (kind, int(model.geom_dataid[geom])), np.ones(3)
    if kind == _GEOM.mjGEOM_CAPSULE:  # its ends stay round only if all of it is stretched alike
        return (kind, round(size[1] / size[0], 6)), np.full(3, size[0])
    if kind == _GEOM.mjGEOM_CYLINDER:
        return (kind,), np.array([size[0], size[0], size[1]])
    if kind == _GEOM.mjGEOM_BOX:
        return (kind,), size.copy()
    return (int(_GEOM.mjGEOM_SPHERE),), size.copy() if kind == _GEOM.mjGEOM_ELLIPSOID else np.full(3, size[0])


def _mesh(model: mujoco.MjModel, key: tuple[float, ...]) -> Mesh:
    """The triangles of a shape."""
    kind = int(key[0])
    if kind == _GEOM.mjGEOM_MESH:
        mesh = int(key[1])
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        first, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        corners = model.mesh_vert[start : start + count][model.mesh_face[first : first + faces]]
        return Mesh(corners.reshape(-1, 3).astype(float), np.arange(3 * faces).reshape(-1, 3))
    if kind == _GEOM.mjGEOM_BOX:
        return _box()
    if kind == _GEOM.mjGEOM_CYLINDER:
        side = _turned([(1.0, -1.0), (1.0, 1.0)])
        lid, base = _turned([(1.0, 1.0), (0.0, 1.0)]), _turned([(0.0, -1.0), (1.0, -1.0)])
        return _joined(side, lid, base)
    half = key[1] if kind == _GEOM.mjGEOM_CAPSULE else 0.0
    angle = np.linspace(-math.pi / 2, math.pi / 2, STACKS + 2 if half else STACKS + 1)
    lower = angle < 0.0 if half else np.zeros(len(angle), dtype=bool)
    height = np.sin(angle) + np.where(lower, -half, half)
    return _turned([*zip(np.cos(angle), height, strict=True)])


def _turned(profile: list[tuple[float, float]]) -> Mesh:
    """A profile of (distance from the axis, height), from below upward, turned around z."""
    around = np.linspace(0.0, 2.0 * math.pi, SLICES + 1)
    rings = [
        np.stack([radius * np.cos(around), radius * np.sin(around), np.full(SLICES + 1, height)], axis=1)
        for radius, height in profile
    ]
    low = np.arange(SLICES) + (SLICES + 1) * np.arange(len(profile) - 1)[:, None]
    a, b = low.ravel(), low.ravel() + 1
    c, d = a + SLICES + 1, b + SLICES + 1
    return Mesh(np.concatenate(rings), np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)]))


def _box() -> Mesh:
    """A cube of half size 1."""
    square = np.array([[1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])
    sides = [np.roll(square * (sign, sign, 1.0), turn, axis=1) for turn in range(3) for sign in (1.0, -1.0)]
    corners = np.concatenate(sides)
    first = 4 * np.arange(6)[:, None]
    return Mesh(corners, np.concatenate([first + [0, 1, 2], first + [0, 2, 3]]))


def _joined(*meshes: Mesh) -> Mesh:
    """Several as one."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts[:-1], strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))
