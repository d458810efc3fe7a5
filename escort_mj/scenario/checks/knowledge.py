"""Checks of `knowledge` and `communication`: robots that exist, rates in whole steps, behaviors that fit."""

from __future__ import annotations

import math
from collections.abc import Iterator

from escort_mj.components.facts import robots_known
from escort_mj.knowledge.sight import TargetSight
from escort_mj.scenario.checks.mission import behaviors_of
from escort_mj.scenario.findings import Finding, Path, listed
from escort_mj.scenario.geometry.placement import kinds_of, robot_count
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.knowledge import Knowledge
from escort_mj.scenario.schema.scenario import Scenario

MOST_ON_THEIR_WAY = 1000  # messages of one robot
HEADLESS = "which has no heading; expected null, or kinds with a heading, such as diff_drive and quadrotor"
MAX_LINKS = 64 * 2**20  # bytes of messages that are kept


def check_known(mission: Mission) -> Iterator[Finding]:
    """There is a target to know of."""
    scenario = mission.scenario
    knowledge, communication = scenario.knowledge, scenario.communication
    if knowledge is None and communication is None:
        return
    table: Path = ("knowledge",) if knowledge is not None else ("communication",)
    if scenario.target is None and not scenario.teams:
        words = "found a mission without a target; robots share only what they know of a target"
        yield Finding(table, words, related=(("target",),))


def check_target_sight(mission: Mission) -> Iterator[Finding]:
    """Robots that can see exist, looks are whole steps apart, and the estimator gets what it needs."""
    scenario = mission.scenario
    knowledge = scenario.knowledge
    if knowledge is None:
        return
    path: Path = ("knowledge", "target")
    for words, key, _ in robots_known(knowledge.target.robots or (), mission.count, "robots"):
        yield Finding((*path, *key), words)
    yield from _seers(scenario, (*path, "robots"))
    yield from whole_steps(scenario, (*path, "rate"), knowledge.target.rate)
    yield from _needs(knowledge, (*path, "measures"))
    if knowledge.target.field_of_view is not None:
        yield from _headings(scenario, (*path, "field_of_view"), knowledge.target)


def _seers(scenario: Scenario, path: Path) -> Iterator[Finding]:
    """In each team some robot can see its targets, at the start."""
    assert scenario.knowledge is not None
    robots = scenario.knowledge.target.robots
    if robots is None or max(robots) > robot_count(scenario):
        return
    for index, team in enumerate(scenario.teams):
        if {*team.robots}.isdisjoint(robots):
            members = listed([*map(str, team.robots)])
            words = f"found no robot of team {team.name}; expected one at least: {members}"
            yield Finding(path, words, related=(("teams", index, "robots"),))


def _headings(scenario: Scenario, path: Path, sight: TargetSight) -> Iterator[Finding]:
    """Robots with a field of view have a heading."""
    kinds = kinds_of(scenario)
    headless = [robot for robot, kind in enumerate(kinds, 1) if not kind.has_heading]
    if wrong := [robot for robot in headless if sight.robots is None or robot in sight.robots]:
        kind = kinds[wrong[0] - 1].kind
        words = f"found {sight.field_of_view:g} rad; robot {wrong[0]} is a {kind}, {HEADLESS}"
        yield Finding(path, words, related=(("robots",),))


def _needs(knowledge: Knowledge, path: Path) -> Iterator[Finding]:
    """The estimator gets one of the sets of quantities that it needs; nothing is measured twice."""
    measures, estimator = knowledge.target.measures, knowledge.estimator
    if len(set(measures)) < len(measures):
        yield Finding(path, f"found {', '.join(measures)}; expected each once")
    if not any(set(needed) <= set(measures) for needed in estimator.needs):
        allowed = " or ".join(" and ".join(needed) for needed in estimator.needs)
        words = f"found {', '.join(measures)}; the estimator {estimator.estimator} needs {allowed}"
        yield Finding(path, words, related=(("knowledge", "estimator"),))


def check_communication(mission: Mission) -> Iterator[Finding]:
    """Messages are whole steps apart, and no more of them are kept than memory holds."""
    scenario = mission.scenario
    communication = scenario.communication
    if communication is None:
        return
    path: Path = ("communication",)
    for rate in communication.rates:
        yield from whole_steps(scenario, (*path, rate), getattr(communication, rate))
    for time in communication.times:
        yield from whole_time(scenario, (*path, time), getattr(communication, time))
    yield from _on_their_way(scenario, path)


def _on_their_way(scenario: Scenario, path: Path) -> Iterator[Finding]:
    """No more messages are on their way at once than memory holds."""
    communication, count = scenario.communication, robot_count(scenario)
    assert communication is not None
    timestep = scenario.physics.timestep
    depth = communication.longest / max(communication.period(timestep, count), timestep) + 2.0
    slots = communication.senders(count).shape[1]
    bids = 2.0 * count * any(behavior.bids for _, behavior in behaviors_of(scenario))
    size = 8.0 * depth * count * (slots + 8.0 * scenario.axes**2 + bids)
    if depth > MOST_ON_THEIR_WAY or size > MAX_LINKS:
        most = min(MOST_ON_THEIR_WAY, MAX_LINKS / size * depth)
        words = f"found up to {depth:.4g} messages of each robot on their way; expected at most {most:.4g}"
        rates = tuple((*path, rate) for rate in communication.rates)
        lower = listed(["delay", *communication.rates])
        yield Finding((*path, "delay"), f"{words}: lower {lower} (a delay is in seconds)", related=rates)


def whole_steps(scenario: Scenario, path: Path, rate: float | None) -> Iterator[Finding]:
    """A rate with a whole number of physics steps from one event to the next."""
    if rate is None:
        return
    timestep = scenario.physics.timestep
    steps = 1.0 / (rate * timestep)
    if steps < 1.0 - 1e-6 or not math.isclose(steps, round(steps), rel_tol=1e-6):
        near = sorted({1.0 / (max(whole, 1) * timestep) for whole in (math.floor(steps), math.ceil(steps))})
        yield Finding(
            path,
            f"found {rate:g} per second, {steps:.6g} steps of {timestep:g} s apart; expected a whole number "
            f"of steps, as with {' or '.join(f'{value:.9g}' for value in near)}",
            related=(("physics", "timestep"),),
        )


def whole_time(scenario: Scenario, path: Path, time: float) -> Iterator[Finding]:
    """A time of a whole number of physics steps."""
    timestep = scenario.physics.timestep
    steps = time / timestep
    if not math.isclose(steps, round(steps), rel_tol=1e-6, abs_tol=1e-9):
        near = sorted({timestep * whole for whole in (math.floor(steps), math.ceil(steps))})
        yield Finding(
            path,
            f"found {time:g} s, {steps:.6g} steps of {timestep:g} s; expected a whole number "
            f"of steps, as with {' or '.join(f'{value:.9g}' for value in near)} s",
            related=(("physics", "timestep"),),
        )
