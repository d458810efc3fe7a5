"""When the target gets out of the team for good, and between whom."""

from __future__ import annotations

import math

import numpy as np

from escort_mj.metrics.hull_margin import SIGNALS, Array, margins, of_teams, takes_long
from escort_mj.metrics.largest_gap import beside_gap, name_pair
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import ALL_LOST, NO_TARGET, escorts, lost
from escort_mj.metrics.watching import Course, Fold, Starts, Watch, last_of
from escort_mj.record.recording import Recorded


def _inside(team: Array) -> Array:
    return np.asarray(margins(team) >= 0.0, float)


def _last_inside(team: Array) -> tuple[float, int]:
    for row in reversed(range(len(team))):
        if _inside(team[row : row + 1])[0]:
            return 1.0, row
    return 0.0, 0


def _surrounded(trace: Recorded, starts: Starts | None) -> Array:
    return of_teams(trace, starts, _inside, _last_inside)


SURROUNDED = Watch(Course("surrounded", SIGNALS, _surrounded), Fold.LAST)


@metric(
    unit="s",
    watched=False,
    more_is_better=True,
    dear=takes_long,
    of_team=True,
    moment=True,
    watches=(SURROUNDED,),
)
def escaped(trace: Recorded) -> Measure:
    """Time from which the target stays outside the robots' convex hull until the end."""
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    if lost(trace).all():
        return Measure(None, reason=ALL_LOST)
    last = last_of(trace, SURROUNDED)
    if last.since == math.inf:
        return Measure(math.inf, float(trace["time"][-1]), reason="never escapes")
    row = np.searchsorted(trace["time"].values, last.since - 0.5 * trace.attrs["timestep"])
    between = beside_gap(trace, np.array([row]))[0]  # as it is in the first sample since
    return Measure(last.since, last.since, name_pair(trace)(int(between)))
