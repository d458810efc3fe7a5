"""How far neighbors in a formation are from standing evenly."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from escort_mj.metrics.measure import Bodies, Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import lost
from escort_mj.metrics.watching import Course, Fold, Watch, mean_of, simple, worst_of
from escort_mj.record.recording import Recorded
from escort_mj.record.team import kept_radius

SHAPELESS = "there is no formation, or not one for the whole run"
BROKEN = "a robot was lost before, or another came: the others stand in another formation"


def spacing_error(trace: Recorded) -> np.ndarray:
    """Signed deviation of neighbors' distances from even, shape (time, edge) [m].

    Even is what the formation has at the radius of that time. NaN while robots of the formation are lost, or
    others are in it: that is another formation.
    """
    pairs, q = trace["neighbors"].values - 1, trace["q"].values
    first, second = pairs[:, 0], pairs[:, 1]
    apart = np.linalg.norm(q[:, first] - q[:, second], axis=2)
    gone = lost(trace)
    concerned = np.isin(np.arange(q.shape[1]), pairs)
    broken = gone[:, concerned].any(axis=1, keepdims=True)
    if "edge_team" in trace:  # of one team, to which those of others are lost
        broken = broken | ~gone[:, ~concerned].all(axis=1, keepdims=True)
    return np.where(broken, np.nan, apart - even_spacing(trace))


def even_spacing(trace: Recorded) -> np.ndarray:
    """Return the distances of neighbors that are even at the radius of the time, shape (time, edge) [m]."""
    pairs, radius = trace["neighbors"].values - 1, kept_radius(trace)
    scale = 0.5 * (radius[:, pairs[:, 0]] + radius[:, pairs[:, 1]]) / edge_radius(trace)
    return np.asarray(scale * trace["spacing"].values)


def edge_radius(trace: Recorded) -> np.ndarray:
    """Return the radius at which neighbors are to keep `spacing`, shape (edge,) [m]."""
    if "edge_radius" in trace:
        return trace["edge_radius"].values
    return np.full(trace.sizes["edge"], float(trace.attrs["mission_radius"]))


def _absolute(trace: Recorded) -> np.ndarray:
    return np.abs(spacing_error(trace))


def _edges(trace: Recorded) -> Callable[[int], Bodies]:
    pairs = trace["neighbors"].values
    return lambda index: (f"robot_{pairs[index, 0]}", f"robot_{pairs[index, 1]}")


SIGNALS = ("q", "target_position", "lost", "kept_radius")
SPACING_ERROR = Course("spacing_error", SIGNALS, simple(_absolute), _edges)
LARGEST, MEAN = Watch(SPACING_ERROR, Fold.LARGEST), Watch(SPACING_ERROR, Fold.MEAN)


def _nothing(trace: Recorded) -> Measure | None:
    """Why there is no spacing error; None where there is one."""
    if not len(trace["neighbors"].values):
        return Measure(None, reason=SHAPELESS)
    return Measure(None, reason=BROKEN) if np.isnan(spacing_error(trace)).all() else None


@metric(unit="m", over="tail", watched=False, rank=40, of_team=True, leaves_out=False, watches=(MEAN,))
def spacing_error_mean(trace: Recorded) -> Measure:
    """Mean absolute deviation of the neighbor distances from even spacing."""
    return _nothing(trace) or Measure(mean_of(trace, MEAN))


@metric(
    unit="m",
    over="tail",
    grows=True,
    watched=False,
    rank=50,
    of_team=True,
    leaves_out=False,
    watches=(LARGEST,),
)
def spacing_error_max(trace: Recorded) -> Measure:
    """Largest absolute deviation of a neighbor distance from even spacing."""
    return _nothing(trace) or worst_of(trace, LARGEST)
