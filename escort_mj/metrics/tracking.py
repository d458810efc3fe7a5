"""How well robots follow their references."""

from __future__ import annotations

import math

import numpy as np

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import ALL_LOST, NO_TARGET, escorts, lost, mean, name_robots
from escort_mj.metrics.watching import Course, Fold, Watch, last_of, mean_of, simple, worst_of
from escort_mj.record.recording import Recorded
from escort_mj.record.team import kept_radius

TRACKED = 0.01  # of the radius: a robot tracks its reference once |e| stays below this


def _watch(name: str) -> Watch:
    """What is asked of a vector whose root mean square is wanted: its squared length."""

    def square(trace: Recorded) -> np.ndarray:
        return np.where(lost(trace), np.nan, (trace[name].values ** 2).sum(axis=2))

    return Watch(Course(f"{name}_squared", (name, "lost"), simple(square), name_robots), Fold.MEAN)


def _size(trace: Recorded) -> np.ndarray:
    return np.where(lost(trace), np.nan, np.linalg.norm(trace["e"].values, axis=2))


def _untracked(trace: Recorded) -> np.ndarray:
    return np.asarray(_size(trace) > TRACKED * kept_radius(trace), float)


ERROR, VELOCITY_ERROR = _watch("e"), _watch("e_dot")
LARGEST = Watch(Course("error", ("e", "lost"), simple(_size), name_robots), Fold.LARGEST)
UNTRACKED = Watch(
    Course("untracked", ("e", "lost", "kept_radius"), simple(_untracked), name_robots), Fold.LAST
)


def _rms(trace: Recorded, watch: Watch) -> Measure:
    """Root mean square of a vector's length over time and robots."""
    if lost(trace).all():
        return Measure(None, reason=ALL_LOST)
    return Measure(math.sqrt(mean_of(trace, watch)))


@metric(unit="m", over="tail", watched=False, leaves_out=True, rank=70, watches=(ERROR,))
def tracking_error_rms(trace: Recorded) -> Measure:
    """Root mean square of |e|."""
    return _rms(trace, ERROR)


@metric(unit="m/s", over="tail", watched=False, leaves_out=True, rank=80, watches=(VELOCITY_ERROR,))
def velocity_error_rms(trace: Recorded) -> Measure:
    """Root mean square of |e_dot|."""
    return _rms(trace, VELOCITY_ERROR)


@metric(unit="m", grows=True, watched=False, leaves_out=True, rank=72, watches=(LARGEST,))
def tracking_error_max(trace: Recorded) -> Measure:
    """Largest |e|."""
    return Measure(None, reason=ALL_LOST) if lost(trace).all() else worst_of(trace, LARGEST)


@metric(unit="s", watched=False, rank=74, of_team=True, moment=True, watches=(UNTRACKED,))
def tracking_time(trace: Recorded) -> Measure:
    """Time after which every |e| stays within 1 % of the radius."""
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    if lost(trace).all():
        return Measure(None, reason=ALL_LOST)
    return last_of(trace, UNTRACKED).measure("never tracks")


def _true(trace: Recorded, name: str) -> np.ndarray:
    """A reference less what is true, with no noise in it: squared length, shape (time, robot)."""
    error = trace[f"{name}_d"].values - trace[name].values
    return np.where(lost(trace), np.nan, (error**2).sum(axis=2))


@metric(unit="m", over="tail", watched=False, leaves_out=True, rank=76)
def true_error_rms(trace: Recorded) -> Measure:
    """Root mean square of |q_d - q|, without measurement noise."""
    if lost(trace).all():
        return Measure(None, reason=ALL_LOST)
    return Measure(math.sqrt(mean(trace, _true(trace, "q"))))


@metric(unit="m", grows=True, watched=False, leaves_out=True, rank=78)
def true_error_max(trace: Recorded) -> Measure:
    """Largest |q_d - q|, without measurement noise."""
    if lost(trace).all():
        return Measure(None, reason=ALL_LOST)
    return Measure(math.sqrt(np.nanmax(_true(trace, "q"))))


@metric(unit="m/s", over="tail", watched=False, leaves_out=True, rank=82)
def true_velocity_error_rms(trace: Recorded) -> Measure:
    """Root mean square of |v_d - v|, without measurement noise."""
    if lost(trace).all():
        return Measure(None, reason=ALL_LOST)
    return Measure(math.sqrt(mean(trace, _true(trace, "v"))))
