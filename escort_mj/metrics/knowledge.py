"""How well robots know the target, and how messages reach them, where robots know by themselves."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.graphs import algebraic_connectivity, components, of_graphs, takes_long
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import ALL_LOST, NO_TARGET, escorts, lost, name_robots
from escort_mj.metrics.watching import Course, Fold, Watch, mean_of, nothing, simple, watched, worst_of
from escort_mj.record.recording import Recorded, lacks

Array = NDArray[np.float64]

ALL_KNOW = "all robots know what the team's sensors show"
NO_RADIO = "robots do not communicate"
NO_COVARIANCE = "the estimator does not say how sure it is"


def estimate_error(trace: Recorded) -> Array:
    """Distance of each robot's estimate from the target, shape (time, robot) [m]; NaN where it is lost."""
    off = trace["target_estimate"].values - trace["target_position"].values[:, None]
    return np.where(lost(trace), np.nan, np.linalg.norm(off, axis=2))


def parts(trace: Recorded) -> Array:
    """Number of parts of the graph of who hears whom, among robots that are left, shape (time,)."""
    return of_graphs(trace, components)


def _connectivity(trace: Recorded) -> Array:
    """Second-smallest eigenvalue of each graph's Laplacian, shape (time, 1); NaN of fewer than two robots."""
    if lacks(trace, "heard_from"):
        return nothing(trace.sizes["time"])
    return of_graphs(trace, algebraic_connectivity)[:, None]


def _nothing(trace: Recorded) -> Measure | None:
    """Why there are no estimates of a target; None where there are."""
    if lacks(trace, "target_estimate"):
        return Measure(None, reason=ALL_KNOW)
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    return Measure(None, reason=ALL_LOST) if lost(trace).all() else None


def _square_error(trace: Recorded) -> Array:
    if lacks(trace, "target_estimate"):
        return nothing(trace.sizes["time"])
    return estimate_error(trace) ** 2


def _disagreement(trace: Recorded) -> Array:
    """Distance of each robot's estimate from the mean of all, shape (time, robot) [m]."""
    if lacks(trace, "target_estimate"):
        return nothing(trace.sizes["time"])
    estimate, left = trace["target_estimate"].values, ~lost(trace)[..., None]
    middle = (
        np.where(left, estimate, 0.0).sum(axis=1, keepdims=True) / np.maximum(left.sum(axis=1), 1)[:, None]
    )
    return np.where(left[..., 0], np.linalg.norm(estimate - middle, axis=2), np.nan)


def _age(trace: Recorded) -> Array:
    if lacks(trace, "information_age"):
        return nothing(trace.sizes["time"])
    return np.where(lost(trace), np.nan, trace["information_age"].values)


def _normalized(trace: Recorded) -> Array:
    """Squared error of each estimate by its covariance, per axis, shape (time, robot); NaN if not known."""
    if lacks(trace, "target_covariance"):
        return nothing(trace.sizes["time"])
    off = trace["target_estimate"].values - trace["target_position"].values[:, None]
    covariance = trace["target_covariance"].values
    known = ~lost(trace) & (np.trace(covariance, axis1=2, axis2=3) > 0.0)
    found = np.full(known.shape, np.nan)
    solved = np.linalg.solve(covariance[known], off[known][..., None])[..., 0]
    found[known] = (off[known] * solved).sum(axis=1) / off.shape[2]
    return found


def _apart(trace: Recorded) -> Array:
    """Whether the graph is in parts, shape (time, 1)."""
    if lacks(trace, "heard_from"):
        return nothing(trace.sizes["time"])
    return np.asarray(parts(trace) > 1, float)[:, None]


ESTIMATES = ("target_estimate", "target_position", "lost")
SQUARE_ERROR = Watch(
    Course("estimate_error_squared", ESTIMATES, simple(_square_error), name_robots), Fold.MEAN
)
DISAGREEMENT = Watch(Course("disagreement", ESTIMATES, simple(_disagreement), name_robots), Fold.LARGEST)
AGE = Watch(Course("information_age", ("information_age", "lost"), simple(_age), name_robots), Fold.LARGEST)
NORMALIZED = Watch(
    Course("estimate_consistency", (*ESTIMATES, "target_covariance"), simple(_normalized), name_robots),
    Fold.MEAN,
)
CONNECTIVITY = Watch(Course("connectivity", ("heard_from", "lost"), simple(_connectivity)), Fold.LEAST)
APART = Watch(Course("disconnected", ("heard_from", "lost"), simple(_apart)), Fold.MEAN)

