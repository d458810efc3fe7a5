"""Surroundings from files: each geom that can collide becomes an obstacle of the scenario.

A scenario is complete once it is read: it holds shapes and places, and no other part looks into the file.
In the plane, what stands is taken as an upright prism over its outline as seen from above.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from importlib import import_module
from itertools import product
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from escort_mj.components.parameters import STRICT
from escort_mj.errors import OutsideError, RobotError
from escort_mj.robots.modeled import Source
from escort_mj.scenario.findings import Finding, Path, shortened
from escort_mj.scenario.geometry.shapes import Solid, extent, half_extent, quaternion, rotation_matrix
from escort_mj.scenario.reader.files.roots import Roots
from escort_mj.scenario.reader.plain import tuples
from escort_mj.scenario.schema.obstacle_tables import MOST_SCENERY, MOST_VERTICES, Scenery

Array = NDArray[np.float64]

KEY = "scenery"
READER = "escort_mj.world.model.scenery"
"""Module that reads geoms. Scenarios know no simulator: it is found when a file is first asked for."""
SIDES = 32  # of the outline of what is round
UPRIGHT = 1.0 - 1e-9  # cosine of the angle between a geom's z axis and the vertical
LEVEL = 1e-8  # cosine of a pitch from which roll and yaw cannot be told apart
LONGEST = 40  # letters of a name


class MisfitError(Exception):
    """Surroundings that do not fit the mission: at which key, and how."""


def read_scenery(
    data: dict[str, Any], roots: Roots
) -> tuple[dict[str, Any], dict[Path, Path], list[Finding]]:
    """Return plain data with obstacles in place of surroundings from files.

    Args:
        data: What a scenario says; it is not changed.
        roots: Where files are looked for.

    Returns:
        The data; where the scenario has what stands elsewhere in the data; and what is wrong with files:
        their tables are left, with a table for the key that is wrong, which is right for none.
    """
    written, listed = data.get(KEY), data.get("obstacles", ())
    origins: dict[Path, Path] = {}
    found: list[Finding] = []
    if not isinstance(written, list | tuple) or not isinstance(listed, list | tuple):
        return data, origins, found
    if not 0 < len(written) <= MOST_SCENERY:  # too many are an error of the scenario as a whole
        return data, origins, found
    obstacles, names = list(listed), Counter[str]()
    left: list[Any] = []
    for k, entry in enumerate(written):
        place, key, words = (KEY, len(left)), "file", ""
        try:
            scenery = Scenery.model_validate(tuples(entry), strict=True, context=STRICT)
            tables = _obstacles(scenery, data.get("axes", 2), roots, names)
        except ValidationError:
            left.append(entry)  # said of the scenario as a whole
        except OutsideError as error:
            words = f"{error.name}: {roots.outside(FilePath(error.file))}"
        except RobotError as error:
            words = str(error)
        except MisfitError as error:
            key, words = error.args
        else:
            origins |= {("obstacles", len(obstacles) + n): (KEY, k) for n in range(len(tables))}
            obstacles += tables
            continue
        origins[place] = (KEY, k)
        if words:
            found.append(Finding((*place, key), words))
            left.append({**entry, key: {}})
    return {**data, "obstacles": obstacles, KEY: left}, origins, found


def _obstacles(scenery: Scenery, axes: Any, roots: Roots, names: Counter[str]) -> list[dict[str, Any]]:
    """Return the table of each obstacle of a file.

    Raises:
        RobotError: If the file cannot be read, or something of it cannot be an obstacle.
        MisfitError: If it does not fit the mission's axes.
    """
    if axes not in (2, 3):
        raise MisfitError("file", f"found a mission of {shortened(str(axes))} axes; scenery has 2 or 3")
    origin = np.zeros(3)
    if scenery.position is not None:
        if len(scenery.position) != axes:
            raise MisfitError(
                "position", f"found {len(scenery.position)} numbers; expected {axes}, as axes says"
            )
        origin[:axes] = scenery.position
    if axes == 2 and isinstance(scenery.orientation, tuple):
        raise MisfitError("orientation", "found an orientation in space; in the plane, expected a yaw angle")
    file = roots.folder / scenery.file
    reading: Any = import_module(READER)
    source = Source(file=str(file.absolute()), folder=str(roots.root.absolute()), name=file.name)
    turned = rotation_matrix(quaternion(scenery.orientation))
    tables = []
    for part in reading.read_parts(source):
        solid = Solid(
            part.shape,
            part.size,
            origin + turned @ part.position,
            turned @ rotation_matrix(part.orientation),
            part.vertices,
        )
        table = _in_space(solid) if axes == 3 else _in_plane(solid, scenery.below)
        if table is None:
            continue
        if len(table.get("vertices", ())) > MOST_VERTICES:
            words = (
                f"{file.name}: the hull of {part.name} has {len(table['vertices'])} vertices; allowed are "
            )
            raise RobotError(f"{words}{MOST_VERTICES}: the attribute maxhullvert of a mesh limits them")
        wanted = re.sub(r"[^A-Za-z0-9_\-]", "_", f"{scenery.name or file.stem}_{part.name}")
        table["name"] = _unlike(wanted[: LONGEST - 6], names)
        if scenery.color is not None:
            table["color"] = scenery.color
        tables.append(table)
    if not tables:
        raise RobotError(
            f"{file.name}: nothing of it stands between the floor and {scenery.below:g} m (below)"
        )
    return tables


def _in_space(solid: Solid) -> dict[str, Any]:
    """Return the table of an obstacle in space."""
    table: dict[str, Any] = {"shape": solid.shape, "position": tuple(solid.center.tolist())}
    if solid.shape == "sphere":
        return table | {"radius": solid.size[0]}
    if solid.shape == "mesh":  # turned, so that no orientation is needed
        return table | {"vertices": tuple(map(tuple, (solid.vertices @ solid.rotation.T).tolist()))}
    return table | {"size": solid.size, "orientation": _angles(solid.rotation)}


def _in_plane(solid: Solid, below: float) -> dict[str, Any] | None:
    """Return the table of an obstacle in the plane; None of what is not between the floor and a height."""
    low, high = extent(solid)
    if low[2] >= below or high[2] <= 0.0:
        return None
    table: dict[str, Any] = {"position": tuple(solid.center[:2].tolist())}
    upright = abs(solid.rotation[2, 2]) > UPRIGHT
    if solid.shape == "sphere" or (upright and solid.shape in ("cylinder", "capsule")):
        return table | {"shape": "cylinder", "size": (solid.size[0],)}
    if upright and solid.shape == "box":
        yaw = math.atan2(solid.rotation[1, 0], solid.rotation[0, 0])
        return table | {"shape": "box", "size": solid.size[:2], "orientation": yaw}
    return table | {"shape": "mesh", "vertices": tuple(map(tuple, _outline(solid).tolist()))}


def _outline(solid: Solid) -> Array:
    """Return corners of the outline as seen from above, relative to the center, shape (k, 2) [m].

    What is round gets a polygon around it.
    """
    from scipy.spatial import ConvexHull, QhullError  # slow to import, and few scenarios need it

    if solid.shape in ("mesh", "box"):
        corners = np.array(list(product((-1.0, 1.0), repeat=3))) * (solid.size or 1.0)
        points = ((solid.vertices if solid.shape == "mesh" else corners) @ solid.rotation.T)[:, :2]
    else:
        turn = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
        directions = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(SIDES)])
        far = half_extent(solid, directions)
        pairs = np.stack([directions[:, :2], np.roll(directions[:, :2], -1, axis=0)], axis=1)
        points = np.linalg.solve(pairs, np.stack([far, np.roll(far, -1)], axis=1)[..., np.newaxis])[..., 0]
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:  # a line
        return points


def _angles(rotation: Array) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of a rotation [rad]."""
    level = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], level)
    if level < LEVEL:  # roll and yaw turn about the same axis
        return math.atan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0
    return math.atan2(rotation[2, 1], rotation[2, 2]), pitch, math.atan2(rotation[1, 0], rotation[0, 0])


def _unlike(name: str, names: Counter[str]) -> str:
    """Return a name, numbered where one is like it."""
    names[name] += 1
    return name if names[name] == 1 else _unlike(f"{name}_{names[name]}", names)
