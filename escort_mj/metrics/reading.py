"""What metrics read alike: means over time, totals, the worst value with its moment and bodies."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.measure import Bodies, Measure
from escort_mj.monitor.signals import GEOMS, ROBOTS, TARGET
from escort_mj.record.recording import Recorded, known_time

Array = NDArray[np.float64]
Number = TypeVar("Number", float, Array)

SHORT = "the window holds a single sample"
BY_GEOMS, BY_SPHERES = "by geoms", "at least, by the spheres around robots"
ALONE = "there is one robot"
ALL_LOST = "no robot is left"
NO_TARGET = "there is no target"
NO_OPPONENTS = "there are no opponents"
UNTOLD = "the truth was not recorded (recording.truth)"


def lost(trace: Recorded) -> NDArray[np.bool_]:
    """Which robots the team has lost, shape (time, robot)."""
    flags: NDArray[np.bool_] = trace["lost"].values > 0
    return flags


def stretches(trace: Recorded) -> Iterator[tuple[int, int, NDArray[np.bool_]]]:
    """Yield stretches of samples with the same robots: the first sample, their end, and who is left."""
    gone = lost(trace)
    cuts = np.flatnonzero((gone[1:] != gone[:-1]).any(axis=1)) + 1
    for first, end in pairwise([0, *cuts.tolist(), len(gone)] if len(gone) else []):
        yield first, end, ~gone[first]


def escorts(trace: Recorded) -> bool:
    """Whether there is a target to escort."""
    return bool(trace.attrs.get("target_radius") != 0.0)


def mean(trace: Recorded, values: Array) -> float:
    """Mean over time and things of values of shape (time, thing), without those that are NaN.

    A sample counts for the time around it: halfway to its neighbors, at either end as far out as in. The gaps
    of a log count for none.

    Args:
        trace: With a sample at least.
        values: One row for each sample.
    """
    gaps = np.diff(np.rint(known_time(trace) / trace.attrs["timestep"]))
    weights = np.ones(len(values))
    if gaps.any():
        weights = np.append(gaps[0], gaps) + np.append(gaps, gaps[-1])
    known = ~np.isnan(values)
    weighed = (weights / weights.max())[:, None] * known
    return float((np.where(known, values, 0.0) * weighed).sum() / weighed.sum())


def largest_of(trace: Recorded, values: Array, name: Callable[[int], Bodies]) -> Measure:
    """Largest of values of shape (time, thing), the first of equals; NaN is none."""
    return _at(trace, values, np.argmax(np.where(np.isnan(values), -np.inf, values)), name)


def least_of(trace: Recorded, values: Array, name: Callable[[int], Bodies]) -> Measure:
    """Least of values of shape (time, thing), the first of equals."""
    return _at(trace, values, np.argmin(values), name)


def _at(trace: Recorded, values: Array, place: np.intp, name: Callable[[int], Bodies]) -> Measure:
    """The value at a flat place of values of shape (time, thing)."""
    row, column = divmod(int(place), values.shape[1])
    return Measure(float(values[row, column]), float(trace["time"][row]), name(column))


def robot(index: int) -> Bodies:
    """Name of a robot, by its index."""
    return (f"robot_{index + 1}",)


def robots(indices: Iterable[int]) -> Bodies:
    """Names of robots, by their indices."""
    return tuple(f"robot_{index + 1}" for index in indices)


def name_robots(trace: Recorded) -> Callable[[int], Bodies]:
    """What names the robots of a trace, by their indices."""
    return robot


def nobody(index: int) -> Bodies:
    """No name at all, of what no body has by itself."""
    return ()


def gained(trace: Recorded, name: str) -> Measure:
    """What a running total gained over the window, sum over robots; no value for a window of one sample."""
    if trace.sizes["time"] < 2:
        return Measure(None, reason=SHORT)
    total, last = trace[name].values, _last(trace)
    return Measure(float((total[last, np.arange(len(last))] - total[0]).sum()))


def rate(trace: Recorded, name: str) -> Measure:
    """What a running total gained per second, mean over robots; no value for a window of one sample."""
    total, time = gained(trace, name), known_time(trace)
    if total.value is None:
        return total
    return Measure(total.value / float((time[_last(trace)] - time[0]).sum()))


def _last(trace: Recorded) -> NDArray[np.intp]:
    """The last sample in which each robot was not lost, the first if it always was, shape (robot,)."""
    return np.maximum((~lost(trace)).sum(axis=0) - 1, 0)


def manner_of(trace: Recorded, clearance: float, bodies: Bodies) -> str:
    """Return how a clearance was found; that of hulls, which are spheres, is found in one way only."""
    if "body_shape" not in trace:
        return ""
    named = dict(zip(trace["body"].values.tolist(), trace["body_shape"].values.tolist(), strict=True))
    if all(named[body] != GEOMS for body in bodies):
        return ""
    return BY_GEOMS if clearance < float(trace.attrs["exact_within"]) else BY_SPHERES


def radii_of(trace: Recorded) -> Array:
    """Radius of each body as avoidance takes it, shape (body,) [m]: 0 for walls and what is no sphere."""
    names = trace["body"].values
    radii = np.zeros(len(names))
    radii[: trace.sizes["robot"]] = trace["robot_radius"].values
    radii[names == "target"] = float(trace.attrs["target_radius"])
    for name, radius in zip(trace["obstacle"].values, trace["obstacle_radius"].values, strict=True):
        radii[names == name] = radius
    return radii


def safe_gap(trace: Recorded, radii: Number, group: str) -> Number:
    """Return the gap that avoidance keeps between the surfaces of a robot and a body [m].

    Args:
        trace: A trace.
        radii: Sum of the radii of the two [m].
        group: Of the body. Where the target is not avoided, that is 0 or less.
    """
    attrs = trace.attrs
    safe = attrs["safe_distance"]
    if group == ROBOTS:
        safe = attrs.get("teammate_distance", safe)
    elif group == TARGET:
        safe = attrs.get("target_distance", 0.0)
    return float(safe) - radii * float(attrs["safe_distance_measure"] == "center")
