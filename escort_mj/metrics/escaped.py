"""When the target gets out of the team for good, and between whom."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from escort_mj.metrics.hull_margin import margins, over_time, takes_long, teams
from escort_mj.metrics.largest_gap import beside_gap
from escort_mj.metrics.metric import Measure, metric
from escort_mj.metrics.reading import ALL_LOST, NO_TARGET, escorts

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded


@metric(unit="s", watched=False, more_is_better=True, dear=takes_long, of_team=True, moment=True)
def escaped(trace: Recorded) -> Measure:
    """Time from which the target stays outside the robots' convex hull until the end."""
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    time, found = trace["time"].values, list(teams(trace))
    if not found:
        return Measure(None, reason=ALL_LOST)
    first, last = found[-1]
    if first + len(last) == len(time) and margins(last[-1:])[0] >= 0.0:
        return Measure(math.inf, float(time[-1]), reason="never escapes")
    row = int(np.flatnonzero(over_time(trace, margins) >= 0.0).max(initial=-1)) + 1
    return Measure(float(time[row]), float(time[row]), beside_gap(trace, row))
