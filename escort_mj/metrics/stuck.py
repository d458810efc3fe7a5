"""Who is held up at the end of a run: where, and by what."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from escort_mj.metrics.arrival import away, goal_distance
from escort_mj.metrics.measure import Measure, in_words
from escort_mj.metrics.metric import metric
from escort_mj.metrics.radius_error import SETTLED
from escort_mj.metrics.reading import (
    BY_SPHERES,
    lost,
    manner_of,
    radii_of,
    robot,
    robots,
    safe_gap,
)
from escort_mj.monitor.signals import GROUPS
from escort_mj.record.recording import NOT_SEEN, Recorded, lacks
from escort_mj.record.team import kept_radius

STUCK_FOR = 5.0  # s
NEARER = 0.25  # of a robot's radius: who comes nearer than that meanwhile is on the way
MOST_NAMED = 6  # robots that the words place
HEADED = ("goal", "formation")
SHAPED = ("surface", "vertices")
"""Behaviors that give each robot a place: a goal, or a part of the formation around the target."""
NO_PLACE = "robots have neither goals nor places in a formation"


@metric(unit="1", watched=False, rank=35, needs=("goals",))
def stuck(trace: Recorded) -> Measure:
    """Number of robots that end away from their places and have been at rest there for 5 s.

    At rest is who moves by at most its radius, comes nearer to its place, or to the goal before it, by less
    than a quarter of that, and reaches no goal. Places are within `reach` of goals or of places in a
    `formation`, and where `surface` and `vertices` have errors of at most 5 % of the radius. A robot that has
    failed counts on the way to its goal, and is left out of a formation.
    """
    headed, shaped = not lacks(trace, "goal"), np.isin(trace["behavior"].values, SHAPED)
    if not headed and not shaped.any():
        return Measure(None, reason=NO_PLACE)
    time, timestep = trace["time"].values, trace.attrs["timestep"]
    begin = int(np.searchsorted(time, time[-1] - STUCK_FOR + 0.5 * timestep, side="right")) - 1
    if begin < 0:
        return Measure(None, reason=f"the window is shorter than {STUCK_FOR:g} s")
    late = trace.isel(time=np.arange(len(time)) >= begin)
    failed = lost(late)[-1]
    waiting = np.zeros_like(failed)
    if headed:
        goals = late["goals_left"].values
        rests = _rests(late, goal_distance(late)) & (goals[0] == goals[-1])
        waiting |= rests & (away(late)[-1] > 0.0) & (failed | _heads(late))
    if shaped.any():
        error = late["task_error"].values[:, :, shaped].max(axis=2)
        off = (error > SETTLED * kept_radius(late)).all(axis=0)
        waiting |= _rests(late, error) & off & ~failed
    who, left_out = np.flatnonzero(waiting), failed & ~waiting & (not headed)
    return Measure(
        float(len(who)), float(time[-1]), robots(who), manner=_words(late, waiting, failed, left_out)
    )


def _heads(trace: Recorded) -> NDArray[np.bool_]:
    """Who is led to a goal at the end, as far as that is known; a phase may lead robots elsewhere."""
    if "task_error" not in trace:  # of a log
        return np.ones(trace.sizes["robot"], dtype=np.bool_)
    columns = np.isin(trace["behavior"].values, HEADED)
    return np.asarray((trace["task_error"].values[-1][:, columns] > 0.0).any(axis=1))


def _rests(trace: Recorded, error: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Who stays where it ends, by its distance from its place, shape (time, robot) [m]."""
    way = np.linalg.norm(trace["q"].values - trace["q"].values[-1], axis=2).max(axis=0)
    radius = trace["robot_radius"].values
    return np.asarray((way <= radius) & (error[0] - error[-1] < NEARER * radius))


def _words(
    trace: Recorded, waiting: NDArray[np.bool_], failed: NDArray[np.bool_], left_out: NDArray[np.bool_]
) -> str:
    """Who is held up, where and by what; who has failed on the way, and who is left out as it has failed."""
    held = [_placed(trace, index) + _by(trace, index) for index in np.flatnonzero(waiting & ~failed).tolist()]
    gone = [_placed(trace, index) for index in np.flatnonzero(waiting & failed).tolist()]
    parts = [f"{what}: {_first(places)}" for what, places in (("held up", held), ("failed", gone)) if places]
    if left_out.any():
        parts.append(f"without {in_words(robots(np.flatnonzero(left_out)))}, which failed")
    return "; ".join(parts)


def _first(places: list[str]) -> str:
    """The first of some places, and how many more there are."""
    more = len(places) - MOST_NAMED
    return "; ".join(places if more <= 0 else [*places[:MOST_NAMED], f"{more} more"])


def _placed(trace: Recorded, index: int) -> str:
    """A robot and where it ends, to a tenth of its radius, as `robot 3 at (4.1, 0.2) m`."""
    digits = max(1 - math.floor(math.log10(float(trace["robot_radius"].values[index]))), 0)
    place = ", ".join(f"{round(x, digits) + 0.0:.10g}" for x in trace["q"].values[-1, index].tolist())
    return f"{in_words(robot(index))} at ({place}) m"


def _by(trace: Recorded, index: int) -> str:
    """What holds up a robot, as `, 0.31 m from rock`: the body whose safe distance it has used up most.

    That is by the least clearances since the previous sample. Where avoidance does nothing and the robot
    touches nothing, it is none. A log that lacks a body does not say.
    """
    if trace.attrs.get(NOT_SEEN):
        return ""
    columns = np.flatnonzero(np.isin(trace["group"].values, GROUPS))
    near = trace["clearance"].values[:, index, columns]
    apart, body = near[-1], trace["clearance_body"].values[-1, index, columns].astype(int)
    idle = "avoidance_active" in trace and not trace["avoidance_active"].values[:, index].any()
    if not np.isfinite(apart).any() or (idle and near.min() > 0.0):
        return ", by no body"
    radii = radii_of(trace)
    margins = [
        gap - safe_gap(trace, radii[index] + radii[which], str(group)) if math.isfinite(gap) else math.inf
        for gap, which, group in zip(apart, body, trace["group"].values[columns], strict=True)
    ]
    nearest = int(np.argmin(apart if apart.min() <= 0.0 else margins))
    gap, name = float(apart[nearest]), str(trace["body"].values[body[nearest]])
    if gap <= 0.0:
        return f", touching {in_words((name,))}"
    bound = "at least " * (manner_of(trace, gap, (*robot(index), name)) == BY_SPHERES)
    return f", {bound}{gap:.3g} m from {in_words((name,))}"
