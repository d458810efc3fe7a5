"""How near robots come to obstacles and to each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from escort_mj.metrics.metric import Measure, metric
from escort_mj.metrics.reading import ALONE, least_of, manner_of, robot
from escort_mj.record.recording import require_places

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded

UNOBSTRUCTED = "there are no obstacles"


def _clearance(trace: Recorded, groups: Sequence[str], reason: str) -> Measure:
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
    return Measure(least, float(trace["time"][row]), who, manner=manner_of(trace, least, who))


@metric(unit="m", least=-math.inf, watched=False, more_is_better=True, rank=130)
def obstacle_distance_min(trace: Recorded) -> Measure:
    """Minimum distance of a robot's center to an obstacle: a sphere's center, or another shape's surface."""
    if not trace.sizes["obstacle"]:
        return Measure(None, reason=UNOBSTRUCTED)
    distances = trace["obstacle_distance"].values
    names, count = trace["obstacle"].values, trace.sizes["obstacle"]
    flat = distances.reshape(len(distances), -1)
    return least_of(trace, flat, lambda index: (*robot(index // count), str(names[index % count])))


@metric(unit="m", least=-math.inf, more_is_better=True, rank=140, every_step=True)
def obstacle_clearance_min(trace: Recorded) -> Measure:
    """Minimum distance between a robot and an obstacle or wall, surface to surface."""
    return _clearance(trace, ("obstacles", "walls"), UNOBSTRUCTED)


@metric(unit="m", watched=False, more_is_better=True, rank=150)
def robot_distance_min(trace: Recorded) -> Measure:
    """Minimum distance between two robots, center to center."""
    name = "robot_distance_min"
    return least_of(trace, trace[name].values, robot) if name in trace else Measure(None, reason=ALONE)


@metric(unit="m", least=-math.inf, more_is_better=True, rank=160, every_step=True)
def robot_clearance_min(trace: Recorded) -> Measure:
    """Minimum distance between two robots, surface to surface."""
    return _clearance(trace, ("robots",), ALONE)
