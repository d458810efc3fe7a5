"""Scenarios checked: a study whose cells are scenarios, told apart by what is wrong, fails or breaks."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from escort_mj import stopping
from escort_mj.errors import EscortError, Fault, ScenarioError
from escort_mj.progress import Progress, unseen
from escort_mj.record.folder import CHECK, free_place
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.reader.load import expectation_lines, read_text
from escort_mj.study.checked import GOOD, Case, Checked, own_facts, with_faults_once
from escort_mj.study.engine.backends import Backend, here
from escort_mj.study.engine.parallel import Died, Workers, cores
from escort_mj.study.engine.store import Row, Store
from escort_mj.study.engine.work import Job, killed, perform
from escort_mj.study.sweeps.design import CASE, Cell, Planned
from escort_mj.study.sweeps.results import DesignRecord, Varied
from escort_mj.study.sweeps.sweep import make

DIGITS = 32  # of a run's key
Clip = Callable[[Path], Path]


class Drawing(NamedTuple):
    """A clip to be drawn: by what, and of which run folder."""

    clip: Clip
    folder: Path


def check_scenarios(
    cases: Sequence[Case],
    out: Path,
    workers: int | None = None,
    keep: bool = False,
    clip: Clip | None = None,
    progress: Progress = unseen,
) -> list[Checked]:
    """Runs and judges scenarios side by side, in other processes: one that crashes costs its row alone.

    Args:
        cases: What to check.
        out: Folder for the results, and for the run folders of those that fail.
        workers: Processes; None for one per core.
        keep: Whether runs that pass leave their folder, too.
        clip: Draws a short video around the worst moment of each that fails and returns its file; None for no
            clips. Of the top level of a module, since other processes call it.
        progress: Called with the scenarios done and to do.

    Returns:
        One result per case, in their order; one for all seeds of a scenario that is wrong whatever the seed.

    Raises:
        UsageError: If the folder holds something else.
    """
    done = 0

    def note(now: float, total: float) -> None:
        nonlocal done
        done = int(now)
        progress(now, total)

    def kept() -> str:
        return f"{done} of {len(cases)} scenarios had been checked; the same command checks all again"

    with stopping.keeping(kept), Workers(min(workers or cores(), len(cases))) as pool, Store(out) as store:
        tasks = [_job(case, out, keep) for case in cases]
        jobs = [task for task in tasks if isinstance(task, Job)]
        store.forget(job.key for job in jobs)
        _write_design(cases, tasks, out)
        make(jobs, store, pool.compute, len(tasks), note)
        rows = store.get(job.key for job in jobs)
        results = [
            checked(case, task, rows[task.key]) if isinstance(task, Job) else task
            for case, task in zip(cases, tasks, strict=True)
        ]
        if clip is not None:
            results = with_clips(results, clip, pool.compute)
    return with_faults_once(results)


def check_alone(case: Case, folder: Path | None, clip: Clip | None = None, apart: bool = False) -> Checked:
    """Run and judge one scenario.

    Args:
        case: Which.
        folder: Its run folder, kept if it fails; None keeps nothing.
        clip: As for `check_scenarios`.
        apart: Whether another process runs it: what ends that one does not end this one.
    """
    task = _job(case, None if folder is None else folder.parent, False, "" if folder is None else folder.name)
    if not isinstance(task, Job):
        return task
    with Workers(1) as pool:
        backend = pool.compute if apart else here
        ((_, row),) = backend(perform, [task])
        result = checked(case, task, killed(task, row) if isinstance(row, Died) else row)
        return result if clip is None else with_clips([result], clip, backend)[0]


def _job(case: Case, out: Path | None, keep: bool, name: str = "") -> Job | Checked:
    """What a case takes to be run, or why it cannot be."""
    try:
        if case.fault:
            raise ScenarioError([Fault(case.fault)])
        text, seed = read_text(case.path), own_facts(case).seed if case.seed is None else case.seed
        folder = None if out is None else os.path.relpath(free_place(out / (name or case.name), CHECK), out)
    except ScenarioError as error:
        return Checked(case, seed=case.seed, faults=error.faults)
    except EscortError as error:
        return Checked(case, seed=case.seed, faults=(Fault(str(error)),))
    told = [case.label, str(case.path), text, case.settings, case.plugins, seed, case.repeat]
    key = hashlib.sha256(json.dumps(told).encode()).hexdigest()[:DIGITS]
    settings = {key.strip(): value for key, _, value in (text.partition("=") for text in case.overrides)}
    place = str(case.path)
    return Job(
        key, seed or 0, settings, text, place, out, folder, not keep,
        made_by=CHECK, overrides=case.settings, plugins=case.plugins, repeat=case.repeat,
    )  # fmt: skip


def checked(case: Case, job: Job, row: Row) -> Checked:
    """What came of a case, from the row of its run."""
    faults, verdicts = tuple(row.faults), row.verdicts
    place = job.place
    error = ""
    if not verdicts and not faults:
        error = row.message
        if row.outcome == Outcome.KILLED.value and "while this was called" not in error:
            error += " (a plugin that crashes, no memory, a full disk?)"
    return Checked(
        case,
        name=own_facts(case).name if verdicts else "",
        seed=case.seed if faults else row.seed,
        outcome=row.outcome if verdicts else "",
        message=row.message if verdicts else "",
        verdicts=verdicts,
        lines=[] if not verdicts or _replaces_expectations(case) else _lines(case.path),
        wall_time=row.wall_time,
        faults=faults,
        error=error,
        folder=place if place is not None and row.folder is not None else None,
    )


def with_clips(
    results: Sequence[Checked], clip: Clip, backend: Backend[Drawing, Path | str]
) -> list[Checked]:
    """Return results with a clip of each run that failed a verdict and was kept."""
    found = {
        one.folder: Drawing(clip, one.folder)
        for one in results
        if one.folder is not None and one.code != GOOD and one.verdicts
    }
    drawn = {job.folder: made for job, made in backend(draw, found.values())}

    def shown(one: Checked) -> Checked:
        made = None if one.folder is None else drawn.get(one.folder)
        told = {"clip": made} if isinstance(made, Path) else {"note": f"no clip: {made}"}
        return one if made is None else replace(one, **told)

    return [shown(one) for one in results]


def draw(job: Drawing) -> Path | str:
    """Draw a clip, or say why not."""
    try:
        return job.clip(job.folder)
    except EscortError as error:
        return str(error)


def _write_design(cases: Sequence[Case], tasks: Sequence[Job | Checked], out: Path) -> None:
    """Write what a report of the results has to know: a cell for each scenario."""
    runs = [(case, task) for case, task in zip(cases, tasks, strict=True) if isinstance(task, Job)]
    texts = {case.label: task.text for case, task in runs}
    if runs:
        DesignRecord(
            study="check",
            texts=texts,
            factors=[Varied(CASE)],
            cells=[Cell({CASE: label}, {}, label) for label in texts],
            runs=[Planned([*texts].index(case.label), task.seed, task.key) for case, task in runs],
        ).write(out)


@lru_cache(maxsize=64)
def _lines(path: Path) -> list[int]:
    return expectation_lines(path)


def _replaces_expectations(case: Case) -> bool:
    return any(text.startswith("expect") for text in case.overrides)
