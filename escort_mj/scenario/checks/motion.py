"""Checks of what moves."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from escort_mj.components.waypoint import Waypoint
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.obstacle_tables import Motion


def check_motion(mission: Mission) -> Iterator[Finding]:
    """What moves says where to, in one way."""
    scenario = mission.scenario
    motions: list[tuple[Path, Motion]] = []
    if scenario.target is not None:
        motions.append((("target",), scenario.target))
    for index, obstacle in enumerate(scenario.obstacles):
        if obstacle.motion is not None:
            path: Path = ("obstacles", index, "motion")
            motions.append((path, obstacle.motion))
            if obstacle.motion.position is None and obstacle.motion.waypoints is None:
                yield Finding(path, "says nothing; give position or waypoints")
    for path, motion in motions:
        if motion.position is not None and motion.waypoints is not None:
            yield Finding(path, "found both position and waypoints; give one of them")


def check_order(mission: Mission) -> Iterator[Finding]:
    """Waypoints are in order of time, wherever they stand."""
    for path, part in mission.parts:
        if not isinstance(part, tuple):
            continue
        for index, (before, after) in enumerate(pairwise(part), 1):
            if isinstance(before, Waypoint) and isinstance(after, Waypoint) and after.time <= before.time:
                words = f"found {after.time:g} s after {before.time:g} s; waypoints are in order of time"
                yield Finding((*path, index, "time"), words)
