"""Robots from files: read beside the scenario, and what they are like written into it.

A scenario is complete once it is read: it holds where each file is, the digest of its content, and the mass,
size and limit of the robot, so that no other part needs to look into the file.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path as FilePath
from typing import Any

from pydantic import ValidationError

from escort_mj.errors import OutsideError, RobotError
from escort_mj.robots.mjcf import FileKind, Menagerie, Mjcf
from escort_mj.robots.modeled import RobotModel, known, known_now
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.reader.files.roots import Roots
from escort_mj.scenario.reader.files.waypoints import with_value

ASSETS, DIGITS = "assets", 12  # where a run folder has copies, and what of the digest is their name
KINDS: dict[str, type[FileKind]] = {"mjcf": Mjcf, "menagerie": Menagerie}


def read_robots(data: dict[str, Any], roots: Roots) -> tuple[dict[str, Any], list[Finding]]:
    """Return plain data with what robots from files are like.

    Args:
        data: What a scenario says; it is not changed.
        roots: Where files are looked for.

    Returns:
        The data, and what is wrong with files; those are left as they were written.
    """
    found: list[Finding] = []
    robots = data.get("robots")
    if not isinstance(robots, dict):
        return data, found
    overrides = robots.get("overrides")
    tables: list[tuple[Path, dict[str, Any]]] = [(("robots",), robots)]
    if isinstance(overrides, list | tuple):
        tables += [
            (("robots", "overrides", k), one) for k, one in enumerate(overrides) if isinstance(one, dict)
        ]
    for path, table in tables:
        kind = _kind(table.get("kind"))
        if kind is None:
            continue
        try:
            table, model = _resolved(table, kind, roots)
        except RobotError as error:
            found.append(Finding((*path, "kind"), str(error)))
        else:
            data = with_value(data, path, table)
            physics = data.get("physics") or {}
            if model.damped and isinstance(physics, dict):  # unless the scenario says otherwise
                data = {**data, "physics": {"integrator": "implicitfast", **physics}}
            found += _misfits(path, table, model)
    return data, found


def _kind(written: Any) -> FileKind | None:
    """The kind that a table names, if it is from a file and right by itself."""
    if not isinstance(written, dict) or (kind := str(written.get("kind"))) not in KINDS:
        return None
    try:
        return KINDS[kind].model_validate(written)
    except ValidationError:
        return None  # said of the scenario as a whole


def _resolved(table: dict[str, Any], kind: FileKind, roots: Roots) -> tuple[dict[str, Any], RobotModel]:
    """A table with the numbers of its robot.

    Raises:
        RobotError: If it cannot be read.
    """
    copy = roots.folder / ASSETS / f"{(kind.sha256 or '')[:DIGITS]}.xml"
    if kind.sha256 is not None and copy.is_file():  # of a run folder
        source = kind.asked_for(copy.absolute(), None)
    elif isinstance(kind, Mjcf):
        file = FilePath(kind.file)
        if file.is_absolute() and kind.sha256 is None and not roots.declared:
            raise RobotError(f"{file.name}: expected a path relative to the scenario's folder, or its sha256")
        vouched = file.is_absolute() and kind.sha256 is not None
        source = kind.asked_for((roots.folder / file).absolute(), None if vouched else roots.root.absolute())
    else:
        source = kind.source(1.0, 1.0)
    try:
        model = known_now(source)
    except OutsideError as error:
        raise RobotError(f"{error.name}: {roots.outside(FilePath(error.file))}") from None
    whole = {key: value for key, value in table["kind"].items() if key != "model"}
    whole |= {"kind": "mjcf", "file": source.file, "sha256": model.digest}
    known(Mjcf.model_validate(whole).source(1.0, 1.0), model)
    filled = {"mass": model.mass, "radius": model.radius, "force_limit": model.force_limit}
    return {**filled, **table, "kind": whole}, model


def _misfits(path: Path, table: dict[str, Any], model: RobotModel) -> Iterator[Finding]:
    """What a table says of a robot that its file says otherwise."""
    radius, mass = table["radius"], table["mass"]
    if isinstance(mass, int | float) and abs(mass - model.mass) > 1e-9 * model.mass:
        yield Finding(
            (*path, "mass"), f"found {mass:g} kg; the robot's file says {model.mass:.6g} kg, leave it out"
        )
    if isinstance(radius, int | float) and radius < model.radius * (1.0 - 1e-9):
        yield Finding(
            (*path, "radius"),
            f"found {radius:g} m; it reaches {model.radius:.4g} m from the point that the law controls",
        )


__all__ = ["read_robots"]
