"""Checks of expectations: bounds that a value can meet, windows that the run reaches, sides that can meet."""

from __future__ import annotations

from collections.abc import Iterator

from escort_mj.expectations.expectation import Expectation, Sides
from escort_mj.expectations.outcome import OutcomeExpectation
from escort_mj.monitor.signals import FLOOR, GROUPS, ROBOTS, TARGET
from escort_mj.numerics.steps import first_step, last_step
from escort_mj.scenario.findings import Finding, Path, did_you_mean, shown
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario

MOST_NAMES = 8  # listed in a message
GOALS = "robots have no goals"
SPEED = "there is no speed limit (mission.max_speed)"
OPPONENTS = "there are no opponents"
BELIEFS = "all robots know what the team's sensors show (knowledge, communication)"
MESSAGES = "robots do not communicate (communication)"
TETHERS = "no robot is on a tether (robots.tethers)"
LINKS = "robots do not communicate, and see each other at any distance (communication, sensing.radius.robots)"
TRUTH = "the truth is not recorded (recording.truth)"
LYAPUNOV = "not all robots have one sliding-mode law (controller), whose Lyapunov function it is"
NEEDS: dict[str, tuple[str, ...]] = (
    dict.fromkeys(
        ("reached", "goal_distance_max", "arrival_time", "arrived", "stuck", "success_by_path_length"),
        (GOALS,),
    )
    | dict.fromkeys(
        ("opponents_intercepted", "opponents_breached", "threat_time_min", "opponents_energy"), (OPPONENTS,)
    )
    | dict.fromkeys(
        ("estimate_error_rms", "disagreement_max", "information_age_max", "estimate_consistency"), (BELIEFS,)
    )
    | dict.fromkeys(
        ("message_rate", "messages_lost_share", "connectivity_min", "disconnected_time"), (MESSAGES,)
    )
    | dict.fromkeys(("union", "connectivity"), (LINKS,))
    | dict.fromkeys(
        ("mass_eigenvalue_min", "mass_eigenvalue_max", "skew_residual", "coriolis_residual"), (TRUTH,)
    )
    | dict.fromkeys(("lyapunov_rise", "lyapunov_unexplained"), (TRUTH, LYAPUNOV))
)
"""What metrics and expectations need, by their names, in the words for its lack."""
NEEDS["extra_time_to_goal"] = (GOALS, SPEED)
NEEDS["tether_stretch_max"] = (TETHERS,)


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
    there = {
        GOALS: any(behavior.arrives_within for stack in stacks for behavior in stack),
        TETHERS: bool(scenario.robots.tethers),
        SPEED: scenario.mission.max_speed is not None,
        OPPONENTS: bool(scenario.opponents),
        BELIEFS: scenario.knowledge is not None or scenario.communication is not None,
        MESSAGES: scenario.communication is not None,
        LINKS: scenario.communication is not None or scenario.sensing.radius.robots is not None,
        TRUTH: scenario.recording.truth,
        LYAPUNOV: len(scenario.laws) == 1 and scenario.laws[0].has_lyapunov,
    }
    for index, expectation in enumerate(scenario.expect):
        name = getattr(expectation, "metric", expectation.kind)
        lacking = [needed for needed in NEEDS.get(name, ()) if not there[needed]]
        if lacking and expectation.skip is None:
            key = "metric" if name != expectation.kind else expectation.kind
            yield Finding(("expect", index, key), f"found {name}, but {lacking[0]}: it would have no value")


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
