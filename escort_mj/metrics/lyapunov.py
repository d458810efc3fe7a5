"""How the Lyapunov function V1 of the sliding-mode laws changes, from the truth channel."""

from __future__ import annotations

import numpy as np

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import SHORT, UNTOLD, largest_of, lost, robot
from escort_mj.monitor.signals import CAUSES
from escort_mj.record.recording import Recorded, lacks

NO_LYAPUNOV = "the Lyapunov function belongs to the sliding-mode laws"


def _changed_by(trace: Recorded, cause: str) -> np.ndarray:
    """Change of V1 so far by one cause, shape (time, robot) [J]."""
    return trace["lyapunov_change"].values[:, :, CAUSES.index(cause)]


@metric(unit="J", grows=True, watched=False, rank=270, needs=("truth", "sliding_mode"))
def lyapunov_rise(trace: Recorded) -> Measure:
    """Largest rise of a robot's V1 above its minimum so far, excluding the effect of the reference."""
    if lacks(trace, "lyapunov"):
        return Measure(None, reason=UNTOLD if lacks(trace, "mass_matrix") else NO_LYAPUNOV)
    value = trace["lyapunov"].values - _changed_by(trace, "reference")
    value = np.where(lost(trace), np.nan, value)
    return largest_of(trace, value - np.minimum.accumulate(value, axis=0), robot)


@metric(unit="J", grows=True, watched=False, rank=280, needs=("truth", "sliding_mode"))
def lyapunov_unexplained(trace: Recorded) -> Measure:
    """Sum of |change of V1 without a known cause| over robots and samples."""
    if lacks(trace, "lyapunov"):
        return Measure(None, reason=UNTOLD if lacks(trace, "mass_matrix") else NO_LYAPUNOV)
    total = np.where(lost(trace), np.nan, _changed_by(trace, "unexplained"))
    if len(total) < 2:
        return Measure(None, reason=SHORT)
    return Measure(float(np.nansum(np.abs(np.diff(total, axis=0)))))
