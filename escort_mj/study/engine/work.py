"""Makes one run of a study and sums it up: all that a worker process needs to import."""

from __future__ import annotations

import shutil
import threading
import time
import traceback
from collections.abc import Sequence
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from escort_mj import stopping
from escort_mj.errors import BrokenRunError, EscortError, Fault, RunFolderError, ScenarioError, WriteError
from escort_mj.measuring import measure_over
from escort_mj.metrics.metric import Metric
from escort_mj.mission import Flight, Room, fly, save
from escort_mj.record.folder import CHECK, STUDY, RunFolder, is_run, read_run
from escort_mj.record.outcome import Outcome
from escort_mj.record.recording import versions_of
from escort_mj.record.window import Span
from escort_mj.scenario import Scenario, dump_scenario
from escort_mj.scenario.reader.catalog import catalog_of
from escort_mj.scenario.reader.load import Template
from escort_mj.study.engine.store import Row

RUNS = "runs"
WRONG = 2  # exit code of what is wrong with input


class Job(NamedTuple):
    """A run to be made.

    Attributes:
        key: Of the run.
        seed: Of all its randomness.
        settings: What its cell sets.
        text: The scenario's YAML before that.
        source: What to call it.
        out: Folder of the results; None where nothing is kept.
        folder: Where in it to keep the run; None for nowhere.
        only_failed: Keep it only where it fails.
        measured: What is measured of it beside the metrics that it has anyway: a name, the metric's, and the
            part of the run.
        made_by: As for `RunFolder.create`.
        overrides: Texts `key.path=value` that are set in place of the settings and the seed; None for these.
        plugins: Plugins beside those that the scenario names.
        repeat: How many runs it takes; all of them must have the same bits.
    """

    key: str
    seed: int
    settings: dict[str, Any]
    text: str
    source: str
    out: Path | None
    folder: str | None
    only_failed: bool
    measured: tuple[tuple[str, str, Span], ...] = ()
    made_by: str = STUDY
    overrides: tuple[str, ...] | None = None
    plugins: tuple[str, ...] = ()
    repeat: int = 1

    @property
    def place(self) -> Path | None:
        """Its run folder."""
        return None if self.out is None or self.folder is None else self.out / self.folder


_mine = threading.local()


def _room() -> Room:
    """This thread's memory for samples."""
    if not hasattr(_mine, "room"):
        _mine.room = Room()
    room: Room = _mine.room
    return room


@lru_cache(maxsize=4)
def _template(text: str, source: str) -> Template:
    return Template(text, source)


def fly_keeping(scenario: Scenario, folder: Path | None, made_by: str, always: bool = False) -> Flight:
    """Run a scenario, and keep it in a folder if a verdict fails.

    What calls plugins, or takes long, writes its folder on the way: its process may die.

    Args:
        scenario: What to run.
        folder: Its run folder, removed if the run passes; None keeps nothing.
        made_by: As for `RunFolder.create`.
        always: Whether a run that passes is kept, too.

    Raises:
        KeyboardInterrupt: If it was interrupted; a folder that was begun holds the run as far as it came.
    """
    if folder is None:
        return fly(scenario, room=_room())
    begun: list[RunFolder] = []
    with ExitStack() as stack:

        def begin() -> RunFolder:
            if not begun:
                begun.append(stack.enter_context(RunFolder.create(folder, made_by)))
            return begun[0]

        try:
            run = fly(scenario, begin() if catalog_of(scenario).plugins else begin, room=_room())
        except Exception:
            begin()  # it says what broke
            raise
        if run.outcome is Outcome.INTERRUPTED:
            raise KeyboardInterrupt(run.message)
        if not begun and (always or not run.passed):
            save(begin(), run)
    if run.passed and not always:
        shutil.rmtree(folder, ignore_errors=True)
    return run


