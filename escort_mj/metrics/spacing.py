"""How far neighbors in a formation are from standing evenly."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from escort_mj.metrics.metric import Bodies, Measure, metric
from escort_mj.metrics.reading import largest_of, lost, mean

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded

SHAPELESS = "there is no formation, or not one for the whole run"
BROKEN = "a robot was lost before, and the others stand in another formation"


def spacing_error(trace: Recorded) -> np.ndarray | None:
    """Signed deviation of neighbors' distances from even, shape (time, edge) [m]; None without a formation.

    NaN from the first loss on, which is the end of this formation.
    """
    pairs = trace["neighbors"].values
    if not len(pairs):
        return None
    q = trace["q"].values
    apart = np.linalg.norm(q[:, pairs[:, 0] - 1] - q[:, pairs[:, 1] - 1], axis=2)
    concerned = np.isin(np.arange(q.shape[1]), pairs - 1)
    broken = lost(trace)[:, concerned].any(axis=1, keepdims=True)
    return np.where(broken, np.nan, apart - trace["spacing"].values)


def _edge(trace: Recorded) -> Callable[[int], Bodies]:
    pairs = trace["neighbors"].values
    return lambda index: (f"robot_{pairs[index, 0]}", f"robot_{pairs[index, 1]}")


@metric(unit="m", over="tail", watched=False, rank=40, of_team=True)
def spacing_error_mean(trace: Recorded) -> Measure:
    """Mean absolute deviation of the neighbor distances from even spacing."""
    error = spacing_error(trace)
    if error is None:
        return Measure(None, reason=SHAPELESS)
    return Measure(None, reason=BROKEN) if np.isnan(error).all() else Measure(mean(trace, np.abs(error)))


@metric(unit="m", over="tail", grows=True, watched=False, rank=50, of_team=True)
def spacing_error_max(trace: Recorded) -> Measure:
    """Largest absolute deviation of a neighbor distance from even spacing."""
    error = spacing_error(trace)
    if error is None:
        return Measure(None, reason=SHAPELESS)
    if np.isnan(error).all():
        return Measure(None, reason=BROKEN)
    return largest_of(trace, np.abs(error), _edge(trace))
