"""How well robots follow their references."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from escort_mj.metrics.metric import Measure, metric
from escort_mj.metrics.reading import lost, mean

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded


def _rms(trace: Recorded, name: str) -> Measure:
    """Root mean square of a vector's length over time and robots."""
    square = np.where(lost(trace), np.nan, (trace[name].values ** 2).sum(axis=2))
    return Measure(math.sqrt(mean(trace, square)))


@metric(unit="m", over="tail", watched=False, rank=70)
def tracking_error_rms(trace: Recorded) -> Measure:
    """Root mean square of |e|."""
    return _rms(trace, "e")


@metric(unit="m/s", over="tail", watched=False, rank=80)
def velocity_error_rms(trace: Recorded) -> Measure:
    """Root mean square of |e_dot|."""
    return _rms(trace, "e_dot")
