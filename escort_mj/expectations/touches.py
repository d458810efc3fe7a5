"""Contacts and clearances between two sides: groups of bodies, or single bodies by name.

An episode is one unbroken touch of two bodies, seen at every physics step. It belongs to every window of time
that it reaches into: with all of its force, impulse and depth, and with its time in the window.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.reading import manner_of
from escort_mj.metrics.watching import Course, Fold, Watch, nothing, simple
from escort_mj.record.episodes import during, moving_as, without_forces
from escort_mj.record.recording import Recorded, require_places

Flags = NDArray[np.bool_]
Sides = tuple[str, str]

UNWATCHED = "clearances between {} and {} were not recorded; the scenario's expectations have to name them"


def touches(
    trace: Recorded, sides: Sides | None, after: float = 0.0, before: float | None = None
) -> Recorded:
    """The episodes of a window that are between two sides.

    Args:
        trace: The whole trace.
        sides: Groups or bodies; None for any two bodies but the floor.
        after: Start of the window [s].
        before: Its end [s]; None for the end of the run.

    Returns:
        The trace's episodes; `episode_touch_time` is cut to the window.
    """
    until = math.inf if before is None else before
    found = during(trace, after, until)
    first, second = found["episode_first"].values, found["episode_second"].values
    if sides is None:
        one = other = trace["body_group"].values != "floor"
    else:
        one, other = (_members(trace, side) for side in sides)
    meant = (one[first] & other[second]) | (one[second] & other[first])
    found = found.isel(episode=meant)
    start, end, lasts = (found[f"episode_{name}"].values for name in ("start", "end", "touch_time"))
    inside = np.minimum(end, until) - np.maximum(start, after)
    return found.assign(episode_touch_time=("episode", np.minimum(lasts, inside)))


def require_sides(trace: Recorded, sides: Sides | None) -> None:
    """Raise an error if it is not known where all bodies of two sides were.

    Args:
        trace: A trace.
        sides: Groups or bodies; None for any two bodies.

    Raises:
        NotLoggedError: If a log of real robots does not contain one of them, which moved by itself.
    """
    require_places(trace, None if sides is None else _members(trace, sides[0]) | _members(trace, sides[1]))


def unseen_by_mujoco(trace: Recorded, sides: Sides | None) -> bool:
    """Whether MuJoCo sees no touch at all between two sides, so that geometry alone tells.

    Args:
        trace: A trace.
        sides: Groups or bodies; None for any two bodies.
    """
    if without_forces(trace):
        return True
    if sides is None:
        return False
    led, still = moving_as(trace, "led"), moving_as(trace, "still")
    members = [_members(trace, side) for side in sides]
    return any(bool(led[one].all() and still[other].all()) for one, other in (members, members[::-1]))


def least_clearance(trace: Recorded, sides: Sides | None) -> Measure:
    """Least distance between two sides over a trace or a window of one, surface to surface.

    Args:
        trace: A trace.
        sides: Groups or bodies, at least one of them robots or the target; None for any two bodies.
    """
    best, known = Measure(math.inf), False
    groups = [str(group) for group in trace["group"].values] if "group" in trace else []
    pairs = [(side, group) for side in ("robots", "target") for group in groups] if sides is None else []
    for side, other in pairs or ([sides, sides[::-1]] if sides else []):
        if other not in groups:
            continue
        found = _nearest(trace, side, other, groups.index(other))
        known = known or found is not None
        if found is not None and found.value is not None and found.value < (best.value or math.inf):
            best = found
    if not known:
        return Measure(None, reason=UNWATCHED.format(*(sides or ("any", "body"))))
    return best


def clearance_watch(sides: Sides) -> Watch:
    """What is asked to know when the clearance of two sides was least."""

    def values(trace: Recorded) -> NDArray[np.float64]:
        found, groups = [nothing(trace.sizes["time"])], trace["group"].values.tolist()
        for side, other in (sides, sides[::-1]):
            if other not in groups:
                continue
            column, members = groups.index(other), _members(trace, side)[: trace.sizes["robot"]]
            if side != "target":
                found.append(trace["clearance"].values[:, members, column])
            elif other not in ("robots", "target"):
                found.append(trace["target_clearance"].values[:, [column]])
        return np.concatenate(found, axis=1)

    signals = ("clearance", "target_clearance")
    return Watch(Course(f"clearance {'/'.join(sides)}", signals, simple(values)), Fold.LEAST)


def _nearest(trace: Recorded, side: str, other: str, column: int) -> Measure | None:
    """Least clearance of a side's robots, or of the target, to a group; None where there is no record."""
    members = _members(trace, side)
    robots = trace.sizes["robot"]
    if side != "target" and members[:robots].any():
        rows = np.flatnonzero(members[:robots])
        values = trace["clearance"].values[:, rows, column]
        nearest = trace["clearance_body"].values[:, rows, column]
    elif side == "target" and other not in ("robots", "target"):
        rows = np.flatnonzero(trace["body"].values == "target")
        values = trace["target_clearance"].values[:, column][:, None]
        nearest = trace["target_clearance_body"].values[:, column][:, None]
    else:
        return None
    row, place = divmod(int(np.argmin(values)), len(rows))
    if not math.isfinite(values[row, place]):
        return Measure(math.inf)
    names = trace["body"].values
    bodies = str(names[rows[place]]), str(names[int(nearest[row, place])])
    least = float(values[row, place])
    return Measure(least, float(trace["time"][row]), bodies, manner=manner_of(trace, least, bodies))


def _members(trace: Recorded, side: str) -> Flags:
    """Whether each body is of a side, shape (body,)."""
    flags: Flags = (trace["body"].values == side) | (trace["body_group"].values == side)
    return flags
