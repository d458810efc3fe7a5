"""How far robots are from where they are to be around the target: at the radius of that time."""

from __future__ import annotations

import numpy as np

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import ALL_LOST, NO_TARGET, escorts, lost, name_robots
from escort_mj.metrics.watching import Course, Fold, Watch, last_of, mean_of, simple, worst_of
from escort_mj.record.recording import Recorded
from escort_mj.record.team import kept_radius

SETTLED = 0.05  # of the radius
SIGNALS = ("q", "target_position", "lost", "kept_radius")


def radius_error(trace: Recorded) -> np.ndarray:
    """Signed | q - c | - radius, shape (time, robot) [m]; NaN where a robot is lost."""
    offset = trace["q"].values - trace["target_position"].values[:, None]
    return np.where(lost(trace), np.nan, np.linalg.norm(offset, axis=2) - kept_radius(trace))


def _absolute(trace: Recorded) -> np.ndarray:
    return np.abs(radius_error(trace))


def _unsettled(trace: Recorded) -> np.ndarray:
    return np.asarray(_absolute(trace) > SETTLED * kept_radius(trace), float)


RADIUS_ERROR = Course("radius_error", SIGNALS, simple(_absolute), name_robots)
LARGEST, MEAN = Watch(RADIUS_ERROR, Fold.LARGEST), Watch(RADIUS_ERROR, Fold.MEAN)
UNSETTLED = Watch(Course("unsettled", SIGNALS, simple(_unsettled), name_robots), Fold.LAST)


def _nothing(trace: Recorded) -> Measure | None:
    """Why there is no radius error; None where there is one."""
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    return Measure(None, reason=ALL_LOST) if lost(trace).all() else None


@metric(unit="m", over="tail", watched=False, rank=10, of_team=True, watches=(MEAN,))
def radius_error_mean(trace: Recorded) -> Measure:
    """Mean over time and robots of | |q - c| - radius |."""
    return _nothing(trace) or Measure(mean_of(trace, MEAN))


@metric(unit="m", over="tail", grows=True, watched=False, rank=20, of_team=True, watches=(LARGEST,))
def radius_error_max(trace: Recorded) -> Measure:
    """Largest | |q - c| - radius |."""
    return _nothing(trace) or worst_of(trace, LARGEST)


@metric(unit="s", watched=False, rank=30, of_team=True, moment=True, watches=(UNSETTLED,))
def settling_time(trace: Recorded) -> Measure:
    """Time after which every robot stays within 5 % of the radius."""
    return _nothing(trace) or last_of(trace, UNSETTLED).measure("never settles")