_of_beliefs = partial(metric, over="tail", watched=False, of_team=True, needs=("beliefs",))


@_of_beliefs(unit="m", grows=True, rank=50, watches=(SQUARE_ERROR,))
def estimate_error_rms(trace: Recorded) -> Measure:
    """Root mean square of the distance between the robots' estimates of the target and the target."""
    return _nothing(trace) or Measure(math.sqrt(mean_of(trace, SQUARE_ERROR)))


@_of_beliefs(unit="m", grows=True, rank=51, watches=(DISAGREEMENT,))
def disagreement_max(trace: Recorded) -> Measure:
    """Largest distance of a robot's estimate of the target from the mean of all estimates."""
    return _nothing(trace) or worst_of(trace, DISAGREEMENT)


@_of_beliefs(unit="s", grows=True, rank=52, watches=(AGE,))
def information_age_max(trace: Recorded) -> Measure:
    """Largest age of the newest measurement of the target that a robot knows of."""
    return _nothing(trace) or worst_of(trace, AGE)


@_of_beliefs(unit="1", rank=53, watches=(NORMALIZED,))
def estimate_consistency(trace: Recorded) -> Measure:
    """Mean normalized estimation error squared (NEES) of the position, per axis; 1 if consistent."""
    if nothing_there := _nothing(trace):
        return nothing_there
    covariance, left = trace["target_covariance"].values, ~lost(trace)
    if not (np.trace(covariance, axis1=2, axis2=3)[left] > 0.0).all():
        return Measure(None, reason=NO_COVARIANCE)
    return Measure(mean_of(trace, NORMALIZED))


@metric(unit="1/s", watched=False, rank=54, every_step=True, needs=("messages",))
def message_rate(trace: Recorded) -> Measure:
    """Messages sent per second, mean over robots."""
    return _per_second(trace, "messages_sent")


@metric(unit="1", most=1.0, watched=False, rank=55, every_step=True, needs=("messages",))
def messages_lost_share(trace: Recorded) -> Measure:
    """Share of messages that are lost on the way to robots in range."""
    if lacks(trace, "messages_lost"):
        return Measure(None, reason=NO_RADIO)
    gone, heard = (
        np.ptp(trace[name].values[[0, -1]].sum(axis=1)) for name in ("messages_lost", "messages_heard")
    )
    return Measure(float(gone / max(gone + heard, 1.0)))


@metric(
    unit="1",
    watched=False,
    more_is_better=True,
    dear=takes_long,
    rank=56,
    of_team=True,
    watches=(CONNECTIVITY,),
    needs=("messages",),
)
def connectivity_min(trace: Recorded) -> Measure:
    """Minimum second-smallest eigenvalue of the communication graph's Laplacian; 0 if ever disconnected."""
    if lacks(trace, "heard_from"):
        return Measure(None, reason=NO_RADIO)
    if ((~lost(trace)).sum(axis=1) < 2).all():
        return Measure(None, reason="there are no two robots")
    return worst_of(trace, CONNECTIVITY)


@metric(unit="s", watched=False, rank=57, of_team=True, watches=(APART,), needs=("messages",))
def disconnected_time(trace: Recorded) -> Measure:
    """Time during which the communication graph is disconnected."""
    if lacks(trace, "heard_from"):
        return Measure(None, reason=NO_RADIO)
    between = watched(trace, APART)
    if between is not None:
        return Measure(float(between.value.sum() * trace.attrs["timestep"]))
    time, apart = trace["time"].values, parts(trace) > 1
    return Measure(float(np.sum(np.diff(time) * apart[:-1])))


def _per_second(trace: Recorded, name: str) -> Measure:
    """What a running total of each robot adds per second, mean over robots."""
    if lacks(trace, name):
        return Measure(None, reason=NO_RADIO)
    count, time = trace[name].values, trace["time"].values
    return Measure(float((count[-1] - count[0]).mean() / max(time[-1] - time[0], 1e-300)))
