"""Checks of expectations: bounds that a value can meet, windows that the run reaches, sides that can meet."""

from __future__ import annotations

from collections.abc import Iterator

from escort_mj.expectations.expectation import Expectation, Sides
from escort_mj.expectations.outcome import OutcomeExpectation
from escort_mj.metrics.metric import Need
from escort_mj.monitor.signals import FLOOR, GROUPS, ROBOTS, TARGET
from escort_mj.numerics.steps import first_step, last_step
from escort_mj.scenario.findings import Finding, Path, did_you_mean, shown
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario

MOST_NAMES = 8  # listed in a message
LACKS: dict[Need, str] = {
    "beliefs": "all robots know what the team's sensors show (knowledge, communication)",
    "goals": "robots have no goals",
    "links": "robots do not communicate, and see each other at any distance "
    "(communication, sensing.radius.robots)",
    "max_speed": "there is no speed limit (mission.max_speed)",
    "messages": "robots do not communicate (communication)",
    "opponents": "there are no opponents",
    "sliding_mode": "not all robots have one sliding-mode law (controller), whose Lyapunov function it is",
    "target": "there is no target (target: null)",
    "tethers": "no robot is on a tether (robots.tethers)",
    "truth": "the truth is not recorded (recording.truth)",
}
"""Words for what a mission lacks."""


def check_bounds(mission: Mission) -> Iterator[Finding]:
    """Each expectation has bounds, and a value can meet them and can fail to."""
    endings = [i for i, e in enumerate(mission.scenario.expect) if isinstance(e, OutcomeExpectation)]
    for again in endings[1:]:
        yield Finding(("expect", again, "outcome"), f"found a second ending; expect[{endings[0]}] has one")
    for index, expectation in enumerate(mission.scenario.expect):
        path: Path = ("expect", index)
        yield from (Finding((*path, *key), message) for key, message in expectation.faults())


def check_windows(mission: Mission) -> Iterator[Finding]:
    """Each expectation's window holds a physics step, and the run reaches it."""
    scenario = mission.scenario
    timestep = scenario.physics.timestep
    for index, expectation in enumerate(scenario.expect):
        if expectation.skip is not None:
            continue
        path: Path = ("expect", index)
        start, stop = expectation.window_in(scenario.duration)
        key = expectation.window_key
        end = scenario.duration if stop is None else stop
        if stop is not None and stop <= start:
            yield Finding(path, f"its window is empty: {key} {start:g} s and before {stop:g} s")
        elif end > scenario.duration or start >= scenario.duration:
            begins = start >= scenario.duration
            yield Finding(
                (*path, "before" if end > scenario.duration else key),
                f"found {max(end, start):g} s; the run ends at {scenario.duration:g} s",
                related=(("duration",),) if start else (),
                late=f"its window {f'begins at {start:g}' if begins else f'ends at {end:g}'} s",
            )
        elif first_step(start, timestep) > last_step(end, timestep):
            yield Finding(
                path,
                f"its window holds no physics step: {key} {start:g} s and before {end:g} s, "
                f"with steps of {timestep:g} s",
                related=(("physics", "timestep"),),
            )


def check_told(mission: Mission) -> Iterator[Finding]:
    """What expectations measure is there: goals, opponents, what robots know and say, the truth."""
    scenario = mission.scenario
    stacks = [scenario.mission.behaviors, *(phase.behaviors for phase in scenario.mission.supervisor)]
    there: dict[Need, bool] = {
        "beliefs": scenario.knowledge is not None or scenario.communication is not None,
        "goals": any(behavior.arrives_within for stack in stacks for behavior in stack),
        "links": scenario.communication is not None or scenario.sensing.radius.robots is not None,
        "max_speed": scenario.mission.max_speed is not None,
        "messages": scenario.communication is not None,
        "opponents": bool(scenario.opponents),
        "sliding_mode": len(scenario.laws) == 1 and scenario.laws[0].has_lyapunov,
        "target": scenario.target is not None or bool(scenario.teams),
        "tethers": bool(scenario.robots.tethers),
        "truth": scenario.recording.truth,
    }
    for index, expectation in enumerate(scenario.expect):
        lacking = [need for need in expectation.needs if not there[need]]
        if lacking and expectation.skip is None:
            name = getattr(expectation, "metric", expectation.kind)
            words = f"found {name}, but {LACKS[lacking[0]]}: it would have no value"
            yield Finding(("expect", index, expectation.kind), words)


