"""How far tethers are stretched."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.measure import Bodies, Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import robot
from escort_mj.metrics.watching import Course, Fold, Watch, simple, worst_of
from escort_mj.record.recording import Recorded

UNTETHERED = "no robot is on a tether"


def tethers(trace: Recorded) -> NDArray[np.int64]:
    """Return the two bodies that each tether is between, shape (k, 2): robots from 1, 0 for the target."""
    return np.reshape(np.asarray(trace.attrs.get("tethers", ()), dtype=np.int64), (-1, 2))


def stretches(trace: Recorded) -> NDArray[np.float64]:
    """Return the distances of the bodies on tethers beyond their lengths, shape (time, k) [m]."""
    bodies = np.concatenate([trace["target_position"].values[:, None], trace["q"].values], axis=1)
    ends = bodies[:, tethers(trace)]
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    return np.asarray(length - np.reshape(trace.attrs.get("tether_length", ()), -1))


def _names(trace: Recorded) -> Callable[[int], Bodies]:
    between = tethers(trace)

    def names(index: int) -> Bodies:
        first, second = (robot(int(end) - 1) if end else ("target",) for end in between[index])
        return (*first, *second)

    return names


STRETCH = Watch(Course("tether_stretch", ("q", "target_position"), simple(stretches), _names), Fold.LARGEST)


@metric(
    unit="m",
    least=-math.inf,
    more_is_better=False,
    rank=150,
    every_step=True,
    watches=(STRETCH,),
    needs=("tethers",),
)
def tether_stretch_max(trace: Recorded) -> Measure:
    """Maximum distance between the bodies on a tether, beyond its length; negative where all are slack."""
    return worst_of(trace, STRETCH) if len(tethers(trace)) else Measure(None, reason=UNTETHERED)
