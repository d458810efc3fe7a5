"""Checks of failures: of robots that exist, within the mission, and survivable by the formation."""

from __future__ import annotations

from collections.abc import Iterator

from escort_mj.behaviors import Chords
from escort_mj.scenario.checks.mission import behaviors_of
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.mission import Mission


def check_failures(mission: Mission) -> Iterator[Finding]:
    """Each robot fails at most once, in time and with a force; some robot and its formation stay."""
    scenario = mission.scenario
    robots, count = scenario.robots, mission.count
    if not robots.failures:
        return
    limits = {o.robot: o.force_limit for o in robots.overrides if o.force_limit is not None}
    first: dict[int, int] = {}
    for index, failure in enumerate(robots.failures):
        path: Path = ("robots", "failures", index)
        if failure.robot > count:
            yield Finding((*path, "robot"), f"found robot {failure.robot}; expected 1 to {count}")
        elif failure.robot in first:
            yield Finding(
                (*path, "robot"),
                f"found robot {failure.robot} again; failures[{first[failure.robot]}] has it",
            )
        first.setdefault(failure.robot, index)
        if failure.at >= scenario.duration:
            words = f"found {failure.at:g} s; the run ends at {scenario.duration:g} s"
            yield Finding((*path, "at"), words, late=f"it comes at {failure.at:g} s")
        for words in failure.misfits(limits.get(failure.robot, robots.force_limit)):
            yield Finding(path, words)
    if len(first) >= count and max(first) <= count:
        yield Finding(
            ("robots", "failures"), f"found a failure of each of {count} robots; at least one must stay"
        )
    for path, behavior in behaviors_of(scenario):
        if isinstance(behavior, Chords) and scenario.axes != 2:
            yield Finding(
                path,
                f"chords has no formation in {scenario.axes} axes for the robots that failures leave; "
                "expected vertices in its place",
                related=(("robots", "failures"),),
            )
