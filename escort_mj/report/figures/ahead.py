"""Figures of a run that another process draws: it gets ready while the run goes on, and uses all cores.

The process is this same module, run as `python -m escort_mj.report.figures.ahead`. It reads the run folder
from its input once the run has ended, and writes the files that it has drawn, as JSON. It has no threads and
no MuJoCo, so it may fork.
"""

from __future__ import annotations

import gc
import json
import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from escort_mj.report.video.video import child_environment

if TYPE_CHECKING:
    from escort_mj.record.folder import StoredRun

MODULE = "escort_mj.report.figures.ahead"
MOST_PROCESSES = 4

Draw = Callable[[Path], list[Path]]
"""Draws the figures of a run folder and returns their files, as `figures.draw_figures` does."""


@contextmanager
def figures_ahead() -> Iterator[Draw]:
    """Get ready to draw the figures of a run that is yet to be made.

    Where another process would not help, or fails, the figures are drawn in this one.

    Returns:
        A context with a function that draws them.
    """
    if _cores() == 1:
        yield _draw_here
        return
    command = [sys.executable, "-P", "-m", MODULE]
    pipe, nothing = subprocess.PIPE, subprocess.DEVNULL
    with subprocess.Popen(
        command, stdin=pipe, stdout=pipe, stderr=nothing, env=child_environment("disable"), process_group=0
    ) as child:
        try:
            yield partial(_draw_there, child)
        finally:
            if child.poll() is None:
                os.killpg(child.pid, signal.SIGKILL)


def _draw_there(child: subprocess.Popen[bytes], folder: Path) -> list[Path]:
    with suppress(OSError, ValueError):  # it has ended
        said = json.loads(child.communicate(os.fsencode(folder.absolute()))[0])
        return [folder / name for name in said]
    return _draw_here(folder)  # which says what is wrong


def _draw_here(folder: Path) -> list[Path]:
    from escort_mj.report.figures.figures import draw_figures

    return draw_figures(folder)


def _cores() -> int:
    return min(len(os.sched_getaffinity(0)), MOST_PROCESSES)


def _draw_side_by_side(folder: Path) -> list[Path]:
    """Draw the figures of a run folder in processes that are forked from this one."""
    from escort_mj.record.folder import read_run
    from escort_mj.report.figures.figures import plots_of

    _runs.append(run := read_run(folder))
    with ProcessPoolExecutor(_cores(), multiprocessing.get_context("fork")) as pool:
        return [*pool.map(_draw_one, plots_of(run.recording))]


_runs: list[StoredRun] = []  # the one to draw, which the processes that draw its figures are forked with


def _draw_one(name: str) -> Path:
    from escort_mj.report.figures.figures import draw_plot

    return draw_plot(_runs[-1], name)


def wait_and_draw() -> int:
    """Wait for a run folder, and draw its figures.

    Returns:
        The exit code.
    """
    gc.disable()  # looking for garbage took a tenth of the time, and this process soon ends
    import escort_mj.report.figures.figures  # noqa: F401  slow to import

    if folder := sys.stdin.buffer.read():
        path = Path(os.fsdecode(folder))
        print(json.dumps([str(each.relative_to(path)) for each in _draw_side_by_side(path)]))
    return 0


if __name__ == "__main__":
    sys.exit(wait_and_draw())
