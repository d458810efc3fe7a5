"""Runs of a study: each in its folder, and only those that have not ended in it before."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from escort_mj.errors import EscortError
from escort_mj.mission import fly
from escort_mj.record.folder import RunFolder, open_run
from escort_mj.record.outcome import FINAL, Outcome
from escort_mj.scenario import Scenario, dump_scenario

if TYPE_CHECKING:
    import xarray

    from escort_mj.record.folder import StoredRun


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


def run_once(scenario: Scenario, path: Path, again: bool = False) -> Ended:
    """Runs a scenario, unless its folder holds that run already.

    Args:
        scenario: What to run.
        path: Its run folder.
        again: Whether to run it even if it has ended there before.

    Raises:
        UsageError: If the folder holds something else, or another process is writing in it.
    """
    stored = None if again else finished(path, scenario)
    if stored is not None:
        return Ended(stored.outcome["outcome"], stored.outcome["message"], stored.trace, False)
    folder = RunFolder.create(path)
    try:
        with folder:
            run = fly(scenario, folder)
    except EscortError:
        raise
    except Exception as error:  # the folder says the same; the other runs go on
        return Ended(Outcome.FAILED.value, f"{type(error).__name__}: {error}", None, True)
    return Ended(run.outcome.value, run.message, run.trace, True)


def finished(folder: Path, scenario: Scenario) -> StoredRun | None:
    """What a folder holds, if it is this scenario's run and it ended by itself."""
    try:
        stored = open_run(folder)
    except EscortError:
        return None
    same = stored.scenario_yaml == dump_scenario(scenario)
    return stored if same and stored.outcome["outcome"] in FINAL else None
