"""Whether and when robots come to their goals, and how far they go.

A robot whose motors have failed still has its goal: it is there where it stands there, and nowhere else.

Two measures set a robot's way against the straight one: from its first place through the waypoints that it
passes to its last goal. Obstacles are not looked at; around them, every way is longer.

`extra_time_to_goal` is that of Everett, Chen, How: Collision avoidance in pedestrian-rich environments with
deep reinforcement learning, IEEE Access 9, 2021 (arXiv 1910.11689), and of gym-collision-avoidance;
`success_by_path_length` is SPL of Anderson et al.: On evaluation of embodied navigation agents, 2018 (arXiv
1807.06757).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import name_robots, robots
from escort_mj.metrics.watching import Course, Fold, Watch, last_of, nothing, simple, worst_of
from escort_mj.record.recording import Recorded, lacks

NO_GOALS = "robots have no goals"
NO_LIMIT = "there is no speed limit (mission.max_speed)"
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


def _stays_from(trace: Recorded) -> NDArray[np.intp]:
    """First sample from which on each robot stays within `reach` of its last goal, shape (robot,).

    The number of samples where it is away at the end.
    """
    far = away(trace) > 0.0
    return np.where(far.any(axis=0), len(far) - np.argmax(far[::-1], axis=0), 0)


def _straight(trace: Recorded) -> NDArray[np.float64]:
    """Length of each robot's way if straight from its first place to its goals, shape (robot,) [m]."""
    q, goal, left = (trace[name].values for name in ("q", "goal", "goals_left"))
    passed = np.append(left[1:] < left[:-1], np.ones((1, left.shape[1]), dtype=bool), axis=0)
    ways = [np.vstack([q[0, i], goal[passed[:, i], i]]) for i in range(q.shape[1])]
    return np.array([np.linalg.norm(np.diff(way, axis=0), axis=1).sum() for way in ways])


GOAL_DISTANCE = Watch(Course("goal_distance", SIGNALS, simple(goal_distance), name_robots), Fold.LARGEST)
WAY_LEFT = Course("way_left", SIGNALS, simple(way_left), name_robots)
AWAY = Watch(Course("away", SIGNALS, simple(away), name_robots), Fold.LAST)


@metric(unit="m", over="tail", grows=True, watched=False, rank=31, watches=(GOAL_DISTANCE,), needs=("goals",))
def goal_distance_max(trace: Recorded) -> Measure:
    """Largest distance of a robot from its goal."""
    return worst_of(trace, GOAL_DISTANCE) if not lacks(trace, "goal") else Measure(None, reason=NO_GOALS)


@metric(unit="s", watched=False, rank=32, moment=True, watches=(AWAY,), needs=("goals",))
def arrival_time(trace: Recorded) -> Measure:
    """Time after which every robot stays within `reach` of its last goal (the makespan)."""
    if lacks(trace, "goal"):
        return Measure(None, reason=NO_GOALS)
    return last_of(trace, AWAY).measure("never arrives")


@metric(unit="1", most=1.0, watched=False, more_is_better=True, rank=33, every_step=True, needs=("goals",))
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


@metric(unit="s", least=-math.inf, watched=False, rank=36, needs=("goals", "max_speed"))
def extra_time_to_goal(trace: Recorded) -> Measure:
    """Mean over robots of the time until each stays at its last goal, less that straight at the speed limit.

    At its goal is who is within `reach` of it; infinite if a robot is not at the end.
    """
    if lacks(trace, "goal"):
        return Measure(None, reason=NO_GOALS)
    if "max_speed" not in trace.attrs:
        return Measure(None, reason=NO_LIMIT)
    time, row = trace["time"].values, _stays_from(trace)
    if (never := np.flatnonzero(row == len(time))).size:
        return Measure(math.inf, float(time[-1]), robots(never), "never arrives")
    way = np.maximum(_straight(trace) - float(trace.attrs["goal_reach"]), 0.0)
    return Measure(float((time[row] - time[0] - way / float(trace.attrs["max_speed"])).mean()))


@metric(unit="1", most=1.0, watched=False, more_is_better=True, rank=37, needs=("goals",))
def success_by_path_length(trace: Recorded) -> Measure:
    """Mean over robots of straight way by way taken (at most 1), 0 for who is not at its last goal (SPL)."""
    if lacks(trace, "goal"):
        return Measure(None, reason=NO_GOALS)
    row, straight = _stays_from(trace), _straight(trace)
    legs = np.linalg.norm(np.diff(trace["q"].values, axis=0), axis=2)
    taken = np.where(np.arange(len(legs))[:, None] < row, legs, 0.0).sum(axis=0)
    longest, arrives = np.maximum(taken, straight), row < trace.sizes["time"]
    share = np.divide(straight, longest, out=np.ones_like(straight), where=longest > 0.0)
    return Measure(float(np.where(arrives, share, 0.0).mean()))
