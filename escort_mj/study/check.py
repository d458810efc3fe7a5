"""Scenarios checked side by side: each one run, judged, and told apart from those that cannot run."""

from __future__ import annotations

import shutil
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from escort_mj import stopping
from escort_mj.errors import EscortError, Fault, ScenarioError
from escort_mj.mission import Flight, fly
from escort_mj.record.folder import CHECK, free_place
from escort_mj.scenario import load_file
from escort_mj.scenario.reader.load import expectation_lines
from escort_mj.study.checked import BROKEN, GOOD, Case, Checked, with_faults_once
from escort_mj.study.engine.parallel import cores, side_by_side
from escort_mj.study.engine.work import fly_keeping, kept_of

Progress = Callable[[float, float], None]
Clip = Callable[[Path], Path]


class CheckJob(NamedTuple):
    """One scenario to check, and what to leave of it.

    Attributes:
        case: Which.
        folder: Its run folder; None keeps nothing on disk.
        keep: Whether a run that passes leaves its folder, too.
        clip: Draws a clip of a run that fails, from its folder; None for no clip.
    """

    case: Case
    folder: Path | None
    keep: bool
    clip: Clip | None


def check_scenarios(
    cases: Sequence[Case],
    out: Path,
    workers: int | None = None,
    keep: bool = False,
    clip: Clip | None = None,
    progress: Progress | None = None,
) -> list[Checked]:
    """Runs and judges scenarios side by side, in other processes: one that crashes costs its row alone.

    Args:
        cases: What to check.
        out: Folder for the run folders of those that fail.
        workers: Processes; None for one per core.
        keep: Whether runs that pass leave their folder, too.
        clip: Draws a short video around the worst moment of each that fails and returns its file; None for no
            clips. Of the top level of a module, since other processes call it.
        progress: Called with the scenarios done and to do.

    Returns:
        One result per case, in their order; one for all seeds of a scenario that is wrong whatever the seed.
    """
    tasks = [CheckJob(case, out / case.name, keep, clip) for case in cases]
    checked = 0

    def note(done: float, total: float) -> None:
        nonlocal checked
        checked = int(done)
        if progress is not None:
            progress(done, total)

    with stopping.keeping(
        lambda: f"{checked} of {len(cases)} scenarios had been checked; the same command checks all again"
    ):
        results = side_by_side(perform_check, tasks, workers or cores(), note, crashed)
    return with_faults_once(results)


def crashed(task: CheckJob, cause: str) -> Checked:
    """The result of a scenario that kills every process that checks it."""
    words = f"the process that ran it died each time: {cause}"
    if "while this was called" not in cause and "takes longer than" not in cause:
        words += " (a plugin that crashes, no memory, a full disk?)"
    folder = None if task.folder is None else free_place(task.folder, CHECK)
    kept = folder if folder is not None and folder.is_dir() else None
    return Checked(task.case, seed=task.case.seed, error=words + kept_of(kept), folder=kept)


def perform_check(task: CheckJob) -> Checked:
    """Check one scenario, and draw a clip if it fails."""
    result = check_one(task.case, task.folder, task.keep)
    if task.clip is None or result.folder is None or result.code == GOOD or not result.verdicts:
        return result
    try:
        return replace(result, clip=task.clip(result.folder))
    except EscortError as error:
        return replace(result, note=f"no clip: {error}")


def check_one(case: Case, folder: Path | None = None, keep: bool = False) -> Checked:
    """Run and evaluate one scenario. Errors are part of the result.

    Args:
        case: Which.
        folder: Its run folder; None keeps nothing on disk. A run that no check has made stays there: this one
            goes to a folder beside it.
        keep: Whether a run that passes leaves its folder, too.
    """
    clock = time.perf_counter()
    bare = Checked(case, seed=case.seed)
    try:
        if case.fault:
            raise ScenarioError([Fault(case.fault)])
        folder = None if folder is None else free_place(folder, CHECK)
        result = _fly(case, folder, keep)
    except ScenarioError as error:
        return replace(bare, faults=error.faults, wall_time=time.perf_counter() - clock)
    except EscortError as error:
        if error.exit_code == BROKEN:
            result = replace(bare, error=str(error), folder=folder)
        else:
            result = replace(bare, faults=(Fault(str(error)),))
    except Exception:
        stopping.raise_if_interrupted()
        result = replace(bare, error=traceback.format_exc().strip(), folder=folder)
    if folder is not None and result.code == GOOD and not keep:
        shutil.rmtree(folder, ignore_errors=True)
        result = replace(result, folder=None)
    return replace(result, wall_time=time.perf_counter() - clock)


def _fly(case: Case, folder: Path | None, keep: bool) -> Checked:
    """Run a scenario as often as asked.

    Raises:
        EscortError: If the scenario or the folder is wrong.
    """
    scenario = load_file(case.path, case.settings, case.plugins)
    run = fly_keeping(scenario, folder, CHECK, keep or case.repeat > 1)
    first = signal_that_differs(run, [fly(scenario) for _ in range(1, case.repeat)])
    return Checked(
        case,
        name=scenario.name,
        seed=scenario.seed,
        outcome=run.outcome.value,
        message=run.message,
        verdicts=run.verdicts,
        lines=[] if _replaces_expectations(case) else expectation_lines(case.path),
        folder=folder,
        error=f"the runs of one seed have different bits, first in {first}" if first else "",
    )


def _replaces_expectations(case: Case) -> bool:
    return any(text.startswith("expect") for text in case.overrides)


def signal_that_differs(run: Flight, others: Sequence[Flight]) -> str:
    """Return the first signal in which a run differs from others, bit by bit; empty if there is none."""
    for other in (each.recording for each in others):
        assert run.recording is not None and other is not None, "single runs keep their recording"
        for name, variable in run.recording.data_vars.items():
            if variable.values.tobytes() != other.data_vars[name].values.tobytes():
                return str(name)
    return ""
