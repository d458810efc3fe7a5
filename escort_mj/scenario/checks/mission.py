"""Checks of the mission: behaviors, formation, the supervisor's phases, and what the video shows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from escort_mj.behaviors import Behavior
from escort_mj.laws import Law
from escort_mj.numerics.formation import widest_spacing
from escort_mj.rules import Rule
from escort_mj.scenario.findings import Finding, Path, key_path
from escort_mj.scenario.geometry.placement import robot_count
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario


def _stacks(scenario: Scenario) -> Iterator[tuple[Path, tuple[Behavior, ...]]]:
    """The mission's own behaviors and those of each phase, with their places in the file."""
    yield ("mission", "behaviors"), scenario.mission.behaviors
    for index, phase in enumerate(scenario.mission.supervisor):
        yield ("mission", "supervisor", index, "behaviors"), phase.behaviors


def behaviors_of(scenario: Scenario) -> Iterator[tuple[Path, Behavior]]:
    """Every behavior with its place in the file."""
    for path, stack in _stacks(scenario):
        yield from (((*path, index), behavior) for index, behavior in enumerate(stack))


def laws_of(scenario: Scenario) -> Iterator[tuple[Path, Law]]:
    """Every law that some robot has, with its place in the file."""
    for index, team in enumerate(scenario.teams):
        if team.controller is not None:
            yield ("teams", index, "controller"), team.controller
    if not scenario.teams or any(team.controller is None for team in scenario.teams):
        yield ("controller",), scenario.controller
    for index, each in enumerate(scenario.robots.overrides):
        if each.controller is not None:
            yield ("robots", "overrides", index, "controller"), each.controller


def check_behaviors(mission: Mission) -> Iterator[Finding]:
    """Each behavior at most once in a priority stack; what is of the whole mission is the same everywhere."""
    scenario = mission.scenario
    shared: dict[tuple[str, str], tuple[Path, Any]] = {}
    for path, stack in _stacks(scenario):
        seen: set[str] = set()
        for index, behavior in enumerate(stack):
            if behavior.behavior in seen:
                yield Finding((*path, index), f"found {behavior.behavior} a second time")
            seen.add(behavior.behavior)
            for key in behavior.of_mission:
                value = getattr(behavior, key)
                first, known = shared.setdefault((behavior.behavior, key), ((*path, index), value))
                if value != known:
                    words = f"differs from that of {key_path(first)}; expected the same"
                    yield Finding((*path, index, key), words)


def check_supervisor(mission: Mission) -> Iterator[Finding]:
    """Each phase has a time or a condition that can come true."""
    scenario = mission.scenario
    names: dict[str, int] = {}
    for index, phase in enumerate(scenario.mission.supervisor):
        path: Path = ("mission", "supervisor", index)
        name = phase.name or f"phase_{index + 1}"
        if name in names:
            yield Finding((*path, "name"), f"found {name} again; supervisor[{names[name]}] has it")
        names.setdefault(name, index)
        if phase.after == 0.0 and phase.before is None and phase.when is None and phase.team is None:
            yield Finding(path, "would rule all the time; give after, before or when")
        if phase.after >= scenario.duration:
            words = f"found {phase.after:g} s; the run ends at {scenario.duration:g} s"
            yield Finding((*path, "after"), words, late=f"it begins at {phase.after:g} s")
        if phase.before is not None and phase.before <= phase.after:
            yield Finding(path, f"never rules: after {phase.after:g} s and before {phase.before:g} s")
        if phase.when is not None:
            yield from _check_condition(mission, phase.when, (*path, "when"))


def check_trigger(mission: Mission) -> Iterator[Finding]:
    """Updates are due some time after they are allowed."""
    trigger = mission.scenario.mission.trigger
    if trigger is not None and trigger.longest <= trigger.dwell:
        yield Finding(
            ("mission", "trigger", "longest"),
            f"found {trigger.longest:g} s; expected more than dwell, {trigger.dwell:g} s",
        )


def check_video(mission: Mission) -> Iterator[Finding]:
    """The video shows a part of the run."""
    scenario = mission.scenario
    start, end = scenario.video.start or 0.0, scenario.video.end
    if start >= scenario.duration:
        words = f"found {start:g} s; the run ends at {scenario.duration:g} s"
        yield Finding(("video", "start"), words, late=f"the video begins at {start:g} s")
    if end is not None and end <= start:
        yield Finding(("video", "end"), f"found {end:g} s; expected more than the start, {start:g} s")
    if scenario.video.robot > mission.count:
        yield Finding(("video", "robot"), f"found {scenario.video.robot}; allowed are 1 to {mission.count}")


def _check_condition(mission: Mission, when: Rule, path: Path) -> Iterator[Finding]:
    if (when.below is None) == (when.above is None):
        found = "neither below nor above" if when.below is None else "both below and above"
        yield Finding(path, f"found {found}; give one of them")
        return
    if when.release is not None:
        wrong = when.release < when.threshold if when.below is not None else when.release > when.threshold
        if wrong:
            side = "at least" if when.below is not None else "at most"
            yield Finding(
                (*path, "release"),
                f"found {when.release:g} m; expected {side} {when.threshold:g} m, where the phase begins",
            )
    if "obstacles" in when.looks_at and not mission.obstacles:
        yield Finding((*path, "quantity"), f"found {when.quantity}; there are no obstacles")
    if "robots" in when.looks_at and mission.count < 2:
        yield Finding((*path, "quantity"), f"found {when.quantity}; there is one robot")


def check_formation(mission: Mission) -> Iterator[Finding]:
    """The behaviors suit the number of robots and their size."""
    scenario = mission.scenario
    own = scenario.mission.radius
    robot_radius = scenario.robots.largest_radius
    body = robot_radius if scenario.target is None else scenario.target.radius + robot_radius
    if scenario.target is not None and own <= body:
        yield Finding(
            ("mission", "radius"),
            f"found {own:g} m, inside the target's body; expected more than {body:g} m",
            related=(("target", "radius"), ("robots", "radius")),
        )
    for key, radius, between in _circles(scenario):
        if between <= 2.0 * robot_radius:
            yield Finding(
                key,
                f"found {radius:g} m, which puts neighbors {between:.3g} m apart; expected more than "
                f"their diameter, {2.0 * robot_radius:g} m",
                related=(("mission", "radius"), ("robots", "radius"), ("robots", "count")),
            )


def neighbor_spacing(scenario: Scenario) -> float:
    """Return the least distance of neighbors of an even formation [m]; infinite where none is kept."""
    return min((between for *_, between in _circles(scenario)), default=math.inf)


def _circles(scenario: Scenario) -> Iterator[tuple[Path, float, float]]:
    """Yield key and radius of each circle that robots spread over, and the distance of neighbors on it."""
    radius, axes = scenario.mission.radius, scenario.axes
    if not any(behavior.spreads for _, behavior in behaviors_of(scenario)):
        return
    if not scenario.teams:
        yield ("mission", "radius"), radius, widest_spacing(robot_count(scenario), axes, radius)
    for index, team in enumerate(scenario.teams):
        most = max([len(team.robots), *(demand.robots for demand in team.demand)])
        own = team.radius or radius
        yield ("teams", index, "radius"), own, widest_spacing(most, axes, own)
