"""What becomes of opponents: how many are intercepted or reach the target, and how close it gets."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.measure import Bodies, Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import NO_OPPONENTS
from escort_mj.metrics.watching import Course, Fold, Watch, nothing, simple, worst_of
from escort_mj.record.recording import Recorded, lacks
from escort_mj.record.window import rate_of

COMES, INTERCEPTED, REACHED = 1, 2, 3


def _named(trace: Recorded, opponents: NDArray[np.int64]) -> tuple[str, ...]:
    """Names of opponents, which are the last obstacles."""
    names = trace["obstacle"].values[-trace.sizes["opponent"] :]
    return tuple(map(str, names[opponents]))


def _names(trace: Recorded) -> Callable[[int], Bodies]:
    return lambda index: _named(trace, np.array([index]))


def _watch(name: str, status: int) -> Watch:
    """What is asked to know when the first opponent came to a status."""

    def reached(trace: Recorded) -> NDArray[np.float64]:
        if lacks(trace, "opponent_status"):
            return nothing(trace.sizes["time"])
        return np.asarray(trace["opponent_status"].values == status, float)

    return Watch(Course(name, ("opponent_status",), simple(reached), _names), Fold.LARGEST)


WATCHES = {
    status: _watch(name, status) for status, name in ((INTERCEPTED, "intercepted"), (REACHED, "breached"))
}


def _ended(trace: Recorded, status: int) -> Measure:
    """How many opponents end with a status; which came to it first, and when, and the others after it."""
    if lacks(trace, "opponent_status"):
        return Measure(None, reason=NO_OPPONENTS)
    which = np.flatnonzero(trace["opponent_status"].values[-1] == status)
    if not len(which):
        return Measure(0.0)
    rows = np.argmax(trace["opponent_status"].values[:, which] == status, axis=0)
    order, first = np.argsort(rows, kind="stable"), worst_of(trace, WATCHES[status])
    known = "at" if rate_of(trace) == 1.0 / float(trace.attrs["timestep"]) else "by"  # a sample
    others = zip(_named(trace, which[order]), trace["time"].values[rows[order]], strict=True)
    then = ", ".join(f"{name} {known} {time:.2f} s" for name, time in others if name not in first.bodies)
    return first._replace(value=float(len(which)), manner=then and f"then {then}")


@metric(
    unit="1",
    watched=False,
    more_is_better=True,
    rank=41,
    watches=(WATCHES[INTERCEPTED],),
    every_step=True,
    needs=("opponents",),
)
def opponents_intercepted(trace: Recorded) -> Measure:
    """Number of opponents that robots have intercepted."""
    return _ended(trace, INTERCEPTED)


@metric(unit="1", watched=False, rank=42, watches=(WATCHES[REACHED],), every_step=True, needs=("opponents",))
def opponents_breached(trace: Recorded) -> Measure:
    """Number of opponents that have reached the target."""
    return _ended(trace, REACHED)


@metric(unit="s", watched=False, more_is_better=True, rank=43, needs=("opponents",))
def threat_time_min(trace: Recorded) -> Measure:
    """Shortest time to a target for an approaching opponent that heads straight for it at its speed."""
    if lacks(trace, "opponent_status"):
        return Measure(None, reason=NO_OPPONENTS)
    coming, time = trace["opponent_status"].values == COMES, trace["time"].values
    count = coming.shape[1]
    place = trace["obstacle_position"].values[:, -count:]
    if len(time) < 2:
        return Measure(None, reason="the window holds a single sample")
    targets, radius = trace["target_position"].values[:, None], np.array([trace.attrs["target_radius"]])
    escorted = np.ones((len(time), 1), dtype=bool)
    if "member_of" in trace:
        escorted = trace["obstacle_team"].values > 0
        targets, radius = trace["obstacle_position"].values, trace["obstacle_radius"].values
    gaps = np.linalg.norm(place[:, :, None] - targets[:, None], axis=3) - radius
    gaps[~np.broadcast_to(escorted[:, None], gaps.shape)] = np.inf
    gap = gaps.min(axis=2) - trace["obstacle_radius"].values[-count:]
    speed = np.linalg.norm(np.gradient(place, time, axis=0), axis=2)
    left = np.maximum(gap, 0.0) / np.maximum(speed, 1e-9)
    left[~coming] = np.inf
    row, which = np.unravel_index(int(left.argmin()), left.shape)
    if not np.isfinite(left[row, which]):
        return Measure(None, reason="no opponent comes")
    return Measure(float(left[row, which]), float(time[row]), _named(trace, np.array([which])))
