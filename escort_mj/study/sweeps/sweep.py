"""Makes the runs of a study that have not been made before, and writes each as it ends."""

from __future__ import annotations

import os
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Literal, NamedTuple, TypeVar

from escort_mj import stopping
from escort_mj.errors import UsageError
from escort_mj.files import write_text
from escort_mj.metrics import METRIC_NAMES
from escort_mj.progress import Progress, unseen
from escort_mj.record.outcome import FINAL
from escort_mj.record.tables import comma_separated, headed
from escort_mj.study.engine.backends import Backend
from escort_mj.study.engine.parallel import Died
from escort_mj.study.engine.store import FILE, Row, Store
from escort_mj.study.engine.work import RUNS, Job, killed, perform
from escort_mj.study.sweeps.definition import StudyFile, cells_of
from escort_mj.study.sweeps.design import Cell, Design, Planned, word
from escort_mj.study.sweeps.results import Results, record_of
from escort_mj.study.sweeps.statistics import counted

CONFIRMING = "--yes (in Python confirmed=True) makes them"
TABLE = "runs.csv"
CLAIMED_AT_ONCE = 16  # runs
BEAT = 30.0  # s between two signs of life
POLL = 0.5  # s between two looks at what others do
Again = Literal["none", "broken_off", "all"]


Keyed = TypeVar("Keyed", Job, Planned)


class Swept(NamedTuple):
    """What a sweep did.

    Attributes:
        runs: How many runs the study has.
        made: How many were made now.
        failed: How many of them all broke or failed a verdict.
        broken: How many of them all did not end as their scenario expects.
        cells: How many cells they are in.
    """

    runs: int
    made: int
    failed: int
    broken: int
    cells: int


def sweep_design(
    design: Design,
    out: Path,
    backend: Backend[Job, Row],
    workers: int,
    confirmed: bool = False,
    progress: Progress = unseen,
    again: Again = "none",
    only: Collection[int] | None = None,
) -> Swept:
    """Make the runs that are missing.

    Args:
        design: The study's.
        out: Folder of its results; other sweeps may work in it at the same time.
        backend: Where to compute.
        workers: How many runs go on at once, to judge the time.
        confirmed: Whether a large study may begin.
        progress: Called with the runs that are done and all.
        again: Which runs that have been made to make again: those that an accident ended, such as a killed
            worker, are `broken_off`.
        only: Numbers of the cells whose runs are made; None for all.

    Raises:
        UsageError: If the study is larger than its own `at_most` and not confirmed.
        KeyboardInterrupt: If it comes; runs under way are not stored, those that have ended are.
    """
    cells = range(len(design.cells)) if only is None else only
    asked = list(design.runs())
    planned = [run for run in asked if run.cell in cells]

    facts = record_of(design)

    def kept() -> str:
        known = store.known()
        ended = sum(run.key in known for run in planned)
        return f"{ended} of {len(planned)} runs are kept in {out}; the same command makes the others"

    with Store(out) as store, stopping.keeping(kept):
        write_text(out / "study.yaml", design.file.text)
        facts.write(out)
        if again == "all":
            store.forget(run.key for run in planned)
        elif again == "broken_off":
            before = store.get(run.key for run in planned)
            store.forget(key for key, row in before.items() if row.outcome not in FINAL)
        missing = _missing(planned, store)
        made = 0
        if missing and not confirmed:
            made = _weigh(design, missing, store, out, workers)
            missing = _missing(planned, store)
        progress(len(planned) - len(missing), len(planned))
        jobs = [job_of(design, run, out) for run in missing]
        made += make(jobs, store, backend, len(planned), progress)
        rows = store.get(run.key for run in asked)
    write_csv(Results(facts, rows), out)
    ended = [rows[run.key] for run in planned]
    failed = sum(not row.passed for row in ended)
    broken = sum(not (row.verdicts and row.verdicts[0].passed) for row in ended)
    return Swept(len(planned), made, failed, broken, len(cells))


def sweep_line(study: str, done: Swept) -> str:
    """What a sweep did, in a line."""
    return (
        f"{study}: {counted(done.runs, 'run')} in {counted(done.cells, 'cell')}: {done.made} new, "
        f"{done.runs - done.made} from earlier; {done.failed} failed, {done.broken} of them broke"
    )


def check_size(file: StudyFile, out: Path) -> None:
    """Refuse a study that is too large to begin unasked, before its cells are laid out.

    Args:
        file: The checked study.
        out: Folder of its results; runs that it has need not be made.

    Raises:
        UsageError: If more runs are missing than the study's own `at_most` allows.
    """
    known = 0
    if os.path.isfile(out / FILE):
        with Store(out) as store:
            known = len(store.known())
    _refuse_many(file, cells_of(file.study) * file.study.seeds - known)


