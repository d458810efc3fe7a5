"""Means over time of what is sampled, mostly but not always at even distances."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded


def mean(trace: Recorded, values: NDArray[np.float64]) -> float:
    """Mean over time and things of values of shape (time, thing), without those that are NaN.

    A sample counts for the time around it: halfway to its neighbors, at either end as far out as in.

    Args:
        trace: With a sample at least.
        values: One row for each sample.
    """
    gaps = np.diff(np.rint(trace["time"].values / trace.attrs["timestep"]))
    weights = np.ones(len(values))
    if len(gaps):
        weights = np.append(gaps[0], gaps) + np.append(gaps, gaps[-1])
    known = ~np.isnan(values)
    weighed = (weights / weights.max())[:, None] * known
    return float((np.where(known, values, 0.0) * weighed).sum() / weighed.sum())
