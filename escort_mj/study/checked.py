"""What came of scenarios that were checked: their verdicts, what is wrong with them, and exit codes."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from escort_mj.errors import EscortError, Fault
from escort_mj.record.outcome import Verdict
from escort_mj.scenario.reader.load import Template, read_text
from escort_mj.scenario.schema.scenario import Scenario

GOOD, VERDICT_FAILED, BAD_INPUT, BROKEN = 0, 1, 2, 3


class Case(NamedTuple):
    """A scenario to check.

    Attributes:
        path: Its file.
        label: What to call it; also its run folder's place in that of all runs.
        fault: Why it cannot be found; empty where it can.
        overrides: Texts `key.path=value` that replace values of the file.
        plugins: Plugins beside those that it names.
        seed: The run's seed; None for the scenario's own.
        repeat: How many runs it takes; all of them must have the same bits.
    """

    path: Path
    label: str
    fault: str = ""
    overrides: tuple[str, ...] = ()
    plugins: tuple[str, ...] = ()
    seed: int | None = None
    repeat: int = 1

    @property
    def name(self) -> str:
        """What to call the run: its scenario's label and, where the seed was chosen, its seed."""
        return self.label if self.seed is None else f"{self.label}-seed-{self.seed}"

    @property
    def settings(self) -> tuple[str, ...]:
        """All that replaces values of the file, the seed among it."""
        if self.seed is None:
            return self.overrides
        others = [text for text in self.overrides if text.partition("=")[0].strip() != "seed"]
        return (*others, f"seed={self.seed}")

    @property
    def command(self) -> str:
        """The command that makes this run alone."""
        settings = [word for text in self.settings for word in ("--set", text)]
        plugins = [word for text in self.plugins for word in ("--plugin", text)]
        return shlex.join(["escort-mj", "run", str(self.path), *settings, *plugins])


def with_seeds(cases: Sequence[Case], count: int) -> list[Case]:
    """Return each case with so many seeds, from the scenario's own upward.

    A case that cannot be read stays alone: it has no seed, and its check says why.
    """
    if count == 1:
        return list(cases)
    seeds = [own_facts(case).seed for case in cases]
    return [
        case if first is None else case._replace(seed=first + k)
        for case, first in zip(cases, seeds, strict=True)
        for k in range(1 if first is None else count)
    ]


class OwnFacts(NamedTuple):
    """What a case has by itself, its overrides included: its seed, None where it cannot be read; its name."""

    seed: int | None
    name: str


@lru_cache(maxsize=1024)
def own_facts(case: Case) -> OwnFacts:
    """Return the seed and the name that a case has by itself."""
    if case.fault:
        return OwnFacts(None, "")
    try:
        found = Template(read_text(case.path), str(case.path)).overridden(case.overrides)
    except EscortError:
        return OwnFacts(None, "")
    seed, name = (
        Scenario.model_fields[key].default if found.get(key) is None else found[key]
        for key in ("seed", "name")
    )
    whole = isinstance(seed, int) and not isinstance(seed, bool) and seed >= 0
    return OwnFacts(seed if whole else None, str(name))


@dataclass(frozen=True)
class Checked:
    """What came of a scenario.

    Attributes:
        case: What was checked.
        name: The scenario's own name; empty where it could not be read.
        seed: The run's seed; None where the scenario could not be read.
        outcome: How the run ended; empty where there was none.
        message: The same in words.
        verdicts: The outcome's, then one per expectation.
        lines: Line of each expectation in the file, from 1.
        wall_time: What it took [s].
        faults: What is wrong with the file.
        error: What broke in the program, with where it broke; empty if nothing did.
        folder: The run folder, where it was kept.
        clip: A short video around the worst moment, where there is one.
        note: Why there is no clip, where there should be one.
    """

    case: Case
    name: str = ""
    seed: int | None = None
    outcome: str = ""
    message: str = ""
    verdicts: list[Verdict] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    wall_time: float = 0.0
    faults: tuple[Fault, ...] = ()
    error: str = ""
    folder: Path | None = None
    clip: Path | None = None
    note: str = ""

    @property
    def path(self) -> Path:
        """The scenario's file."""
        return self.case.path

    @property
    def label(self) -> str:
        """What the run is called, see `Case.name`."""
        return self.case.name

    @property
    def code(self) -> int:
        """What it means to a shell, as exit codes do."""
        if self.faults:
            return BAD_INPUT
        if self.error or not self.verdicts[0].passed:
            return BROKEN
        return VERDICT_FAILED if self.failures else GOOD

    @property
    def failures(self) -> list[Verdict]:
        """The verdicts that failed."""
        return [verdict for verdict in self.verdicts if not verdict.passed]

    def line(self, verdict: Verdict) -> int:
        """Line of what a verdict is about; 1 where the file has none."""
        place = verdict.expectation
        return self.lines[place] if place is not None and place < len(self.lines) else 1


class SeedCount(NamedTuple):
    """The runs of one scenario, a run per seed.

    Attributes:
        label: What the scenario is called.
        results: What came of each seed.
    """

    label: str
    results: list[Checked]

    @property
    def passed(self) -> int:
        """How many of its runs pass."""
        return sum(result.code == GOOD for result in self.results)

    @property
    def failed(self) -> list[int]:
        """Seeds of the runs that do not pass."""
        return [result.seed for result in self.results if result.code != GOOD and result.seed is not None]

    @property
    def verdicts(self) -> list[SeedVerdicts]:
        """The verdicts of all its runs that were judged, expectation by expectation."""
        judged = [result for result in self.results if result.verdicts]
        return [
            SeedVerdicts([(result, result.verdicts[place]) for result in judged])
            for place in range(len(judged[0].verdicts) if judged else 0)
        ]


class SeedVerdicts(NamedTuple):
    """The verdicts on one expectation of a scenario.

    Attributes:
        each: The run and its verdict, seed by seed.
    """

    each: list[tuple[Checked, Verdict]]

    @property
    def failed(self) -> list[tuple[Checked, Verdict]]:
        """The runs in which it failed."""
        return [(result, verdict) for result, verdict in self.each if not verdict.passed]

    @property
    def near(self) -> list[tuple[Checked, Verdict]]:
        """The runs in which it nearly failed, the nearest first."""
        near = [(result, verdict) for result, verdict in self.each if verdict.passed and verdict.near_miss]
        return sorted(near, key=lambda one: math.inf if one[1].margin is None else one[1].margin)


def seed_counts(results: Iterable[Checked]) -> list[SeedCount]:
    """Return the results scenario by scenario."""
    by_label = groupby(results, key=lambda result: result.case.label)
    return [SeedCount(label, list(of_label)) for label, of_label in by_label]


def with_faults_once(results: Iterable[Checked]) -> list[Checked]:
    """Return the results, those of a scenario that is wrong in the same way for all its seeds as one."""
    kept = []
    for count in seed_counts(results):
        first = count.results[0]
        alike = first.faults and all(result.faults == first.faults for result in count.results)
        kept += [replace(first, case=first.case._replace(seed=None))] if alike else count.results
    return kept
