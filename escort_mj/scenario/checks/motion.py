"""Checks of what moves or pushes as a function of time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np

from escort_mj.components.waypoint import Waypoint
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.expressions import Expression
from escort_mj.scenario.schema.fields import Component
from escort_mj.scenario.schema.obstacle_tables import Motion
from escort_mj.scenario.schema.scenario import Scenario

SAMPLES = 20_001
LARGEST = 1e6  # m, N: far beyond any mission, far below where MuJoCo gives up


def check_motion(mission: Mission) -> Iterator[Finding]:
    """Waypoints in order, and every expression defined, with its derivative, through the whole run."""
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
        yield from check_order((*path, "waypoints"), motion.waypoints or ())
        yield from check_defined(scenario, (*path, "position"), motion.position or ())
    yield from check_defined(scenario, ("uncertainty", "disturbance"), scenario.uncertainty.disturbance or ())


def check_order(path: Path, waypoints: Sequence[Waypoint]) -> Iterator[Finding]:
    """Waypoints are in order of time."""
    for index, (before, after) in enumerate(pairwise(waypoints), 1):
        if after.time <= before.time:
            words = f"found {after.time:g} s after {before.time:g} s; waypoints are in order of time"
            yield Finding((*path, index, "time"), words)


def check_defined(scenario: Scenario, path: Path, components: tuple[Component, ...]) -> Iterator[Finding]:
    """Functions of time have finite values and derivatives through the whole run."""
    for axis, component in enumerate(components):
        if words := _undefined(component, scenario.duration):
            yield Finding((*path, axis), words)


@lru_cache(maxsize=1024)  # the missions of a study share most of them
def _undefined(component: Component, duration: float) -> str:
    """What is wrong with a function of time; empty if nothing is."""
    t = np.linspace(0.0, duration, SAMPLES)
    for what, values in zip(("value", "time derivative"), Expression(component).evaluate(t), strict=True):
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            return f"has no finite {what} at t = {t[wrong[0]]:g} s; expected one from 0 to {duration:g} s"
        large = np.flatnonzero(np.abs(values) > LARGEST)
        if len(large):
            at = large[0]
            return f"has the {what} {values[at]:.3g} at t = {t[at]:g} s; expected at most {LARGEST:g}"
    return ""
