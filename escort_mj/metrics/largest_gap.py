"""How wide the target could get out of the team: the largest opening between robots as it sees them.

In the plane it is the largest angle between neighboring robots. In general, the half-opening of the widest
cone without a robot is the largest over unit vectors u of the least angle between u and a robot's direction:
its cosine is the margin of the target in the hull of the directions (see `hull_margin`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.hull_margin import least_margin, margins, takes_long, teams
from escort_mj.metrics.metric import Bodies, Measure, metric
from escort_mj.metrics.reading import ALL_LOST, NO_TARGET, escorts, lost, robots

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded

Array = NDArray[np.float64]


@metric(unit="rad", over="tail", most=2.0 * math.pi, grows=True, watched=False, dear=takes_long, of_team=True)
def largest_gap(trace: Recorded) -> Measure:
    """Largest angle of a sector (in the plane) or a cone (in space) at the target that contains no robot."""
    if not escorts(trace):
        return Measure(None, reason=NO_TARGET)
    found = [(*least_margin(bearings(team)), first) for first, team in teams(trace)]
    if not found:
        return Measure(None, reason=ALL_LOST)
    value, row, first = min(found)
    when = first + row
    return Measure(float(opening(np.array(value))), float(trace["time"][when]), beside_gap(trace, when))


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


def beside_gap(trace: Recorded, row: int) -> Bodies:
    """Return the robots on both sides of the largest gap of a sample; in the plane only."""
    left = np.flatnonzero(~lost(trace)[row])
    if trace.sizes["axis"] != 2 or len(left) < 2:
        return ()
    away = trace["q"].values[row, left] - trace["target_position"].values[row]
    angle = np.arctan2(away[:, 1], away[:, 0])
    order = np.argsort(angle)
    widest = int(np.argmax(np.diff(angle[order], append=angle[order[0]] + 2.0 * math.pi)))
    return robots(sorted(left[order[[widest, (widest + 1) % len(order)]]]))
