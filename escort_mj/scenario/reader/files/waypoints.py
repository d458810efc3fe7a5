"""What scenarios name files for: waypoints, as planners and loggers write them, networks and grids.

Waypoints are comma-separated values, a line for each.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterator
from pathlib import Path as FilePath
from typing import Any

from escort_mj.recognize import irregular
from escort_mj.scenario.findings import Finding, Path, shortened
from escort_mj.scenario.reader.files.arrays import read_grid
from escort_mj.scenario.reader.files.networks import read_network
from escort_mj.scenario.reader.files.roots import Roots

SUFFIX = ".csv"
MOST = 10_000  # waypoints of a table
TIMES = ("t", "time")


def read_tables(data: dict[str, Any], roots: Roots) -> tuple[dict[str, Any], list[Finding]]:
    """Return plain data with waypoints, networks and grids in place of the names of their files.

    Args:
        data: What a scenario says; it is not changed.
        roots: Where files are looked for.

    Returns:
        The data, and what is wrong with files: those are left as their names.
    """
    found: list[Finding] = []
    places: list[tuple[Path, Any, Callable[[FilePath], Any]]]
    places = [((*path, "waypoints"), table, _read) for path, table in _motions(data)]
    places += [((*path, "network"), table, read_network) for path, table in _networked(data)]
    fields = _listed(data.get("uncertainty"), "disturbances")
    places += [(("uncertainty", *path, "grid"), table, read_grid) for path, table in fields]
    for path, table, read in places:
        name = table.get(str(path[-1])) if isinstance(table, dict) else None
        if not isinstance(name, str):
            continue
        try:
            rows = read(_within(roots, name))
        except ValueError as error:
            found.append(Finding(path, f"{shortened(name)}{error}"))
        else:
            data = with_value(data, path, rows)
    return data, found


def _networked(data: dict[str, Any]) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Every table that may have a network, a policy's or a behavior's, and its place."""
    mission = data.get("mission")
    stacks: list[tuple[Path, Any]] = [(("mission",), mission)]
    stacks += [(("mission", *path), phase) for path, phase in _listed(mission, "supervisor")]
    for path, owner in [*_targets(data), *_listed(data, "opponents")]:
        if isinstance(owner, dict) and isinstance(owner.get("policy"), dict):
            yield (*path, "policy"), owner["policy"]
    for path, stack in stacks:
        for place, behavior in _listed(stack, "behaviors"):
            if isinstance(behavior, dict):
                yield (*path, *place), behavior


def _listed(table: Any, key: str) -> list[tuple[Path, Any]]:
    """Each entry of a list that a table has under a key, and its place in the table, if it is a list."""
    entries = table.get(key) if isinstance(table, dict) else None
    return [((key, k), entry) for k, entry in enumerate(entries if isinstance(entries, list | tuple) else ())]


def _targets(data: dict[str, Any]) -> list[tuple[Path, Any]]:
    """The target, those of teams, and their places."""
    teams = _listed(data, "teams")
    own = [((*path, *place), each) for path, team in teams for place, each in _listed(team, "targets")]
    return [(("target",), data.get("target")), *own]


def _motions(data: dict[str, Any]) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Every table that may have waypoints, and its place."""
    yield from ((path, target) for path, target in _targets(data) if isinstance(target, dict))
    for path, obstacle in _listed(data, "obstacles"):
        if isinstance(obstacle, dict) and isinstance(obstacle.get("motion"), dict):
            yield (*path, "motion"), obstacle["motion"]


def with_value(value: Any, path: Path, new: Any) -> Any:
    """Return a copy of nested tables and lists with another value at one place."""
    if not path:
        return new
    key, *rest = path
    changed: Any = dict(value) if isinstance(value, dict) else list(value)
    changed[key] = with_value(value[key], tuple(rest), new)
    return changed


def _within(roots: Roots, name: str) -> FilePath:
    """Return the file of a name.

    Raises:
        ValueError: If the name leads out of the root.
    """
    file = roots.folder / name
    if words := roots.outside(file):
        raise ValueError(f": {words}")
    return file


def _read(file: FilePath) -> list[dict[str, Any]]:
    """Return the waypoints of a table.

    Raises:
        ValueError: If it cannot be read or a line is wrong; the words follow the name of the file.
    """
    if file.suffix != SUFFIX:
        raise ValueError(f": waypoints are a list, or the name of a file with the suffix {SUFFIX}")
    if kind := irregular(file):
        raise ValueError(f": is {kind}, not a file")
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise ValueError(": there is no such file beside the scenario") from None
    except (OSError, ValueError) as error:
        raise ValueError(f": cannot be read: {getattr(error, 'strerror', None) or error}") from None
    waypoints: list[dict[str, Any]] = []
    for number, row in enumerate(csv.reader(lines), 1):
        cells = [cell.strip() for cell in row]
        if not any(cells) or cells[0].startswith("#") or (not waypoints and cells[0].lower() in TIMES):
            continue
        numbers = _numbers(cells, number)
        if waypoints and len(numbers) - 1 != len(waypoints[0]["position"]):
            raise ValueError(f":{number}: found {len(numbers)} numbers; the lines before have another count")
        waypoints.append({"time": numbers[0], "position": numbers[1:]})
        if len(waypoints) > MOST:
            raise ValueError(f": found more than {MOST:,} waypoints")
    if not waypoints:
        raise ValueError(": holds no waypoint; a line is a time [s] and a position [m], as in 0,1.5,2")
    return waypoints


def _numbers(cells: list[str], number: int) -> list[float]:
    """Return the numbers of a line: a time, and a position of two axes or more."""
    try:
        numbers = [float(cell) for cell in cells]
    except ValueError:
        wrong = next(cell for cell in cells if not _is_number(cell))
        raise ValueError(f":{number}: found {shortened(wrong)!r}; a line is a time and a position") from None
    if len(numbers) < 3 or not all(map(math.isfinite, numbers)):
        raise ValueError(f":{number}: a line is a time [s] and a position [m], as in 0,1.5,2; all are finite")
    return numbers


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
