"""Scenarios checked: each one run, judged, and told apart from those that cannot run."""

from __future__ import annotations

import shutil
import time
import traceback
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from escort_mj.errors import EscortError, Fault, ScenarioError
from escort_mj.expect.verdicts import Verdict
from escort_mj.mission import fly
from escort_mj.record.folder import RunFolder
from escort_mj.scenario import load_scenario
from escort_mj.scenario.reader.load import expectation_lines

GOOD, VERDICT_FAILED, BAD_INPUT, BROKEN = 0, 1, 2, 3


class Case(NamedTuple):
    """A scenario to check.

    Attributes:
        path: Its file.
        label: What to call it; also its run folder's place in that of all runs.
        fault: Why it cannot be found; empty where it can.
    """

    path: Path
    label: str
    fault: str = ""


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


def check_one(case: Case, folder: Path | None = None, keep: bool = False) -> Checked:
    """Runs and judges one scenario. Whatever goes wrong is part of the result.

    Args:
        case: Which.
        folder: Its run folder; None keeps nothing on disk.
        keep: Whether a run that passes leaves its folder, too.
    """
    clock = time.perf_counter()
    bare = Checked(case.path, case.label)
    try:
        if case.fault:
            raise ScenarioError([Fault(case.fault)])
        result = _fly(bare, folder)
    except ScenarioError as error:
        return replace(bare, faults=error.faults, wall_time=time.perf_counter() - clock)
    except EscortError as error:
        if error.exit_code == BROKEN:
            result = replace(bare, error=str(error), folder=folder)
        else:
            result = replace(bare, faults=(Fault(str(error)),))
    except Exception:
        result = replace(bare, error=traceback.format_exc().strip(), folder=folder)
    if folder is not None and result.code == GOOD and not keep:
        shutil.rmtree(folder, ignore_errors=True)
        result = replace(result, folder=None)
    return replace(result, wall_time=time.perf_counter() - clock)


def _fly(bare: Checked, folder: Path | None) -> Checked:
    """Runs a scenario.

    Raises:
        EscortError: If the scenario or the folder is wrong.
    """
    scenario = load_scenario(bare.path)
    if folder is None:
        run = fly(scenario)
    else:
        with RunFolder.create(folder) as writing:
            run = fly(scenario, writing)
    return replace(
        bare,
        name=scenario.name,
        outcome=run.outcome.value,
        message=run.message,
        verdicts=run.verdicts,
        lines=expectation_lines(bare.path),
        folder=folder,
    )
