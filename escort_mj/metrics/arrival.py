"""Whether and when robots come to their goals, how far they go, and who is stuck on the way."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.metric import Measure, metric
from escort_mj.metrics.reading import largest_of, lost, robot, robots
from escort_mj.record.recording import lacks

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded

NO_GOALS = "robots have no goals"
STUCK_FOR = 5.0  # s


def goal_distance(trace: Recorded) -> NDArray[np.float64]:
    """| q - goal |, shape (time, robot) [m]; NaN where a robot is lost, or has no goal."""
    if lacks(trace, "goal"):
        return np.full(trace["lost"].values.shape, np.nan)
    distance = np.linalg.norm(trace["q"].values - trace["goal"].values, axis=2)
    return np.where(lost(trace), np.nan, distance)


def at_goal(trace: Recorded, reach: float) -> NDArray[np.bool_]:
    """Who is within a distance of the last goal, or lost, shape (time, robot)."""
    there = (trace["goals_left"].values == 0) & (goal_distance(trace) <= reach)
    return np.asarray(there | lost(trace))


@metric(unit="m", over="tail", grows=True, watched=False, rank=31)
def goal_distance_max(trace: Recorded) -> Measure:
    """Largest distance of a robot from its goal."""
    distance = goal_distance(trace)
    if np.isnan(distance).all():
        return Measure(None, reason=NO_GOALS)
    return largest_of(trace, distance, robot)


@metric(unit="s", watched=False, rank=32, moment=True)
def arrival_time(trace: Recorded) -> Measure:
    """Time after which every robot stays within `reach` of its last goal (the makespan)."""
    if lacks(trace, "goal"):
        return Measure(None, reason=NO_GOALS)
    time, away = trace["time"].values, ~at_goal(trace, trace.attrs["goal_reach"])
    late = np.flatnonzero(away.any(axis=1))
    if not len(late):
        return Measure(float(time[0]))
    last = int(late[-1])
    who = robots(np.flatnonzero(away[last]))
    if last == len(time) - 1:
        return Measure(math.inf, float(time[last]), who, "never arrives")
    return Measure(float(time[last + 1]), float(time[last + 1]), who)


@metric(unit="1", most=1.0, watched=False, more_is_better=True, rank=33)
def arrived(trace: Recorded) -> Measure:
    """Share of the robots that are within `reach` of their last goals at the end."""
    if lacks(trace, "goal"):
        return Measure(None, reason=NO_GOALS)
    there = at_goal(trace, trace.attrs["goal_reach"])[-1] & ~lost(trace)[-1]
    return Measure(float(there.mean()), float(trace["time"][-1]), robots(np.flatnonzero(~there)))


@metric(unit="m", grows=True, watched=False, rank=34)
def path_length(trace: Recorded) -> Measure:
    """Mean length of the robots' paths, taken as straight between samples."""
    return Measure(float(np.linalg.norm(np.diff(trace["q"].values, axis=0), axis=2).sum(axis=0).mean()))


@metric(unit="1", watched=False, rank=35)
def stuck(trace: Recorded) -> Measure:
    """Number of robots that end away from their goals and move by at most their radius in the last 5 s."""
    if lacks(trace, "goal"):
        return Measure(None, reason=NO_GOALS)
    time = trace["time"].values
    if time[-1] - time[0] < STUCK_FOR - 0.5 * trace.attrs["timestep"]:
        return Measure(None, reason=f"the window is shorter than {STUCK_FOR:g} s")
    late = time >= time[-1] - STUCK_FOR - 0.5 * trace.attrs["timestep"]
    q = trace["q"].values[late]
    here = np.linalg.norm(q - q[-1], axis=2).max(axis=0) <= trace["robot_radius"].values
    waiting = np.flatnonzero(here & ~at_goal(trace, trace.attrs["goal_reach"])[-1])
    return Measure(float(len(waiting)), float(time[-1]), robots(waiting))
