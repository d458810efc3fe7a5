"""How wide the target could get out of the team: the largest opening between robots as it sees them.

In the plane it is the largest angle between neighboring robots. In general, the half-opening of the widest
cone without a robot is the largest over unit vectors u of the least angle between u and a robot's direction:
its cosine is the margin of the target in the hull of the directions (see `hull_margin`).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.hull_margin import SIGNALS, least_margin, margins, of_teams, takes_long
from escort_mj.metrics.measure import Bodies, Measure
from escort_mj.metrics.metric import metric
from escort_mj.metrics.reading import ALL_LOST, NO_TARGET, escorts, lost, robots
from escort_mj.metrics.watching import Course, Fold, Starts, Watch, worst_of
from escort_mj.record.recording import Recorded

Array = NDArray[np.float64]


def gaps(team: Array) -> Array:
    """Return the largest gap around the target in each of several teams, shape (samples,) [rad]."""
    return opening(margins(bearings(team)))


def bearings(team: Array) -> Array:
    """Return the unit vectors to robots, shape (samples, robots, axes); 0 to one that is at the target."""
    length = np.linalg.norm(team, axis=2, keepdims=True)
    return np.divide(team, length, out=np.zeros_like(team), where=length > 0.0)


def opening(margin: Array) -> Array:
    """Return the opening of the widest empty cone whose directions have a margin [rad]."""
    return np.asarray(2.0 * np.arccos(np.clip(margin, -1.0, 1.0)))


def beside_gap(trace: Recorded, rows: NDArray[np.intp]) -> Array:
    """Return the robots on both sides of the largest gap of samples, as a number that `name_pair` reads.

    0 stands for none: but in the plane, and of fewer than two robots.

    Args:
        trace: Of a mission with a target.
        rows: Which samples.
    """
    gone, count = lost(trace)[rows], trace.sizes["robot"]
    left = (~gone).sum(axis=1)
    if trace.sizes["axis"] != 2 or count < 2:
        return np.zeros(len(rows))
    away = trace["q"].values[rows] - trace["target_position"].values[rows, None]
    angle = np.where(gone, np.inf, np.arctan2(away[..., 1], away[..., 0]))
    order, every = np.argsort(angle, axis=1, kind="stable"), np.arange(len(rows))
    angle = np.take_along_axis(angle, order, axis=1)
    following = np.append(angle[:, 1:], angle[:, :1], axis=1)
    following[every, left - 1] = angle[:, 0] + 2.0 * math.pi
    there = np.arange(count) < left[:, None]
    widest = np.where(there, np.where(there, following, 0.0) - np.where(there, angle, 0.0), -1.0).argmax(
        axis=1
    )
    beside = np.sort([order[every, widest], order[every, (widest + 1) % np.maximum(left, 1)]], axis=0)
    return np.where(left < 2, 0.0, 1.0 + beside[0] * count + beside[1])


def name_pair(trace: Recorded) -> Callable[[int], Bodies]:
    """What names the robots that a number of `beside_gap` stands for."""
    count = trace.sizes["robot"]
    return lambda index: robots(divmod(index - 1, count)) if index else ()


def _widest(team: Array) -> tuple[float, int]:
    margin, row = least_margin(bearings(team))
    return float(opening(np.array(margin))), row


def _openings(trace: Recorded, starts: Starts | None) -> Array:
    return of_teams(trace, starts, gaps, _widest)


OPENING = Watch(Course("gap", SIGNALS, _openings, name_pair, beside_gap), Fold.LARGEST)


@metric(
    unit="rad",
    over="tail",
    most=2.0 * math.pi,
    grows=True,
    watched=False,
    dear=takes_long,
    of_team=True,
    watches=(OPENING,),
)
def largest_gap(trace: Recorded) -> Measure:
    """Largest angle of a sector (in the plane) or a cone (in space) at the target that contains no robot."""
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    return Measure(None, reason=ALL_LOST) if lost(trace).all() else worst_of(trace, OPENING)
