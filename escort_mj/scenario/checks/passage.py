"""Checks of the circle or sphere around the target: its radius, and whether it fits through doors."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import Surface
from escort_mj.scenario.checks.mission import behaviors_of
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.expressions import Expression
from escort_mj.scenario.schema.scenario import Scenario

Array = NDArray[np.float64]

SAMPLES = 1001  # of the target's way
ACROSS = -0.5  # cosine of the angle between the ways to two walls from which on the target is between them


class DoorOnPath(NamedTuple):
    """The narrowest place between two walls that the target comes through."""

    width: float
    time: float
    between: str
    path: Path


def check_radii(mission: Mission) -> Iterator[Finding]:
    """Radii of the behavior `surface` that change are larger than bodies."""
    scenario = mission.scenario
    target = 0.0 if scenario.target is None else scenario.target.radius
    body = target + scenario.robots.largest_radius
    for path, surface in behaviors_of(scenario):
        if isinstance(surface, Surface) and isinstance(surface.radius, str):
            yield from _small(scenario, (*path, "radius"), surface.radius, body)


def _small(scenario: Scenario, path: Path, radius: str, body: float) -> Iterator[Finding]:
    """A radius that changes stays larger than bodies."""
    times = np.linspace(0.0, scenario.duration, SAMPLES)
    values = Expression(radius).evaluate(times)[0]
    at = int(np.argmin(values))
    if values[at] <= body:
        words = f"is {values[at]:.3g} m at t = {times[at]:g} s, inside the target's body; "
        words += f"expected more than {body:g} m"
        yield Finding(path, words, related=(("target", "radius"), ("robots", "radius")))


def check_doors(mission: Mission) -> Iterator[Finding]:
    """Every robot fits through the doors that the target comes through."""
    door, size = narrowest_door(mission, 0.0), 2.0 * mission.scenario.robots.largest_radius
    if door is not None and door.width < size:
        words = f"leaves {door.width:.3g} m between {door.between}, through which the target comes at "
        yield Finding(door.path, f"{words}{door.time:.3g} s; the largest robot needs {size:g} m")


def narrowest_door(mission: Mission, reach: float) -> DoorOnPath | None:
    """Return the narrowest place between two walls nearer to the target's way than a reach [m]."""
    scenario = mission.scenario
    if scenario.target is None or not scenario.walls:
        return None
    times = np.linspace(0.0, scenario.duration, SAMPLES)
    way = mission.target.position(times)
    reach = max(reach, 2.0 * scenario.robots.largest_radius)
    walls = [body for body in mission.obstacles if body.path[0] == "walls"]
    found: list[tuple[str, Path, Array, Array]] = []
    for wall in walls:
        gaps = wall.gaps(way)
        if gaps.min() < reach:
            step = 1e-4 * np.eye(scenario.axes)
            away = np.stack([wall.gaps(way + each) - wall.gaps(way - each) for each in step], axis=1) / 2e-4
            found.append((wall.name, wall.path, gaps, away))
    doors = []
    for (one, path, gap, away), (other, _, other_gap, other_away) in combinations(found, 2):
        between = (np.sum(away * other_away, axis=1) < ACROSS) & (gap < reach) & (other_gap < reach)
        if between.any():
            width = np.where(between, gap + other_gap, np.inf)
            at = int(np.argmin(width))
            doors.append(DoorOnPath(float(width[at]), float(times[at]), f"{one} and {other}", path))
    return min(doors, default=None)