def _refuse_many(file: StudyFile, runs: int) -> None:
    """Raises UsageError if there are more runs to make than the study allows."""
    if runs > (most := file.study.at_most.runs):
        raise UsageError(
            f"{file.path}: takes {runs} runs, more than at_most.runs allows ({most}); {CONFIRMING}"
        )


def _missing(runs: Sequence[Keyed], store: Store) -> list[Keyed]:
    known = store.known()
    return [run for run in runs if run.key not in known]


def _weigh(design: Design, missing: Sequence[Planned], store: Store, out: Path, workers: int) -> int:
    """Make one run to estimate how long all of them take; return how many it made.

    Raises:
        UsageError: If that is too many or too long.
    """
    most = design.study.at_most
    _refuse_many(design.file, len(missing))
    if len(missing) < 2 * workers:
        return 0
    pilot = missing[len(missing) // 2]
    if not store.claim([pilot.key]):
        return 0
    job = job_of(design, pilot, out)
    perform(job)  # compiles what must be compiled, or reads it from the cache
    row = perform(job)
    store.put(row)
    hours = row.wall_time * len(missing) / workers / 3600.0
    if hours > most.hours:
        raise UsageError(
            f"{design.file.path}: {len(missing)} runs of about {row.wall_time:.2g} s each would take "
            f"{hours:.2g} h on {workers} workers, more than at_most.hours allows ({most.hours:g}); "
            f"{CONFIRMING}"
        )
    return 1


def make(
    jobs: Sequence[Job],
    store: Store,
    backend: Backend[Job, Row],
    total: int,
    progress: Progress = unseen,
) -> int:
    """Make the runs that no other process makes, then wait for the others and make what they leave.

    Args:
        jobs: Runs that the store did not have.
        store: Where each is written as it ends.
        backend: Where to compute.
        total: How many runs there are with those that the store had, for the progress.
        progress: Called with the runs that are done and all.

    Returns:
        How many were made here.
    """
    made, done, missing = 0, total - len(jobs), list(jobs)
    while missing:
        beaten = time.monotonic()
        with closing(backend(perform, _claimed(missing, store))) as results:
            for job, row in results:
                stopping.raise_if_interrupted()
                store.put(killed(job, row) if isinstance(row, Died) else row)
                made, done = made + 1, done + 1
                progress(done, total)
                if time.monotonic() - beaten > BEAT:
                    store.beat()
                    beaten = time.monotonic()
        missing = _missing(missing, store)
        if missing and store.claimed_by_others():
            time.sleep(POLL)
            done = total - len(missing)
            progress(done, total)
    return made


def _claimed(missing: Sequence[Job], store: Store) -> Iterator[Job]:
    """Jobs that this process has claimed, a few at a time."""
    for first in range(0, len(missing), CLAIMED_AT_ONCE):
        some = missing[first : first + CLAIMED_AT_ONCE]
        mine = set(store.claim([job.key for job in some]))
        yield from (job for job in some if job.key in mine)


def job_of(design: Design, run: Planned, out: Path | None = None, cell: Cell | None = None) -> Job:
    """What it takes to make a run.

    Args:
        design: The study's.
        run: Which.
        out: Folder of the results, which may keep it; None keeps nothing.
        cell: Its cell, where that is none of the study's own.
    """
    keep, cell = design.study.traces, cell or design.cells[run.cell]
    template = design.template_of(cell)
    return Job(
        run.key,
        run.seed,
        cell.settings,
        template.text,
        os.path.abspath(template.source),  # whatever folder a worker is in
        out,
        None if out is None or keep == "none" else f"{RUNS}/{design.folder_of(run)}",
        keep == "failed",
        design.measured(),
    )


def write_csv(results: Results, out: Path) -> None:
    """Write the runs as comma-separated values: what was varied, how it ended, what failed, every metric."""
    facts = ("seed", "outcome", "passed", "failed", "simulated_time", "message", "key")
    custom = {name for row in results.rows.values() for name in row.metrics if name not in METRIC_NAMES}
    metrics = [*METRIC_NAMES, *sorted(custom)]
    units = {name: quantity.unit for name, quantity in results.metrics.items()} | {"simulated_time": "s"}
    factors = [factor.title for factor in results.factors.values()]
    names = [*(["point"] if results.block == "point" else []), *facts, *metrics]
    lines: list[list[object]] = [[*factors, *(headed(name, units.get(name, "")) for name in names)]]
    for run in results.runs:
        if (row := results.rows.get(run.key)) is None:
            continue
        labels = results.cells[run.cell].labels
        lines.append(
            [
                *(word(value) if isinstance(value, dict) else value for value in labels.values()),
                *("; ".join(row.failed) if name == "failed" else getattr(row, name) for name in facts),
                *(row.metrics.get(name) for name in metrics),
            ]
        )
    write_text(out / TABLE, comma_separated(lines))
