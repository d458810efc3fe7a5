"""Work side by side in processes, with results in order and progress as they come."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.context import ForkServerContext
from multiprocessing.forkserver import ensure_running
from typing import TypeVar

from escort_mj.errors import EscortError

Item = TypeVar("Item")
Result = TypeVar("Result")

WORK = "escort_mj.study.work"  # the module that worker processes need


def cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1


def parent_of_workers() -> ForkServerContext:
    """Starts the process that worker processes are forked from, or finds it.

    It imports what a run needs, once for all workers, while this process gets ready itself: call this early.
    Workers are not forked from this process, whose threads and native callbacks would not survive it.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([WORK])
    ensure_running()
    return context


def side_by_side(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    workers: int,
    progress: Callable[[float, float], None] | None = None,
) -> list[Result]:
    """Calls a function for every item.

    Processes, not threads: a run takes samples in Python between its native stretches, and on two cores two
    threads need longer than one after the other.

    Args:
        function: Of the top level of a module, since it goes to other processes; so do items and results.
        items: What to call it with.
        workers: Processes; 1 stays in this one.
        progress: Called with the number of items done and of all.

    Returns:
        One result per item, in the order of the items.

    Raises:
        EscortError: If a process was killed; whatever the function itself raises.
    """
    workers = min(workers, len(items))
    results: list[Result] = []
    if workers <= 1:
        for item in items:
            results.append(function(item))
            if progress is not None:
                progress(len(results), len(items))
        return results
    pool = ProcessPoolExecutor(workers, mp_context=parent_of_workers())
    try:
        futures = [pool.submit(function, item) for item in items]
        pending: set[Future[Result]] = set(futures)
        while pending:
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for future in done:
                future.result()  # what went wrong goes wrong here, at once
            if progress is not None:
                progress(len(items) - len(pending), len(items))
        return [future.result() for future in futures]
    except BrokenProcessPool:
        raise EscortError(
            "a process was killed from outside (out of memory?); what had ended is kept: run this again"
        ) from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
