"""How well robots follow their references."""

from __future__ import annotations

import math

import numpy as np

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import ALL_LOST, lost, name_robots
from escort_mj.metrics.watching import Course, Fold, Watch, mean_of, simple
from escort_mj.record.recording import Recorded


def _watch(name: str) -> Watch:
    """What is asked of a vector whose root mean square is wanted: its squared length."""

    def square(trace: Recorded) -> np.ndarray:
        return np.where(lost(trace), np.nan, (trace[name].values ** 2).sum(axis=2))

    return Watch(Course(f"{name}_squared", (name, "lost"), simple(square), name_robots), Fold.MEAN)


ERROR, VELOCITY_ERROR = _watch("e"), _watch("e_dot")


def _rms(trace: Recorded, watch: Watch) -> Measure:
    """Root mean square of a vector's length over time and robots."""
    if lost(trace).all():
        return Measure(None, reason=ALL_LOST)
    return Measure(math.sqrt(mean_of(trace, watch)))


@metric(unit="m", over="tail", watched=False, rank=70, watches=(ERROR,))
def tracking_error_rms(trace: Recorded) -> Measure:
    """Root mean square of |e|."""
    return _rms(trace, ERROR)


@metric(unit="m/s", over="tail", watched=False, rank=80, watches=(VELOCITY_ERROR,))
def velocity_error_rms(trace: Recorded) -> Measure:
    """Root mean square of |e_dot|."""
    return _rms(trace, VELOCITY_ERROR)