def check_sides(mission: Mission) -> Iterator[Finding]:
    """Both sides of a pair are in this scenario, and can meet."""
    scenario = mission.scenario
    bodies = mission.bodies
    known = dict(zip(bodies.names, bodies.groups, strict=True))
    if scenario.axes != 2:
        del known[FLOOR]
    if scenario.target is None:
        del known[TARGET]
    aloof = [f"robot_{i}" for i, kind in enumerate(mission.kinds, 1) if kind.passes_floor]
    aloof += [TARGET] * (scenario.target is not None and scenario.target.drive is None)
    for index, expectation in enumerate(scenario.expect):
        sides = expectation.named_sides
        if sides is None:
            continue
        path: Path = ("expect", index, expectation.kind)
        wrong = {place: message for place, side in enumerate(sides) if (message := _side(side, known))}
        yield from (Finding((*path, place), message) for place, message in wrong.items())
        if not wrong and (message := _impossible(expectation, sides, known, aloof)):
            yield Finding(path, message)


def _members(side: str, known: dict[str, str]) -> set[str]:
    """Names of the bodies of a side."""
    return {name for name, group in known.items() if side in (name, group)}


def _side(side: str, known: dict[str, str]) -> str:
    """What is wrong with a side; empty if nothing is."""
    if _members(side, known):
        return ""
    groups = (*GROUPS, FLOOR)
    if side in groups:
        return f"found {side}; this scenario has none"
    robots = sum(group == ROBOTS for group in known.values())
    others = [name for name, group in known.items() if name != group and group != ROBOTS]
    names = [f"robot_1 to robot_{robots}" if robots > 1 else "robot_1", *others[:MOST_NAMES]]
    more = f" ... ({len(others) - MOST_NAMES} more)" if len(others) > MOST_NAMES else ""
    return (
        f"found {shown(side)}; expected a group ({', '.join(groups)}) or a body ({', '.join(names)}{more})"
        + did_you_mean(side, (*groups, *known))
    )


def _impossible(expectation: Expectation, sides: Sides, known: dict[str, str], aloof: list[str]) -> str:
    """Why two sides cannot meet; empty if they can."""
    bodies = {name for side in sides for name in _members(side, known)}
    if len(bodies) < 2:
        return f"found nothing but {bodies.pop()}, which cannot meet itself"
    if not expectation.of_floor and FLOOR in sides:
        return f"found the floor; clearances are measured between {', '.join(GROUPS)} and bodies of these"
    if FLOOR in sides and (one := next((name for name in aloof if name in bodies), "")):
        return f"found the floor, which {one} never touches: it is led (without a body), or joints hold it up"
    if not any(known[name] in (ROBOTS, TARGET) for name in bodies):
        return f"found {sides[0]} and {sides[1]}; expected robots or the target on one side at least"
    return ""


def notes(scenario: Scenario) -> list[str]:
    """Return what to know of expectations that see nothing between samples, one line each."""
    apart = 1.0 / scenario.recording.rate
    if apart < 1.5 * scenario.physics.timestep:
        return []
    blind = (
        (index, one)
        for index, one in enumerate(scenario.expect)
        if one.skip is None and one.reads_samples and not one.watches
    )
    return [
        f"expect[{index}]: {one.subject} is judged at samples of {apart:.6g} s (recording.rate)"
        for index, one in blind
    ]
