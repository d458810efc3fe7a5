"""How often the outer loop runs."""

from __future__ import annotations

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import rate
from escort_mj.record.recording import Recorded


@metric(unit="1/s", watched=False, rank=110, every_step=True)
def outer_update_rate(trace: Recorded) -> Measure:
    """Updates by the outer loop per second, mean over robots."""
    return rate(trace, "outer_updates")
