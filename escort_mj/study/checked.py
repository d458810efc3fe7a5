"""What came of scenarios that were checked: their verdicts, what is wrong with them, and exit codes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from escort_mj.errors import Fault
from escort_mj.expect.verdicts import Verdict

GOOD, VERDICT_FAILED, BAD_INPUT, BROKEN = 0, 1, 2, 3


class Case(NamedTuple):
    """A scenario to check.

    Attributes:
        path: Its file.
        label: What to call it; also its run folder's place in that of all runs.
        fault: Why it cannot be found; empty where it can.
        overrides: Texts `key.path=value` that replace values of the file.
        plugins: Plugins beside those that it names.
        later: Which seed: so many after the scenario's own.
        repeat: How many runs it takes; all of them must have the same bits.
    """

    path: Path
    label: str
    fault: str = ""
    overrides: tuple[str, ...] = ()
    plugins: tuple[str, ...] = ()
    later: int = 0
    repeat: int = 1


def with_seeds(cases: Sequence[Case], count: int) -> list[Case]:
    """Return each case with so many seeds, from the scenario's own upward, each with a label of its own."""
    if count == 1:
        return list(cases)
    width = len(str(count))
    return [
        case._replace(label=f"{case.label}-seed-{k + 1:0{width}}", later=k)
        for case in cases
        for k in range(1 if case.fault else count)
    ]


@dataclass(frozen=True)
class Checked:
    """What came of a scenario.

    Attributes:
        path: Its file.
        label: What it is called.
        name: The scenario's own name; empty where it could not be read.
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

    path: Path
    label: str
    name: str = ""
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
