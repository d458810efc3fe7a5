"""How far robots are from where they are to be around the target: at the mission's radius."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from escort_mj.metrics.metric import Measure, metric
from escort_mj.metrics.reading import ALL_LOST, NO_TARGET, escorts, largest_of, lost, mean, robot
from escort_mj.record.team import kept_radius

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded

SETTLED = 0.05  # of the radius


def radius_error(trace: Recorded) -> np.ndarray:
    """Signed | q - c | - radius, shape (time, robot) [m]; NaN where a robot is lost."""
    offset = trace["q"].values - trace["target_position"].values[:, None]
    return np.where(lost(trace), np.nan, np.linalg.norm(offset, axis=2) - kept_radius(trace)[:, None])


def _nothing(trace: Recorded) -> Measure | None:
    """Why there is no radius error; None where there is one."""
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    return Measure(None, reason=ALL_LOST) if lost(trace).all() else None


@metric(unit="m", over="tail", watched=False, rank=10, of_team=True)
def radius_error_mean(trace: Recorded) -> Measure:
    """Mean over time and robots of | |q - c| - radius |."""
    return _nothing(trace) or Measure(mean(trace, np.abs(radius_error(trace))))


@metric(unit="m", over="tail", grows=True, watched=False, rank=20, of_team=True)
def radius_error_max(trace: Recorded) -> Measure:
    """Largest | |q - c| - radius |."""
    return _nothing(trace) or largest_of(trace, np.abs(radius_error(trace)), robot)


@metric(unit="s", watched=False, rank=30, of_team=True, moment=True)
def settling_time(trace: Recorded) -> Measure:
    """Time after which every robot stays within 5 % of the radius."""
    if nothing := _nothing(trace):
        return nothing
    outside = np.abs(radius_error(trace)) > SETTLED * kept_radius(trace)[:, None]
    late = np.flatnonzero(outside.any(axis=1))
    if not len(late):
        return Measure(float(trace["time"][0]))
    last = int(late[-1])
    who = robot(int(np.argmax(outside[last])))
    if last == trace.sizes["time"] - 1:
        return Measure(math.inf, float(trace["time"][last]), who, "never settles")
    return Measure(float(trace["time"][last + 1]), float(trace["time"][last]), who)
