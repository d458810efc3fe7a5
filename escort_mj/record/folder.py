"""A run folder, as the run that fills it sees it: safe to kill at any moment."""

from __future__ import annotations

import contextlib
import hashlib
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj import stopping
from escort_mj.errors import BrokenRunError, RunFolderError, UsageError, WriteError
from escort_mj.files import alive, identify, is_partial, locked, write_json, write_model, write_text
from escort_mj.record.journal import Journal
from escort_mj.record.outcome import Outcome, Verdict
from escort_mj.record.recording import NONE, Recorded
from escort_mj.record.stored import (
    CLIP,
    FIGURES,
    JOURNAL,
    METRICS,
    MODEL,
    OURS,
    OUTCOME,
    PLUGINS,
    REPORT,
    RESOLVED,
    SCENARIO,
    TRACE,
    VERDICTS,
    VIDEO,
    StoredRun,
    facts,
    is_run,
    read_outcome,
    read_run,
    recovered,
)
from escort_mj.record.trace import save_trace
from escort_mj.signals import record_size

__all__ = [
    "CLIP",
    "FIGURES",
    "MODEL",
    "REPORT",
    "SCENARIO",
    "VIDEO",
    "OccupiedError",
    "RunFolder",
    "StoredRun",
    "free_place",
    "is_run",
    "read_run",
    "refuse_run",
]


RUN, CHECK, STUDY, RERUN = "run", "check", "study", "rerun"  # what can have made a run


class OccupiedError(UsageError):
    """A folder with a run that must not be replaced."""


class RunFolder:
    """Writes one run. As a context manager it marks a run that an error ended as failed.

    Attributes:
        path: The folder.
    """

    def __init__(self, path: Path, outcome: dict[str, Any]) -> None:
        """Takes over a folder that `create` made ready.

        Args:
            path: The folder.
            outcome: Contents of its outcome.json while the run goes on.
        """
        self.path = path
        self._outcome = outcome
        self._journal: Journal | None = None
        self._finished = False
        self._appended = False

    @classmethod
    def create(cls, path: Path, made_by: str = RUN, overwrite: bool = False) -> RunFolder:
        """Make a folder ready for a run.

        Checks, studies and reruns replace runs that they have made there before; any other run stays, unless
        it recorded nothing.

        Args:
            path: The folder.
            made_by: `run`, `check`, `study` or `rerun`.
            overwrite: Whether an earlier run may be replaced, whatever has made it.

        Raises:
            OccupiedError: If the folder holds a run that must not be replaced, or one that goes on.
            UsageError: If it holds something else.
            RunFolderError: If it cannot be written.
        """
        outcome = identify() | {
            "made_by": made_by,
            "outcome": Outcome.RUNNING.value,
            "message": Outcome.RUNNING.meaning,
            "started": _now(),
        }
        with _writing(path, begun=False):
            path.mkdir(parents=True, exist_ok=True)
            with locked(path):
                _refuse_others(path, made_by, overwrite)
                # First the journal, which must never pass for the new run's; then the old outcome, so that
                # no outcome of a finished run stands beside results that are half gone.
                _remove(path / JOURNAL)
                write_json(path / OUTCOME, outcome)
                for name in OURS:
                    if name != OUTCOME:
                        _remove(path / name)
                for left in filter(is_partial, path.iterdir()):
                    _remove(left)
        return cls(path, outcome)

    @classmethod
    def create_beside(cls, path: Path, made_by: str = RUN) -> RunFolder:
        """Make a folder ready for a run: this one, or the first of NAME-2, NAME-3 ... that is free.

        Raises:
            UsageError: If the folder holds something else than a run.
            RunFolderError: If it cannot be written.
        """
        while True:
            with contextlib.suppress(OccupiedError):  # another process may be faster
                return cls.create(free_place(path, made_by), made_by)

    def begin(
        self,
        scenario: str,
        model: str,
        sizes: Mapping[str, int],
        labels: Mapping[str, Any],
        plugins: Sequence[str] = (),
        short: str = "",
        assets: Mapping[str, bytes] | None = None,
    ) -> None:
        """Write what is known before the first step, and open the journal.

        Args:
            scenario: The complete scenario as YAML.
            model: The model as MJCF.
            sizes: Size of each dimension of a record.
            labels: As `recording.record` takes them; what JSON can hold.
            plugins: Files that the scenario names, of which the folder keeps copies.
            assets: Files that the model names, by their paths from the folder.
            short: The scenario without what is at its default; the folder has both forms then.
        """
        self._outcome["scenario_sha256"] = hashlib.sha256(scenario.encode()).hexdigest()
        with _writing(self.path):
            write_text(self.path / SCENARIO, short or scenario)
            if short:
                write_text(self.path / RESOLVED, scenario)
            write_model(self.path / MODEL, model, assets or {})
            for plugin in plugins:
                (self.path / PLUGINS).mkdir(exist_ok=True)
                shutil.copyfile(plugin, self.path / PLUGINS / Path(plugin).name)
            header = {"sizes": dict(sizes), "record_size": record_size(sizes), "labels": dict(labels)}
            self._journal = Journal(self.path / JOURNAL, header)

    def append(
        self,
        block: NDArray[np.float64],
        episodes: NDArray[np.float64] = NONE,
        under_way: NDArray[np.float64] = NONE,
    ) -> None:
        """Put samples and contact episodes, those that ended and those that go on, into the journal."""
        if self._journal is None:
            raise RunFolderError(f"{self.path}: the run has not begun")
        with _writing(self.path):
            self._journal.append(block, episodes, under_way)
        self._appended = True

    def finish(
        self,
        outcome: Outcome,
        message: str,
        trace: Recorded,
        metrics: Mapping[str, Any],
        verdicts: Sequence[Verdict],
    ) -> None:
        """Write all results, then the outcome, then let the journal go.

        An interrupted run leaves its trace in the journal: hours of samples take long to compress. A run
        that was made in memory has none there.
        """
        in_journal = outcome is Outcome.INTERRUPTED and self._appended
        with _writing(self.path):
            if not in_journal:
                save_trace(trace, self.path / TRACE)
            write_json(self.path / METRICS, metrics)
            write_json(self.path / VERDICTS, list(map(asdict, verdicts)))
            self._end(outcome, message, facts(trace) | dict(metrics.get("run", {})), in_journal)

    def fail(self, message: str, outcome: Outcome = Outcome.FAILED) -> None:
        """End a run that an error broke; its trace goes as far as its journal.

        Where the trace cannot be written, the journal stays and is read in its place.
        """
        trace = recovered(self.path)
        saved = True
        if trace is not None:
            try:
                save_trace(trace, self.path / TRACE)
            except WriteError:
                saved = False
        if self._journal is not None:
            self._journal.free_reserve()
        with _writing(self.path):
            self._end(outcome, message, facts(trace), keep_journal=not saved)

    def _end(
        self, outcome: Outcome, message: str, more: Mapping[str, Any], keep_journal: bool = False
    ) -> None:
        """Write the outcome, and remove the journal unless it is all that holds the samples."""
        last = {"outcome": outcome.value, "message": message, "ended": _now()}
        write_json(self.path / OUTCOME, self._outcome | dict(more) | last)
        self._finished = True
        if self._journal is not None:
            self._journal.close()
            if not keep_journal:
                shutil.rmtree(self._journal.folder, ignore_errors=True)

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        if error is None or self._finished:
            return
        stopped = isinstance(error, KeyboardInterrupt) or stopping.interrupted()
        outcome = Outcome.INTERRUPTED if stopped else Outcome.FAILED
        broken = isinstance(error, BrokenRunError)
        message = str(error) if broken else f"{type(error).__name__}: {error}".removesuffix(": ")
        with contextlib.suppress(Exception):  # the error on its way tells more
            self.fail(message, outcome)
        if self._journal is not None:
            self._journal.close()
        if broken:
            raise BrokenRunError(f"{message}; {self._kept()}") from None

    def _kept(self) -> str:
        """What can be read of a run that could not be written to its end."""
        with contextlib.suppress(Exception):
            time = read_run(self.path).trace["time"]
            if len(time):
                return f"{self.path} holds what was recorded up to {float(time[-1]):.2f} s"
        return f"{self.path} holds no sample"


