"""Runs of a study: each in its folder, and only those that have not ended in it before."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from escort_mj.errors import EscortError
from escort_mj.mission import fly
from escort_mj.record.folder import STUDY, RunFolder, read_run
from escort_mj.record.outcome import FINAL, Outcome
from escort_mj.scenario import Scenario, dump_scenario

if TYPE_CHECKING:
    import xarray

    from escort_mj.record.folder import StoredRun


What = TypeVar("What")


class RunJob(NamedTuple, Generic[What]):
    """One run to be had.

    Attributes:
        what: Which.
        scenario: What it is to run.
        folder: Its run folder.
        again: Whether to run it even if it has ended there before.
    """

    what: What
    scenario: Scenario
    folder: Path
    again: bool = False


class Ended(NamedTuple):
    """How a run ended.

    Attributes:
        outcome: How.
        message: The same in words.
        trace: What it recorded; None where the program broke.
        ran: Whether it ran now, and not before.
    """

    outcome: str
    message: str
    trace: xarray.Dataset | None
    ran: bool


class Findings(NamedTuple):
    """What came of the runs of a comparison or of the reproduction.

    Attributes:
        lines: What to tell the user.
        written: Files of its folder.
        stated: Whether every run ended in an outcome of its own.
    """

    lines: list[str]
    written: list[str]
    stated: bool


def lines_of(kind: str, ended: Sequence[tuple[str, str, str, bool]]) -> list[str]:
    """How many runs there were, and which of them did not complete.

    Args:
        kind: What they are called.
        ended: Name, outcome and message of each, and whether it ran now.
    """
    ran = sum(now for *_, now in ended)
    return [
        f"{len(ended)} {kind}: {ran} new, {len(ended) - ran} from earlier",
        *(
            f"  {name}: {outcome}: {message}"
            for name, outcome, message, _ in ended
            if outcome != Outcome.COMPLETED.value
        ),
    ]


def run_once(task: RunJob[Any]) -> Ended:
    """Make a run, unless its folder holds it already.

    Raises:
        UsageError: If the folder holds something else, or another process is writing in it.
    """
    stored = None if task.again else finished(task)
    if stored is not None:
        return Ended(stored.outcome["outcome"], stored.outcome["message"], stored.trace, False)
    folder = RunFolder.create(task.folder, STUDY)
    try:
        with folder:
            run = fly(task.scenario, folder)
    except EscortError:
        raise
    except Exception as error:  # the folder says the same; the other runs go on
        return Ended(Outcome.FAILED.value, f"{type(error).__name__}: {error}", None, True)
    return Ended(run.outcome.value, run.message, run.trace, True)


def finished(task: RunJob[Any]) -> StoredRun | None:
    """What a run's folder holds, if it is that run and it ended by itself."""
    try:
        stored = read_run(task.folder)
    except EscortError:
        return None
    same = stored.scenario_yaml == dump_scenario(task.scenario)
    return stored if same and stored.outcome["outcome"] in FINAL else None
