"""When a robot first touches the target, and which one."""

from __future__ import annotations

import math

import numpy as np

from escort_mj.metrics.contacts import touches_within
from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import NO_TARGET, escorts
from escort_mj.monitor.signals import ROBOTS, TARGET
from escort_mj.record.episodes import BODIES, pair
from escort_mj.record.recording import Recorded, require_places


@metric(unit="s", watched=False, every_step=True, moment=True)
def caught(trace: Recorded) -> Measure:
    """Time at which a robot first touches the target."""
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    require_places(trace, trace["body_group"].values == TARGET)
    found, time = touches_within(trace), trace["time"].values
    groups = np.sort([found["body_group"].values[found[name].values] for name in BODIES], axis=0)
    touches = np.flatnonzero((groups == np.array([[ROBOTS], [TARGET]])).all(axis=0))
    if not len(touches):
        return Measure(math.inf, float(time[-1]), reason="never caught")
    first = int(touches[0])
    when = max(float(found["episode_start"].values[first]), float(time[0]))
    return Measure(when, when, tuple(name for name in pair(found, first) if name != TARGET))
