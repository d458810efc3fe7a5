"""Progress, shown where somebody looks: a bar on a terminal, a line in a notebook, nothing in a pipe."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[float, float], None]
"""Called with what is done and with all there is to do."""


def unseen(done: float, total: float) -> None:
    """Show nothing."""


INTERVAL = 0.2  # s between two changes of a notebook's line


@contextmanager
def shown_progress(label: str, unit: str, wanted: bool | Progress | None = None) -> Iterator[Progress]:
    """Show progress.

    Args:
        label: What is being done.
        unit: What is counted, with a space before it.
        wanted: What to call instead; False for nothing; None for a bar on a terminal or in a notebook.
    """
    if callable(wanted):
        yield wanted
    elif wanted is not False and in_notebook():
        with _line(label, unit) as update:
            yield update
    elif wanted or (wanted is None and sys.stderr is not None and sys.stderr.isatty()):
        with terminal_bar(label, unit) as update:
            yield update
    else:
        yield unseen


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


@contextmanager
def terminal_bar(label: str, unit: str) -> Iterator[Callable[[float, float], None]]:
    """A progress bar on a terminal, with rate and time left."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f}" + unit),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=1.0, rate="")

        def update(done: float, total: float) -> None:
            speed = bar.tasks[0].speed
            bar.update(task, completed=done, total=total, rate=f"{speed:.1f}{unit}/s" if speed else "")

        yield update


@contextmanager
def _line(label: str, unit: str) -> Iterator[Progress]:
    """A line of a cell's output that is written over."""
    shown, last = "", -INTERVAL

    def update(done: float, total: float) -> None:
        nonlocal shown, last
        now = time.monotonic()
        if now - last < INTERVAL and done < total:
            return
        last, words = now, f"{label}: {done:.0f} of {total:.0f}{unit}"
        print(f"\r{words:<{len(shown)}}", end="", flush=True)
        shown = words

    try:
        yield update
    finally:
        print("\r" + " " * len(shown) + "\r", end="", flush=True)
