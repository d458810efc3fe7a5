"""Checks of failures: of robots that exist, within the mission, and survivable by the formation."""

from __future__ import annotations

from collections.abc import Iterator

from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.mission import Mission


def check_failures(mission: Mission) -> Iterator[Finding]:
    """Each robot fails at most once, and in time; some robot stays."""
    scenario = mission.scenario
    robots, count = scenario.robots, mission.count
    if not robots.failures:
        return
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
    if len(first) >= count and max(first) <= count:
        yield Finding(
            ("robots", "failures"), f"found a failure of each of {count} robots; at least one must stay"
        )
