"""A run folder: everything that a run leaves behind, readable at any moment of the run and after a kill."""

from __future__ import annotations

import os
import shutil
from dataclasses import asdict, dataclass, is_dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RunFolderError, UsageError
from escort_mj.record.files import read_json, write_json, write_text
from escort_mj.record.journal import Journal, journal_of, read_journal
from escort_mj.record.outcome import Outcome
from escort_mj.record.trace import build_trace, load_trace, save_trace
from escort_mj.signals import record_size

if TYPE_CHECKING:
    import xarray

OUTCOME, SCENARIO, MODEL, TRACE = "outcome.json", "scenario.yaml", "model.xml", "trace.nc"
METRICS, VERDICTS, JOURNAL, FIGURES, VIDEO = (
    "metrics.json",
    "verdicts.json",
    "journal",
    "figures",
    "video.mp4",
)
OURS = (OUTCOME, SCENARIO, MODEL, TRACE, METRICS, VERDICTS, JOURNAL, FIGURES, VIDEO)


class RunFolder:
    """Writes one run.

    Attributes:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._journal: Journal | None = None
        self._started: dict[str, Any] = {}

    @classmethod
    def create(cls, path: Path) -> RunFolder:
        """Makes a folder ready for a run; the results of an earlier run in it are removed.

        Raises:
            UsageError: If the folder holds something else, or another run is writing in it now.
        """
        try:
            path.mkdir(parents=True, exist_ok=True)
            present = {entry.name for entry in path.iterdir()}
            if present and OUTCOME not in present:
                raise UsageError(
                    f"{path}: holds files but no run; choose an empty folder, or a run's to replace it"
                )
            if present:
                before = read_json(path / OUTCOME)
                if before.get("outcome") == Outcome.RUNNING.value and _alive(before):
                    raise UsageError(f"{path}: process {before.get('pid')} is writing a run here now")
            folder = cls(path)
            folder._started = {
                "outcome": Outcome.RUNNING.value,
                "message": "running",
                "pid": os.getpid(),
                "process_start": _process_start(os.getpid()),
                "started": datetime.now(UTC).isoformat(timespec="seconds"),
            }
            for name in OURS:
                entry = path / name
                if entry.is_dir():
                    shutil.rmtree(entry)
                elif name != OUTCOME:
                    entry.unlink(missing_ok=True)
            write_json(path / OUTCOME, folder._started)
        except OSError as error:
            raise RunFolderError(f"{path}: cannot be written: {error.strerror or error}") from None
        return folder

    def begin(self, scenario: str, model: str, sizes: dict[str, int], labels: dict[str, Any]) -> None:
        """Writes what is known before the first step, and opens the journal."""
        try:
            write_text(self.path / SCENARIO, scenario)
            write_text(self.path / MODEL, model)
            header = {"sizes": sizes, "record_size": record_size(sizes), "labels": labels}
            self._journal = Journal(self.path / JOURNAL, header)
        except OSError as error:
            raise RunFolderError(f"{self.path}: cannot be written: {error.strerror or error}") from None

    def append(self, block: NDArray[np.float64]) -> None:
        """Puts samples into the journal, shape (k, record_size)."""
        if self._journal is None:
            raise RunFolderError(f"{self.path}: the run has not begun")
        try:
            self._journal.append(block)
        except OSError as error:
            raise RunFolderError(f"{self.path}: the run stops here: {error.strerror or error}") from None

    def finish(
        self,
        outcome: Outcome,
        message: str,
        trace: xarray.Dataset,
        metrics: dict[str, Any],
        verdicts: list[Any],
    ) -> None:
        """Writes all results, then the outcome, then lets the journal go."""
        try:
            save_trace(trace, self.path / TRACE)
            write_json(self.path / METRICS, metrics)
            write_json(self.path / VERDICTS, [asdict(v) if is_dataclass(v) else v for v in verdicts])
            ended = datetime.now(UTC).isoformat(timespec="seconds")
            write_json(
                self.path / OUTCOME,
                self._started | {"outcome": outcome.value, "message": message, "ended": ended}
                | {key: value for key, value in trace.attrs.items() if key.startswith("version_")},
            )  # fmt: skip
        except OSError as error:
            raise RunFolderError(f"{self.path}: cannot be written: {error.strerror or error}") from None
        if self._journal is not None:
            self._journal.close()
            shutil.rmtree(self._journal.folder, ignore_errors=True)


@dataclass(frozen=True)
class StoredRun:
    """What a run folder holds.

    Attributes:
        path: The folder.
        outcome: Contents of outcome.json: `outcome`, `message`, when and by which versions.
        trace: Every recorded signal.
        metrics: Contents of metrics.json; empty where the run never came to it.
        verdicts: Contents of verdicts.json; empty likewise.
        scenario_yaml: The complete scenario, to run it again.
    """

    path: Path
    outcome: dict[str, Any]
    trace: xarray.Dataset
    metrics: dict[str, Any]
    verdicts: list[dict[str, Any]]
    scenario_yaml: str


def open_run(path: str | os.PathLike[str]) -> StoredRun:
    """Opens a run folder; the trace of a run that was killed is recovered from its journal.

    Raises:
        RunFolderError: If it is no run folder, or the run has recorded nothing yet.
    """
    folder = Path(path)
    outcome = read_json(folder / OUTCOME)
    journal = journal_of(folder)
    if outcome.get("outcome") == Outcome.RUNNING.value:
        if journal is None:
            raise RunFolderError(f"{folder}: the run ended before its first step, and left nothing to read")
        trace = _from_journal(journal)
        if not _alive(outcome):
            outcome = _bury(folder, outcome, trace)
    else:
        trace = load_trace(folder / TRACE)
    return StoredRun(
        folder,
        outcome,
        trace,
        read_json(folder / METRICS) if (folder / METRICS).is_file() else {},
        read_json(folder / VERDICTS) if (folder / VERDICTS).is_file() else [],
        (folder / SCENARIO).read_text(encoding="utf-8") if (folder / SCENARIO).is_file() else "",
    )


def _from_journal(journal: Path) -> xarray.Dataset:
    """The trace so far."""
    samples, header = read_journal(journal)
    return build_trace(samples, header["sizes"], header["labels"])


def _bury(folder: Path, outcome: dict[str, Any], trace: xarray.Dataset) -> dict[str, Any]:
    """Writes the trace and the outcome of a run whose process is dead."""
    reached = float(trace["time"][-1]) if trace.sizes["time"] else 0.0
    message = f"the process {outcome.get('pid')} died; recorded up to {reached:.2f} s"
    outcome = outcome | {"outcome": Outcome.KILLED.value, "message": message}
    save_trace(trace, folder / TRACE)
    write_json(folder / OUTCOME, outcome)
    return outcome


def _alive(outcome: dict[str, Any]) -> bool:
    """Whether the process that wrote an outcome still runs, and is not another one under its old number."""
    pid = int(outcome.get("pid", -1))
    if pid <= 0:
        return False
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return _process_start(pid) == outcome.get("process_start")


def _process_start(pid: int) -> str | None:
    """When a process started, in the kernel's own ticks; None where the system does not tell."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return None if fields[0] == "Z" else fields[19]
