"""How well robots know the target, and how messages reach them, where robots know by themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.metric import Measure, metric
from escort_mj.metrics.reading import ALL_LOST, NO_TARGET, escorts, largest_of, lost, robot
from escort_mj.record.recording import lacks

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded

Array = NDArray[np.float64]

ALL_KNOW = "all robots know what the team's sensors show"
NO_RADIO = "robots do not communicate"
NO_COVARIANCE = "the estimator does not say how sure it is"
DEAR = 2_000_000  # entries of the graphs of all samples: their eigenvalues take a second
CUT = 1e-9  # a smaller second eigenvalue is that of a graph in parts


def estimate_error(trace: Recorded) -> Array:
    """Distance of each robot's estimate from the target, shape (time, robot) [m]; NaN where it is lost."""
    off = trace["target_estimate"].values - trace["target_position"].values[:, None]
    return np.where(lost(trace), np.nan, np.linalg.norm(off, axis=2))


def linked(heard: NDArray[Any]) -> NDArray[np.bool_]:
    """Who is linked with whom, because one of the two has heard the other, shape (robot, robot).

    Args:
        heard: The signal `heard_from` at a sample, shape (robot, slot).
    """
    n = len(heard)
    found = np.zeros((n, n + 1), dtype=bool)
    found[np.arange(n)[:, None], heard.astype(int)] = True
    return np.asarray(found[:, 1:] | found[:, 1:].T)


def parts(trace: Recorded) -> NDArray[np.int64]:
    """Number of parts of the graph of who hears whom, among robots that are left, shape (time,)."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    heard, gone = trace["heard_from"].values, lost(trace)
    changes = (heard[1:] != heard[:-1]).any(axis=(1, 2)) | (gone[1:] != gone[:-1]).any(axis=1)
    first = np.flatnonzero(np.append(True, changes))  # samples of a graph that was not there before
    found = []
    for row in first:
        left = linked(heard[row])[~gone[row]][:, ~gone[row]]
        found.append(connected_components(csr_array(left), directed=False)[0] if len(left) else 0)
    return np.repeat(found, np.diff(np.append(first, len(heard))))


def _takes_long(trace: Recorded) -> bool:
    """Whether there are too many robots and samples for the eigenvalues of every run."""
    return bool(trace.sizes["time"] * trace.sizes["robot"] ** 2 > DEAR)


def _nothing(trace: Recorded) -> Measure | None:
    """Why there are no estimates of a target; None where there are."""
    if lacks(trace, "target_estimate"):
        return Measure(None, reason=ALL_KNOW)
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    return Measure(None, reason=ALL_LOST) if lost(trace).all() else None


@metric(unit="m", over="tail", grows=True, watched=False, rank=50, of_team=True)
def estimate_error_rms(trace: Recorded) -> Measure:
    """Root mean square of the distance between the robots' estimates of the target and the target."""
    if nothing := _nothing(trace):
        return nothing
    return Measure(float(np.sqrt(np.nanmean(estimate_error(trace) ** 2))))


@metric(unit="m", over="tail", grows=True, watched=False, rank=51, of_team=True)
def disagreement_max(trace: Recorded) -> Measure:
    """Largest distance of a robot's estimate of the target from the mean of all estimates."""
    if nothing := _nothing(trace):
        return nothing
    estimate, left = trace["target_estimate"].values, ~lost(trace)[..., None]
    middle = (
        np.where(left, estimate, 0.0).sum(axis=1, keepdims=True) / np.maximum(left.sum(axis=1), 1)[:, None]
    )
    off = np.where(left[..., 0], np.linalg.norm(estimate - middle, axis=2), np.nan)
    return largest_of(trace, off, robot)


@metric(unit="s", over="tail", grows=True, watched=False, rank=52, of_team=True)
def information_age_max(trace: Recorded) -> Measure:
    """Largest age of the newest measurement of the target that a robot knows of."""
    if nothing := _nothing(trace):
        return nothing
    age = np.where(lost(trace), np.nan, trace["information_age"].values)
    return largest_of(trace, age, robot)


@metric(unit="1", over="tail", watched=False, rank=53, of_team=True)
def estimate_consistency(trace: Recorded) -> Measure:
    """Mean normalized estimation error squared (NEES) of the position, per axis; 1 if consistent."""
    if nothing := _nothing(trace):
        return nothing
    off = trace["target_estimate"].values - trace["target_position"].values[:, None]
    covariance, left = trace["target_covariance"].values, ~lost(trace)
    if not (np.trace(covariance, axis1=2, axis2=3)[left] > 0.0).all():
        return Measure(None, reason=NO_COVARIANCE)
    solved = np.linalg.solve(covariance[left], off[left][..., None])[..., 0]
    return Measure(float((off[left] * solved).sum(axis=1).mean() / off.shape[2]))


@metric(unit="1/s", watched=False, rank=54, every_step=True)
def message_rate(trace: Recorded) -> Measure:
    """Messages sent per second, mean over robots."""
    return _per_second(trace, "messages_sent")


@metric(unit="1", most=1.0, watched=False, rank=55, every_step=True)
def messages_lost_share(trace: Recorded) -> Measure:
    """Share of messages that are lost on the way to robots in range."""
    if lacks(trace, "messages_lost"):
        return Measure(None, reason=NO_RADIO)
    gone, heard = (
        np.ptp(trace[name].values[[0, -1]].sum(axis=1)) for name in ("messages_lost", "messages_heard")
    )
    return Measure(float(gone / max(gone + heard, 1.0)))


@metric(unit="1", watched=False, more_is_better=True, dear=_takes_long, rank=56, of_team=True)
def connectivity_min(trace: Recorded) -> Measure:
    """Minimum second-smallest eigenvalue of the communication graph's Laplacian; 0 if ever disconnected."""
    if lacks(trace, "heard_from"):
        return Measure(None, reason=NO_RADIO)
    gone, lowest, when = lost(trace), np.inf, 0
    for row, (heard, absent) in enumerate(zip(trace["heard_from"].values, gone, strict=True)):
        left = linked(heard)[~absent][:, ~absent].astype(float)
        if len(left) < 2:
            continue
        second = np.linalg.eigvalsh(np.diag(left.sum(axis=1)) - left)[1]
        if second < lowest:
            lowest, when = (second if second > CUT else 0.0), row
    if lowest == np.inf:
        return Measure(None, reason="there are no two robots")
    return Measure(float(lowest), float(trace["time"][when]))


@metric(unit="s", watched=False, rank=57, of_team=True)
def disconnected_time(trace: Recorded) -> Measure:
    """Time during which the communication graph is disconnected."""
    if lacks(trace, "heard_from"):
        return Measure(None, reason=NO_RADIO)
    time, apart = trace["time"].values, parts(trace) > 1
    return Measure(float(np.sum(np.diff(time) * apart[:-1])))


def _per_second(trace: Recorded, name: str) -> Measure:
    """What a running total of each robot adds per second, mean over robots."""
    if lacks(trace, name):
        return Measure(None, reason=NO_RADIO)
    count, time = trace[name].values, trace["time"].values
    return Measure(float((count[-1] - count[0]).mean() / max(time[-1] - time[0], 1e-300)))
