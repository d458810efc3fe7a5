"""What expectations ask about every physics step: quantities, and what becomes of those between two samples.

A metric that reads samples says nothing of what happens between them. Where an expectation names it, the
quantities that it is found from are looked at in every physics step, and the steps since the previous sample
are folded into one number, which is recorded with the sample, as the least clearances are. What a metric
finds is then the same at any `recording.rate`; elsewhere it is found from samples alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import NotLoggedError
from escort_mj.metrics.measure import Bodies, Measure
from escort_mj.metrics.reading import mean, nobody
from escort_mj.record.recording import Recorded, not_logged
from escort_mj.signals import SIGNALS

Array = NDArray[np.float64]
Starts = NDArray[np.intp]
"""First step of each stretch of steps, ascending from 0."""


def simple(values: Callable[[Recorded], Array]) -> Callable[[Recorded, Starts | None], Array]:
    """Return the values of a course that leaves out none."""
    return lambda trace, starts: values(trace)


OF_TEAMS = (
    *("target_position", "target_velocity", "member_of", "obstacle_team"),
    *("team_center", "team_radius", "team_velocity"),
)
"""What the trace of one team is found from."""


class Fold(StrEnum):
    """What becomes of the values of several steps."""

    LARGEST = "largest"
    LEAST = "least"
    MEAN = "mean"
    LAST = "last beyond"


class Course(NamedTuple):
    """A quantity that has values in every physics step.

    Attributes:
        name: For the trace.
        signals: Recorded signals that it is found from; those that a mission does not record are left out.
        values: Its values in a trace, shape (time, thing); NaN where there is none. Given stretches of steps,
            by the first of each, it may leave out all but the one that counts of each.
        names: Of a trace, a function that names bodies, by an index.
        whose: Of a trace and some of its steps, such an index for each; None where it is the thing's own.
    """

    name: str
    signals: tuple[str, ...]
    values: Callable[[Recorded, Starts | None], Array]
    names: Callable[[Recorded], Callable[[int], Bodies]] = lambda trace: nobody
    whose: Callable[[Recorded, NDArray[np.intp]], Array] | None = None


class Watch(NamedTuple):
    """What is asked about every physics step.

    Attributes:
        course: The quantity.
        fold: What becomes of its values.
        bound: Beyond which values count, for the last of these.
        team: Name of the team that it is of; empty for all robots.
    """

    course: Course
    fold: Fold
    bound: float = 0.0
    team: str = ""

    @property
    def label(self) -> str:
        """Its name in a trace."""
        beyond = f" {self.bound!r}" if self.fold is Fold.LAST else ""
        return f"{self.team and self.team + '.'}{self.course.name} {self.fold}{beyond}"


class Folded(NamedTuple):
    """What became of the steps since the previous sample, of several watches or of several samples.

    Attributes:
        value: Worst value, the sum of all, or the time of the last one beyond the bound.
        number: Of values that it was found among; 0 for none.
        time: When it was found [s].
        who: Index of the thing that had it.
    """

    value: Array
    number: Array
    time: Array
    who: Array


NAMES = ("watch_value", "watch_count", "watch_time", "watch_who")
"""Signals that hold what became of the steps since the previous sample, part by part."""


class Last(NamedTuple):
    """The last time that something was beyond a bound.

    Attributes:
        time: When it was [s]; None for never.
        since: From when on nothing is [s]; the start where nothing ever was, infinite where something is at
            the end.
        bodies: Who was, the last time.
    """

    time: float | None
    since: float
    bodies: Bodies

    def measure(self, never: str) -> Measure:
        """Return since when nothing is, and who was the last time; a reason where something is at the end."""
        return Measure(self.since, self.time, self.bodies, never if self.since == math.inf else "")


def fold(watch: Watch, trace: Recorded, starts: Starts, values: Array) -> Folded:
    """Fold the values of physics steps into one number for each stretch of steps.

    Args:
        watch: How.
        trace: With the signals of its course.
        starts: First step of each stretch, ascending from 0.
        values: Those of its course in the trace, for these stretches.

    Returns:
        One number for each stretch, shape (stretches,).
    """
    if not values.shape[1]:
        values = nothing(len(values))
    values = np.ascontiguousarray(values.T)  # few things, many steps: a reduction goes along the steps
    time, known = trace["time"].values, ~np.isnan(values)
    if watch.fold is Fold.MEAN:
        each = reduce(np.add, np.where(known, values, 0.0))  # `sum` adds those of a single step in pairs
        total = np.add.reduceat(each, starts)
        count = np.add.reduceat(known.sum(axis=0), starts)
        return Folded(total, count.astype(float), time[starts], np.zeros(len(starts)))
    if watch.fold is Fold.LAST:
        signed = np.where(known & (values > watch.bound), 1.0, -np.inf)
        some = signed.max(axis=0) > 0.0
        rows = np.maximum.reduceat(np.where(some, np.arange(len(time)), 0), starts)
        found, some = time[rows], some.astype(float)
    else:
        sign = 1.0 if watch.fold is Fold.LARGEST else -1.0
        signed = np.where(known, sign * values, -np.inf)
        each = signed.max(axis=0)
        best = np.maximum.reduceat(each, starts)
        alike = np.flatnonzero(each == np.repeat(best, np.diff(np.append(starts, len(each)))))
        rows, found = alike[np.searchsorted(alike, starts)], sign * best
        some = known.any(axis=0).astype(float)
    count, whose = np.add.reduceat(some, starts), watch.course.whose
    who = signed[:, rows].argmax(axis=0) if whose is None else whose(trace, rows)
    each = found, count, time[rows], who.astype(float)
    return Folded(*(np.where(count > 0.0, one, 0.0) for one in each))


def asked_of(watches: Sequence[Watch], sizes: Mapping[str, int]) -> tuple[str, ...]:
    """Return the names of the signals that some watches are found from, of those that a mission records."""
    wanted = {name for watch in watches for name in watch.course.signals}
    if watches:
        wanted |= {"time", "lost", *OF_TEAMS}
    return tuple(one.name for one in SIGNALS if one.name in wanted and one.recorded(sizes))


def nothing(steps: int) -> Array:
    """Return the values of a course that says nothing of a mission, shape (steps, 1)."""
    return np.full((steps, 1), np.nan)


def joined(watches: Sequence[Watch], before: Folded, after: Folded) -> Folded:
    """Return what becomes of two stretches of steps, one behind the other, of each watch."""
    kinds = np.array([watch.fold for watch in watches])
    better = np.select(
        [kinds == Fold.LARGEST, kinds == Fold.LEAST, kinds == Fold.LAST],
        [after.value > before.value, after.value < before.value, True],
        False,
    )
    later = (after.number > 0.0) & (better | (before.number == 0.0))
    value, _, time, who = (np.where(later, new, old) for new, old in zip(after, before, strict=True))
    value = np.where(kinds == Fold.MEAN, before.value + after.value, value)
    return Folded(value, before.number + after.number, time, who)


def watched(trace: Recorded, watch: Watch) -> Folded | None:
    """Return what was watched between the samples of a trace, those where nothing was left out.

    None where nobody asked for it.

    Raises:
        NotLoggedError: If the trace is that of a log that does not contain what it is found from.
    """
    if missing := not_logged(trace).intersection(watch.course.signals):
        raise NotLoggedError(min(missing))
    labels = trace["watch"].values.tolist() if "watch" in trace else []
    if watch.label not in labels:
        return None
    place = labels.index(watch.label)
    folded = Folded(*(trace[name].values[:, place] for name in NAMES))
    some = folded.number > 0
    return Folded(*(each[some] for each in folded))


def _known(trace: Recorded, watch: Watch) -> Folded:
    """Return what is known of a watch's course: of stretches that were watched, or else of samples.

    What was watched counts as it was then: the trace has only the last of what a mission under way changes.
    The first sample of a window may know of no stretch.
    """
    between, rest, start = watched(trace, watch), trace, np.zeros(1, dtype=np.intp)
    if between is not None:
        place = trace["watch"].values.tolist().index(watch.label)
        if trace["watch_count"].values[0, place] > 0.0:
            return between
        rest = trace.isel(time=np.arange(trace.sizes["time"]) < 1)
    found = fold(watch, rest, start, watch.course.values(rest, start))
    if between is None:
        return found
    return Folded(*(np.append(one, more) for one, more in zip(found, between, strict=True)))


def worst_of(trace: Recorded, watch: Watch) -> Measure:
    """Return the largest or the least value of a watch's course, the first of equals.

    It is that of all physics steps where they were watched, or else of samples.

    Args:
        trace: With a sample at least, or a step, that has a value.
        watch: What was asked, whether or not it was watched.
    """
    found, sign = _known(trace, watch), -1.0 if watch.fold is Fold.LARGEST else 1.0
    best = np.lexsort((found.time, sign * found.value, found.number == 0.0))[0]
    who = watch.course.names(trace)(int(found.who[best]))
    return Measure(float(found.value[best]), float(found.time[best]), who)


def to_the_step(trace: Recorded, watch: Watch, found: Measure) -> Measure:
    """Return what was found among samples that look back, with the time exact to the step if watched.

    Args:
        trace: The same.
        watch: Of the same quantity.
        found: Its least value.
    """
    between = watched(trace, watch)
    if between is None or found.value not in between.value:
        return found
    return found._replace(time=float(between.time[between.value == found.value].min()))


def mean_of(trace: Recorded, watch: Watch) -> float:
    """Return the mean over time and things of a watch's course: of all steps watched, or of samples."""
    between = watched(trace, watch)
    if between is None or not len(between.value):
        return mean(trace, watch.course.values(trace, None))
    return float(between.value.sum() / between.number.sum())


def last_of(trace: Recorded, watch: Watch) -> Last:
    """Return when a watch's course was last beyond the bound: exact to the step, or to the sample.

    Args:
        trace: With a sample at least.
        watch: What was asked, whether or not it was watched.
    """
    time, names, found = trace["time"].values, watch.course.names(trace), _known(trace, watch)
    found = Folded(*(each[found.number > 0.0] for each in found))
    if not len(found.value):
        return Last(None, float(time[0]), ())
    best = int(np.argmax(found.value))
    last, who = float(found.value[best]), found.who[best : best + 1]
    if last == time[-1]:
        values = watch.course.values(trace.isel(time=time == last), np.zeros(1, dtype=np.intp))
        things = np.flatnonzero(values[-1] > watch.bound) if watch.course.whose is None else who
        return Last(last, math.inf, tuple(name for thing in things for name in names(int(thing))))
    if watched(trace, watch) is None:
        since = float(time[np.searchsorted(time, last) + 1])
    else:
        since = last + float(trace.attrs["timestep"])
    return Last(last, since, names(int(who[0])))