def refuse_run(folder: Path) -> None:
    """Raises OccupiedError if a folder, in which results of a study are to be, is a run's."""
    if is_run(folder):
        raise OccupiedError(f"{folder}: holds a run; choose another folder")


def free_place(path: Path, made_by: str = RUN) -> Path:
    """A folder, or the first of NAME-2, NAME-3 ... without a run that must not be replaced.

    Args:
        path: The folder.
        made_by: What is to make a run there, as for `RunFolder.create`.
    """
    for number in count(2):
        try:
            if path.is_dir():
                _refuse_others(path, made_by)
            return path
        except OccupiedError:
            path = path.with_name(f"{path.name if number == 2 else path.name.rpartition('-')[0]}-{number}")
    raise AssertionError("there is always another number")


def _refuse_others(path: Path, made_by: str, overwrite: bool = False) -> None:
    """Raises UsageError unless the folder is empty or holds a run that may be replaced."""
    present = {entry.name for entry in path.iterdir() if not is_partial(entry)}
    if not present:
        return
    if OUTCOME not in present:
        raise UsageError(f"{path}: holds files but no run; choose an empty folder, or a run's to replace it")
    before = read_outcome(path)
    if before["outcome"] == Outcome.RUNNING.value and alive(before):
        raise OccupiedError(f"{path}: process {before['pid']} is writing a run here now")
    own = made_by != RUN and before.get("made_by", STUDY) == made_by  # older versions did not say it
    if own or overwrite or present.isdisjoint((TRACE, JOURNAL)):
        return
    how = "--overwrite (in Python overwrite=True) replaces it" if made_by == RUN else "choose another folder"
    raise OccupiedError(f"{path}: holds a run already; {how}")


@contextlib.contextmanager
def _writing(path: Path, begun: bool = True) -> Iterator[None]:
    """Turn what the file system says into one sentence with the file's or the folder's name.

    Args:
        path: The folder.
        begun: Whether the run has begun: then its path is not at fault, whatever the system says.
    """
    try:
        yield
    except OSError as error:
        failed = error if isinstance(error, WriteError) else WriteError(path, error)
        fault = BrokenRunError if begun or failed.exit_code == BrokenRunError.exit_code else RunFolderError
        raise fault(str(failed)) from None


def _remove(entry: Path) -> None:
    """Remove a file, a link or a whole folder, if it is there."""
    if entry.is_dir() and not entry.is_symlink():
        shutil.rmtree(entry)
    else:
        entry.unlink(missing_ok=True)


def _now() -> str:
    """The time of day, for people."""
    return datetime.now(UTC).isoformat(timespec="seconds")
