"""Many scenarios checked side by side, with clips of those that fail, and reports for people and machines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from escort_mj import stopping
from escort_mj.errors import EscortError
from escort_mj.report.video.video import render_clip
from escort_mj.study.check import GOOD, Case, Checked, check_one
from escort_mj.study.engine.parallel import cores, side_by_side

Progress = Callable[[float, float], None]


class Task(NamedTuple):
    """One scenario to check, and what to leave of it.

    Attributes:
        case: Which.
        folder: Its run folder; None keeps nothing on disk.
        keep: Whether a run that passes leaves its folder, too.
        clip: Whether to draw a clip of a run that fails.
    """

    case: Case
    folder: Path | None
    keep: bool
    clip: bool


def check(
    cases: Sequence[Case],
    out: Path,
    workers: int | None = None,
    keep: bool = False,
    clips: bool = True,
    progress: Progress | None = None,
) -> list[Checked]:
    """Runs and judges scenarios side by side, in other processes: one that crashes costs its row alone.

    Args:
        cases: What to check.
        out: Folder for the run folders of those that fail.
        workers: Processes; None for one per core.
        keep: Whether runs that pass leave their folder, too.
        clips: Whether to draw a short video around the worst moment of each that fails.
        progress: Called with the scenarios done and to do.

    Returns:
        One result per case, in their order.
    """
    tasks = [Task(case, out / case.label, keep, clips) for case in cases]
    checked = 0

    def note(done: float, total: float) -> None:
        nonlocal checked
        checked = int(done)
        if progress is not None:
            progress(done, total)

    with stopping.keeping(
        lambda: f"{checked} of {len(cases)} scenarios had been checked; the same command checks all again"
    ):
        return side_by_side(perform, tasks, workers or cores(), note, lost)


def lost(task: Task, cause: str) -> Checked:
    """The result of a scenario that kills every process that checks it."""
    words = (
        f"the process that ran it died each time ({cause}): a plugin that crashes, no memory, a full disk?"
    )
    folder = task.folder if task.folder is not None and task.folder.is_dir() else None
    return Checked(task.case.path, task.case.label, error=words, folder=folder)


def perform(task: Task) -> Checked:
    """Checks one scenario, and draws a clip if it fails."""
    result = check_one(task.case, task.folder, task.keep)
    if not task.clip or result.folder is None or result.code == GOOD or not result.verdicts:
        return result
    try:
        return replace(result, clip=render_clip(result.folder))
    except EscortError as error:
        return replace(result, note=f"no clip: {error}")
