"""Checks of where robots go: goals that fit beside each other, and a target where one is needed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import Formation, Goal
from escort_mj.errors import ScenarioError
from escort_mj.scenario.checks.mission import behaviors_of
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.geometry.goals import goals_of
from escort_mj.scenario.mission import Mission

Array = NDArray[np.float64]

MOST_REPORTED = 20


def check_target(mission: Mission) -> Iterator[Finding]:
    """What needs a target has one."""
    scenario = mission.scenario
    if scenario.target is not None or scenario.teams:
        return
    for path, behavior in behaviors_of(scenario):
        if behavior.chases or behavior.frame == "target":
            yield Finding(
                path,
                f"found {behavior.behavior}, which needs a target; this mission has none (target: null)",
                related=(("target",),),
            )
    for index, phase in enumerate(scenario.mission.supervisor):
        if phase.when is not None and "target" in phase.when.looks_at:
            yield Finding(
                ("mission", "supervisor", index, "when", "quantity"),
                f"found {phase.when.quantity}; this mission has no target (target: null)",
            )


def check_one_way(mission: Mission) -> Iterator[Finding]:
    """No stack sends robots to two places at once."""
    seen: dict[Path, str] = {}
    for path, behavior in behaviors_of(mission.scenario):
        if behavior.arrives_within:
            if path[:-1] in seen:
                words = f"found {behavior.behavior} beside {seen[path[:-1]]}; each says where all robots go"
                yield Finding(path, words)
            seen[path[:-1]] = behavior.behavior


def check_goals(mission: Mission) -> Iterator[Finding]:
    """All robots fit at their last goals, or offsets."""
    scenario = mission.scenario
    for path, goal in behaviors_of(scenario):
        if (
            isinstance(goal, Formation)
            and isinstance(goal.scale, float)
            and len(goal.offsets) == mission.count
        ):
            with suppress(ScenarioError):  # no room for robots, which another check says
                places = goal.scale * np.array(goal.offsets)
                yield from _overlapping(places, mission.team.radius, "offsets", (*path, "offsets"))
        if not isinstance(goal, Goal):
            continue
        if not isinstance(goal.goals, tuple) or len(goal.goals) == mission.count:
            yield from _fitting(mission, goal, (*path, "goals"))


def _fitting(mission: Mission, goal: Goal, path: Path) -> Iterator[Finding]:
    """Robots at their last goals touch neither each other nor what stands."""
    try:
        robots = mission.team
        (goals,) = goals_of(mission.scenario, robots, [goal])
    except ScenarioError as error:
        if any(fault.key == "mission.behaviors" for fault in error.faults):
            yield from (Finding(path, fault.message) for fault in error.faults)
        return
    last = np.array([points[-1] for points in goals])
    yield from _overlapping(last, robots.radius, "goals", path)
    for body in mission.obstacles:
        if body.motion is not None:
            continue
        clear = body.gaps(last) - robots.radius
        if clear.min() < 0.0:
            yield Finding(
                path,
                f"found the goal of robot {int(clear.argmin()) + 1}, where it overlaps {body.name} "
                f"by {-clear.min():.3g} m",
            )


def _overlapping(places: Array, radius: Array, what: str, path: Path) -> Iterator[Finding]:
    """Robots at places that are meant for them do not overlap.

    Args:
        places: Of the robots, shape (n, p) [m].
        radius: Of their bodies, shape (n,) [m].
        what: What to call the places.
        path: Of these.
    """
    gaps = np.linalg.norm(places[:, None] - places, axis=2) - radius[:, None] - radius
    for i, j in np.argwhere(np.triu(gaps < 0.0, 1))[:MOST_REPORTED]:
        yield Finding(
            path,
            f"found {what} of robots {i + 1} and {j + 1} whose bodies overlap by {-gaps[i, j]:.3g} m there",
            related=(("robots", "radius"),),
        )
