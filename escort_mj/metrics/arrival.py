"""Whether and when robots come to their goals, and how far they go.

A robot whose motors have failed still has its goal: it is there where it stands there, and nowhere else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import name_robots, robots
from escort_mj.metrics.watching import Course, Fold, Watch, last_of, nothing, simple, worst_of
from escort_mj.record.recording import Recorded, lacks

NO_GOALS = "robots have no goals"
SIGNALS = ("q", "goal", "goals_left")


def goal_distance(trace: Recorded) -> NDArray[np.float64]:
    """| q - goal |, shape (time, robot) [m]; NaN where robots have no goals."""
    if lacks(trace, "goal"):
        return nothing(trace.sizes["time"])
    return np.asarray(np.linalg.norm(trace["q"].values - trace["goal"].values, axis=2))


def way_left(trace: Recorded) -> NDArray[np.float64]:
    """Distance to the last goal, infinite while there are waypoints before it, shape (time, robot) [m]."""
    if lacks(trace, "goal"):
        return nothing(trace.sizes["time"])
    return np.where(trace["goals_left"].values == 0, goal_distance(trace), np.inf)


def away(trace: Recorded) -> NDArray[np.float64]:
    """1 where a robot is not within `reach` of its last goal, else 0, shape (time, robot)."""
    return np.asarray(way_left(trace) > trace.attrs["goal_reach"], float)


GOAL_DISTANCE = Watch(Course("goal_distance", SIGNALS, simple(goal_distance), name_robots), Fold.LARGEST)
WAY_LEFT = Course("way_left", SIGNALS, simple(way_left), name_robots)
AWAY = Watch(Course("away", SIGNALS, simple(away), name_robots), Fold.LAST)


@metric(unit="m", over="tail", grows=True, watched=False, rank=31, watches=(GOAL_DISTANCE,))
def goal_distance_max(trace: Recorded) -> Measure:
    """Largest distance of a robot from its goal."""
    return worst_of(trace, GOAL_DISTANCE) if not lacks(trace, "goal") else Measure(None, reason=NO_GOALS)


@metric(unit="s", watched=False, rank=32, moment=True, watches=(AWAY,))
def arrival_time(trace: Recorded) -> Measure:
    """Time after which every robot stays within `reach` of its last goal (the makespan)."""
    if lacks(trace, "goal"):
        return Measure(None, reason=NO_GOALS)
    return last_of(trace, AWAY).measure("never arrives")


@metric(unit="1", most=1.0, watched=False, more_is_better=True, rank=33, every_step=True)
def arrived(trace: Recorded) -> Measure:
    """Share of the robots that are within `reach` of their last goals at the end."""
    if lacks(trace, "goal"):
        return Measure(None, reason=NO_GOALS)
    there = away(trace)[-1] == 0.0
    return Measure(float(there.mean()), float(trace["time"][-1]), robots(np.flatnonzero(~there)))


@metric(unit="m", grows=True, watched=False, rank=34)
def path_length(trace: Recorded) -> Measure:
    """Mean length of the robots' paths, taken as straight between samples."""
    return Measure(float(np.linalg.norm(np.diff(trace["q"].values, axis=0), axis=2).sum(axis=0).mean()))
