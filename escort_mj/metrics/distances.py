"""How near robots come to obstacles and to each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from escort_mj.metrics.measure import Bodies, Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import ALONE, manner_of, name_robots, robot
from escort_mj.metrics.watching import Course, Fold, Watch, nothing, simple, to_the_step, worst_of
from escort_mj.record.recording import Recorded, require_places

UNOBSTRUCTED = "there are no obstacles"


def _watch(*groups: str) -> Watch:
    """What is asked to know when clearances to some groups were least."""

    def values(trace: Recorded) -> np.ndarray:
        columns = np.isin(trace["group"].values, groups)
        return trace["clearance"].values[:, :, columns].reshape(trace.sizes["time"], -1)

    return Watch(Course(f"clearance {'/'.join(groups)}", ("clearance",), simple(values)), Fold.LEAST)


OBSTACLES, ROBOTS = _watch("obstacles", "walls"), _watch("robots")


def _clearance(trace: Recorded, groups: Sequence[str], watch: Watch, reason: str) -> Measure:
    """Least clearance of robots to some groups, watched at every physics step."""
    require_places(trace, np.isin(trace["body_group"].values, groups))
    columns = np.isin(trace["group"].values, groups)
    values = trace["clearance"].values[:, :, columns]
    if not np.isfinite(values).any():
        return Measure(None, reason=reason)
    nearest = trace["clearance_body"].values[:, :, columns]
    row, which, column = np.unravel_index(np.argmin(values), values.shape)
    who = (*robot(int(which)), str(trace["body"].values[nearest[row, which, column]]))
    least = float(values[row, which, column])
    found = Measure(least, float(trace["time"][row]), who, manner=manner_of(trace, least, who))
    return to_the_step(trace, watch, found)


def _pairs(trace: Recorded) -> Callable[[int], Bodies]:
    names, count = trace["obstacle"].values, trace.sizes["obstacle"]
    return lambda index: (*robot(index // count), str(names[index % count]))


def _to_obstacles(trace: Recorded) -> np.ndarray:
    return trace["obstacle_distance"].values.reshape(trace.sizes["time"], -1)


def _to_robots(trace: Recorded) -> np.ndarray:
    name = "robot_distance_min"
    return trace[name].values if name in trace else nothing(trace.sizes["time"])


TO_OBSTACLES = Watch(
    Course("obstacle_distance", ("obstacle_distance",), simple(_to_obstacles), _pairs), Fold.LEAST
)
TO_ROBOTS = Watch(
    Course("robot_distance", ("robot_distance_min",), simple(_to_robots), name_robots), Fold.LEAST
)


@metric(unit="m", least=-math.inf, watched=False, more_is_better=True, rank=130, watches=(TO_OBSTACLES,))
def obstacle_distance_min(trace: Recorded) -> Measure:
    """Minimum distance of a robot's center to an obstacle: a sphere's center, or another shape's surface."""
    return worst_of(trace, TO_OBSTACLES) if trace.sizes["obstacle"] else Measure(None, reason=UNOBSTRUCTED)


@metric(unit="m", least=-math.inf, more_is_better=True, rank=140, every_step=True, watches=(OBSTACLES,))
def obstacle_clearance_min(trace: Recorded) -> Measure:
    """Minimum distance between a robot and an obstacle or wall, surface to surface."""
    return _clearance(trace, ("obstacles", "walls"), OBSTACLES, UNOBSTRUCTED)


@metric(unit="m", watched=False, more_is_better=True, rank=150, watches=(TO_ROBOTS,))
def robot_distance_min(trace: Recorded) -> Measure:
    """Minimum distance between two robots, center to center."""
    return worst_of(trace, TO_ROBOTS) if "robot_distance_min" in trace else Measure(None, reason=ALONE)


@metric(unit="m", least=-math.inf, more_is_better=True, rank=160, every_step=True, watches=(ROBOTS,))
def robot_clearance_min(trace: Recorded) -> Measure:
    """Minimum distance between two robots, surface to surface."""
    return _clearance(trace, ("robots",), ROBOTS, ALONE)