def perform(job: Job) -> Row:
    """Make one run and summarize it; an error becomes a row too.

    Raises:
        WriteError: If a study's run cannot be written.
        BrokenRunError: Likewise.
    """
    began = time.perf_counter()

    def nothing(message: str, faults: Sequence[Fault] = ()) -> Row:
        return row_of_nothing(job, Outcome.FAILED.value, message, time.perf_counter() - began, faults)

    try:
        given = job.settings | {"seed": job.seed} if job.overrides is None else job.overrides
        scenario = _template(job.text, job.source).scenario(given, job.plugins)
        always = not job.only_failed or job.repeat > 1
        run = fly_keeping(scenario, job.place, job.made_by, always)
        assert run.recording is not None, "single runs keep their recording"
        if first := signal_that_differs(run, [fly(scenario) for _ in range(1, job.repeat)]):
            return nothing(f"the runs of one seed have different bits, first in {first}")
        kept = not job.only_failed or not run.passed
        if always and not kept and job.place is not None:
            shutil.rmtree(job.place, ignore_errors=True)
        known = {metric.name: metric for metric in catalog_of(scenario).of(Metric)}
        more = {key: measure_over(known[name], run.recording, span) for key, name, span in job.measured}
        if broken := [found.reason for found in more.values() if found.broken]:
            return nothing(broken[0])
    except ScenarioError as error:
        return nothing(str(error), error.faults)
    except (BrokenRunError, WriteError) as error:
        if job.made_by == STUDY:
            raise  # it tells of the disk, not of the run, which is still to be made
        return nothing(str(error))
    except EscortError as error:
        return nothing(str(error), [Fault(str(error))] if error.exit_code == WRONG else ())
    except Exception as error:
        stopping.raise_if_interrupted()  # some libraries make an interrupt an error of their own
        words = f"{type(error).__name__}: {error}"
        return nothing(traceback.format_exc().strip() if job.made_by == CHECK else words)
    return Row(
        job.key,
        job.seed,
        job.settings,
        run.outcome.value,
        run.message,
        run.passed,
        float(run.metrics["run"]["simulated_time"]),
        time.perf_counter() - began,
        run.verdicts,
        dump_scenario(scenario),
        versions_of(run.recording.attrs),
        {name: found.value for name, found in (run.measures | more).items()} if run.outcome.good else {},
        job.folder if kept else None,
    )


def signal_that_differs(run: Flight, others: Sequence[Flight]) -> str:
    """Return the first signal in which a run differs from others, bit by bit; empty if there is none."""
    for other in (each.recording for each in others):
        assert run.recording is not None and other is not None, "single runs keep their recording"
        for name, variable in run.recording.data_vars.items():
            if variable.values.tobytes() != other.data_vars[name].values.tobytes():
                return str(name)
    return ""


def row_of_nothing(
    job: Job, outcome: str, message: str, wall_time: float, faults: Sequence[Fault] = ()
) -> Row:
    """The row of a run that came to nothing; what it left on disk is kept."""
    folder = job.folder if job.place is not None and is_run(job.place) else None
    how = outcome, message, False, 0.0, wall_time
    return Row(job.key, job.seed, job.settings, *how, [], "", {}, {}, folder, list(faults))


def killed(job: Job, cause: str = "") -> Row:
    """The row of a run that killed whatever process tried it.

    Args:
        job: Which.
        cause: What they died of, if that is known.
    """
    words = f"its worker process died, time and again{cause and f': {cause}'}"
    return row_of_nothing(job, Outcome.KILLED.value, f"{words}{kept_of(job.place)}", 0.0)


def kept_of(folder: Path | None) -> str:
    """Say what the folder of a run holds whose process died, and write there that it did."""
    if folder is None or not is_run(folder):
        return ""
    try:
        return f"; {folder} holds it up to {float(read_run(folder).trace['time'][-1]):.2f} s"
    except (RunFolderError, IndexError):
        return f"; {folder} holds no sample of it"
