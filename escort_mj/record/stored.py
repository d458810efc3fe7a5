"""A run folder, as its readers see it; the trace of a run that was killed comes from its journal."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from escort_mj.errors import RunFolderError
from escort_mj.files import alive, checked, read_json, read_text, write_json
from escort_mj.recognize import OUTCOME, RESOLVED, SCENARIO, irregular
from escort_mj.record.journal import journal_of, read_journal
from escort_mj.record.outcome import Outcome, Verdict
from escort_mj.record.recording import Recorded, Recording, record
from escort_mj.record.trace import load_recording, save_trace

if TYPE_CHECKING:
    import xarray


MODEL, TRACE = "model.xml", "trace.nc"
METRICS, VERDICTS, JOURNAL = "metrics.json", "verdicts.json", "journal"
FIGURES, VIDEO, CLIP, REPORT, PLUGINS = "figures", "video.mp4", "clip.mp4", "report.html", "plugins"
ASSETS, STUDY_FILE = "assets", "study.yaml"
VIDEOS = (VIDEO, "video.webp", "video.gif")  # GIFs are of earlier versions
OURS = (
    OUTCOME,
    SCENARIO,
    RESOLVED,
    MODEL,
    TRACE,
    METRICS,
    VERDICTS,
    JOURNAL,
    FIGURES,
    *VIDEOS,
    CLIP,
    REPORT,
    PLUGINS,
    ASSETS,
)


@dataclass(frozen=True)
class StoredRun:
    """What a run folder holds.

    Attributes:
        path: The folder.
        outcome: Contents of outcome.json: `outcome`, `message`, `simulated_time`, when and by which versions.
        recording: Every recorded signal, without labels: what is quick to load.
        metrics: Contents of metrics.json; empty where the run never came to it.
        verdicts: Contents of verdicts.json; empty likewise.
        scenario_yaml: The complete scenario with all defaults, to run it again.
        scenario_file: The file that it is from.
    """

    path: Path
    outcome: dict[str, Any]
    recording: Recording
    metrics: dict[str, Any]
    verdicts: list[Verdict]
    scenario_yaml: str
    scenario_file: Path

    @cached_property
    def trace(self) -> xarray.Dataset:
        """Every recorded signal, labelled."""
        return self.recording.to_dataset()


def is_run(folder: Path) -> bool:
    """Whether a folder is a run's."""
    return (folder / OUTCOME).is_file()


def read_run(path: str | os.PathLike[str]) -> StoredRun:
    """Open a run folder.

    A run that still goes on shows its trace so far. A run whose process died gets its trace from the journal
    and the outcome `killed`, written to the folder where that can be.

    Raises:
        RunFolderError: If it is no run folder, or the run has recorded nothing.
    """
    folder = Path(path)
    if folder.is_file():
        raise RunFolderError(f"{folder}: is a file; expected a run folder, such as {folder.parent}")
    if (folder / STUDY_FILE).is_file():
        words = f"its kept runs are in {folder / 'runs'}, and escort-mj report draws its figures"
        raise RunFolderError(f"{folder}: is the folder of a study; {words}")
    if kind := irregular(folder / MODEL):
        raise RunFolderError(f"{folder / MODEL}: is {kind}, not a file")
    from escort_mj.record.intact import (  # runs only write: they do without
        MetricsFile,
        VerdictsFile,
        check_trace,
    )

    outcome = read_outcome(folder)
    trace = None
    if outcome["outcome"] == Outcome.RUNNING.value:
        gone = not alive(outcome)
        trace = recovered(folder)
        # A run that ends while it is looked at has written its outcome before its journal goes.
        outcome = read_outcome(folder)
        if outcome["outcome"] == Outcome.RUNNING.value:
            if gone:
                outcome = _bury(folder, outcome, trace)
            elif trace is None:
                raise RunFolderError(f"{folder}: process {outcome.get('pid')} is still preparing this run")
        else:
            trace = None
    if trace is None and not (folder / TRACE).is_file():
        trace = recovered(folder)  # the run was interrupted, or the disk had no room for both
        if trace is not None:
            with suppress(OSError):
                save_trace(trace, folder / TRACE)
    if trace is None:
        if outcome["outcome"] != Outcome.COMPLETED.value and not (folder / TRACE).is_file():
            raise RunFolderError(
                f"{folder}: {outcome['outcome']}: {outcome['message']}; it left nothing to read"
            )
        trace = load_recording(folder / TRACE)
    check_trace(trace, folder / TRACE)
    metrics = read_json(folder / METRICS) if (folder / METRICS).is_file() else {}
    checked(MetricsFile, metrics, folder / METRICS)
    verdicts = []
    if (folder / VERDICTS).is_file():
        verdicts = checked(VerdictsFile, read_json(folder / VERDICTS), folder / VERDICTS)
    files = [folder / name for name in (RESOLVED, SCENARIO) if (folder / name).exists()]
    text, file = next(((text, file) for file in files if (text := read_text(file))), ("", folder / SCENARIO))
    return StoredRun(folder, outcome, trace, metrics, verdicts, text, file)


def read_outcome(folder: Path) -> dict[str, Any]:
    """Contents of a folder's outcome.json.

    Raises:
        RunFolderError: If there is none, or it is no run's.
    """
    from escort_mj.record.intact import OutcomeEntries

    found = read_json(folder / OUTCOME)
    checked(OutcomeEntries, found, folder / OUTCOME)
    return {"message": "", "pid": None} | found


def recovered(folder: Path) -> Recording | None:
    """The trace as far as the journal goes; None without a journal."""
    journal = journal_of(folder)
    if journal is None:
        return None
    try:
        samples, episodes, header = read_journal(journal)
        return record(samples, header["sizes"], header["labels"], episodes)
    except (RunFolderError, KeyError, TypeError, ValueError):
        if journal_of(folder) is None:  # it went while we read: the run has ended
            return None
        raise


def facts(trace: Recorded | None) -> dict[str, Any]:
    """What an outcome takes from a trace: how far the run came, and by which versions."""
    if trace is None:
        return {"simulated_time": 0.0}
    prefix = "version_"
    versions = {
        str(key).removeprefix(prefix): value
        for key, value in trace.attrs.items()
        if str(key).startswith(prefix)
    }
    reached = float(trace["time"][-1]) if trace.sizes["time"] else 0.0
    return {"simulated_time": reached, "platform": versions.pop("platform", ""), "versions": versions}


def _bury(folder: Path, outcome: dict[str, Any], trace: Recorded | None) -> dict[str, Any]:
    """Write the trace and the outcome of a run whose process is dead; a folder of others stays as it is."""
    so_far = facts(trace)
    moment = (
        f"recorded up to {so_far['simulated_time']:.2f} s" if trace is not None else "before the first step"
    )
    message = f"process {outcome['pid']} died, {moment}"
    outcome = outcome | so_far | {"outcome": Outcome.KILLED.value, "message": message}
    with suppress(OSError):
        if trace is not None:
            save_trace(trace, folder / TRACE)
        write_json(folder / OUTCOME, outcome)
    return outcome
