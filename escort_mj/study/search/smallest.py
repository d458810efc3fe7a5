"""A scenario that fails, made as small as it goes: the fewest bodies and keys with which it fails alike."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from escort_mj.errors import EscortError, UsageError
from escort_mj.mission import Flight, fly
from escort_mj.progress import Progress, unseen
from escort_mj.record.folder import STUDY, RunFolder
from escort_mj.scenario import Scenario
from escort_mj.scenario.findings import Path as KeyPath
from escort_mj.scenario.geometry.placement import team
from escort_mj.scenario.reader.dump import differing
from escort_mj.scenario.reader.load import scenario_of

KEPT = {
    ("version",),
    ("name",),
    ("description",),
    ("plugins",),
    ("duration",),
    ("robots",),
    ("robots", "positions"),
}
"""What is not left out as a whole: its default would be another mission, not a smaller one."""
DIGITS = (1, 2, 3)  # of numbers, the fewest that do


@dataclass(frozen=True)
class Shrunk:
    """A scenario that was shrunk.

    Attributes:
        broken: The verdict that fails, in words: before, and after.
        scenario: The smallest scenario found.
        folder: Its run folder; scenario.yaml in it is the scenario.
        message: What its run says of the verdict.
        robots: Number of robots before and after.
        obstacles: Number of obstacles in the scenario's list, likewise.
        duration: Likewise [s].
        keys: Number of values that are not at their default, likewise.
        runs: Runs that were made.
        finished: Whether nothing more could be left out; false where the runs were used up.
    """

    broken: str
    scenario: Scenario
    folder: Path
    message: str
    robots: tuple[int, int]
    obstacles: tuple[int, int]
    duration: tuple[float, float]
    keys: tuple[int, int]
    runs: int
    finished: bool


def shrink_scenario(scenario: Scenario, out: Path, most: int = 200, progress: Progress = unseen) -> Shrunk:
    """Shrink a scenario that fails, and keep the same verdict failing.

    The end of the run is cut to the moment of the failure; starts that are drawn become positions; then
    everything that is not needed is left out, the largest parts first: tables, bodies, keys; then numbers
    lose the digits that they do not need.

    Args:
        scenario: It fails as it stands, with its own seed.
        out: Run folder of the result.
        most: Runs that may be made.
        progress: Called with the runs made and the most that may be.

    Raises:
        UsageError: If it does not fail.
    """
    search = _Search(scenario, most, progress)
    search.cut_end()
    search.place_robots()
    search.leave_out()
    search.shorten_numbers()
    small = search.small.replace(
        name=f"{scenario.name[:70]}-small",
        description=f"Made by escort-mj shrink: {search.broken}"[:2000],
    )
    with RunFolder.create(out, STUDY) as folder:
        run = fly(small, folder)
    message = next(one.message for one in run.verdicts if one.title == search.broken)
    pairs = [(team(one), one) for one in (scenario, small)]
    return Shrunk(
        search.broken,
        small,
        folder.path,
        message,
        (len(pairs[0][0].mass), len(pairs[1][0].mass)),
        (len(scenario.obstacles), len(small.obstacles)),
        (scenario.duration, small.duration),
        (_count(differing(scenario)), _count(differing(small))),
        search.runs,
        search.runs < most,
    )


class _Search:
    """The smallest scenario so far, and what is tried on it."""

    def __init__(self, scenario: Scenario, most: int, progress: Progress) -> None:
        self.most, self.progress, self.runs = most, progress, 0
        self.kind = type(scenario)
        run = self._fly(scenario)
        failed = [one for one in run.verdicts if not one.passed]
        if not failed:
            words = f"passes with seed {scenario.seed}: there is nothing to shrink"
            raise UsageError(f"{scenario.name}: {words}; --set seed=NUMBER chooses another seed")
        first = min(failed, key=lambda one: math.inf if one.time is None else one.time)
        if not run.verdicts[0].passed:
            first = run.verdicts[0]  # how it ended
        self.broken, self.moment, self.small = first.title, first.time, scenario
        self.valued = first.value is not None
        self.data: dict[str, Any] = copy.deepcopy(differing(scenario))  # what it has beside its defaults
        if first.expectation is not None:
            self._try(self.data | {"expect": [self.data["expect"][first.expectation]]})

    def cut_end(self) -> None:
        """Cut the run to the moment of the failure, where it fails there then, too."""
        if self.moment is None:
            return
        end = math.ceil((self.moment + 1.0 / self.small.recording.rate) * 10.0) / 10.0
        if end < self.small.duration:
            self._try(self.data | {"duration": end}, at=self.moment)

    def place_robots(self) -> None:
        """Write starts that are drawn as positions, so that single robots can be left out."""
        if self.small.robots.positions is None:
            drawn = ("placement", "count")
            robots = {key: one for key, one in self.data.get("robots", {}).items() if key not in drawn}
            self._try(self.data | {"robots": robots | {"positions": team(self.small).position.tolist()}})

    def leave_out(self) -> None:
        """Leave out whatever is not needed, until nothing more can be."""
        changed = True
        while changed:
            changed = False
            for path in sorted(_paths(self.data), key=len):
                if path in set(_paths(self.data)) and self._try(_without(self.data, path)):
                    changed = True

    def shorten_numbers(self) -> None:
        """Round numbers to the fewest digits with which it fails."""
        for path in list(_paths(self.data)):
            value = _at(self.data, path)
            if not isinstance(value, float):
                continue
            for digits in DIGITS:
                shorter = float(f"{value:.{digits}g}")
                if shorter == value or self._try(_with(self.data, path, shorter)):
                    break

    def _try(self, data: dict[str, Any], at: float | None = None) -> bool:
        """Take a candidate if its run fails alike; at the same moment, where one is given [s]."""
        if self.runs >= self.most:
            return False
        try:
            scenario = scenario_of(data, kind=self.kind)
            run = self._fly(scenario)
        except EscortError:
            return False  # nothing that can be run
        for one in run.verdicts:
            alike = one.title == self.broken and (one.value is not None) == self.valued
            if alike and not one.passed and (at is None or one.time == at):
                self.data, self.small = data, scenario
                return True
        return False

    def _fly(self, scenario: Scenario) -> Flight:
        self.runs += 1
        self.progress(self.runs, self.most)
        return fly(scenario)


def _paths(data: Any, path: KeyPath = ()) -> Iterator[KeyPath]:
    """Every key and item of nested tables and lists that may be left out or rounded, outer ones first."""
    inner = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in reversed(list(inner)):
        if (here := (*path, key)) == ("expect",):
            continue
        if here not in KEPT:
            yield here
        yield from _paths(value, here)


def _at(data: Any, path: KeyPath) -> Any:
    for key in path:
        data = data[key]
    return data


def _without(data: dict[str, Any], path: KeyPath) -> dict[str, Any]:
    """The data without one key or item."""
    changed = copy.deepcopy(data)
    del _at(changed, path[:-1])[path[-1]]
    return changed


def _with(data: dict[str, Any], path: KeyPath, value: Any) -> dict[str, Any]:
    """The data with another value at one place."""
    changed = copy.deepcopy(data)
    _at(changed, path[:-1])[path[-1]] = value
    return changed


def _count(data: Any) -> int:
    """How many single values there are in nested tables and lists."""
    if isinstance(data, dict):
        return sum(map(_count, data.values()))
    return sum(map(_count, data)) if isinstance(data, list) else 1


def shrunk_lines(found: Shrunk) -> list[str]:
    """What is to be said of a scenario that was shrunk, for a terminal."""
    parts = (("robots", found.robots), ("obstacles", found.obstacles), ("keys", found.keys))
    told = [f"{before} -> {after} {name}" for name, (before, after) in parts if before or after]
    told.append(f"{found.duration[0]:g} -> {found.duration[1]:g} s")
    ended = "" if found.finished else "; the runs are used up, more may take it further (--runs)"
    return [f"FAIL: {found.message}", f"  {', '.join(told)}, after {found.runs} runs{ended}"]
