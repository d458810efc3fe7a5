"""Work side by side in processes, with results in order and progress as they come."""

from __future__ import annotations

import atexit
import multiprocessing
import os
import signal
import tempfile
import threading
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, suppress
from functools import partial
from itertools import islice
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import wait as wait_for
from multiprocessing.context import ForkServerContext, ForkServerProcess
from pathlib import Path
from typing import Any, TypeVar

from escort_mj import stopping, supervised
from escort_mj.errors import EscortError

Item = TypeVar("Item")
Result = TypeVar("Result")

WORK = "escort_mj.study.engine.work"  # the module that worker processes need
FORKED = "escort_mj.study.engine.forked"  # imported before it where they are forked
AHEAD = 3  # jobs that are waiting for each worker
TRIES = 3  # of a job whose worker dies


class Died(str):
    """What the worker processes of a job died of, which killed every one that tried it; empty if unknown."""


def cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1


class _Context(ForkServerContext):
    """Starts worker processes, and knows which."""

    def __init__(self) -> None:
        self.started: list[ForkServerProcess] = []

    def Process(self, *about: Any, **more: Any) -> ForkServerProcess:  # type: ignore[override]  # noqa: N802
        """A process that the executor asks for."""
        process = ForkServerProcess(*about, **more)
        self.started.append(process)
        return process


def parent_of_workers() -> _Context:
    """Start the process that worker processes are forked from, or find it.

    It imports what a run needs, once for all workers, while this process gets ready itself: call this early.
    Workers are not forked from this process, whose threads and native callbacks would not survive it. Ctrl-C
    in a terminal goes to all processes; workers leave it to this one.

    A worker imports the user's script. If that has no main guard and starts workers again, the worker ends
    without a word; the process that wanted it says why.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        os._exit(1)
    context = _Context()
    context.set_forkserver_preload([FORKED, WORK])
    with stopping.deferred():
        resource_tracker.ensure_running()  # which would end the block below
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # which the process inherits
        before = _parent()
        try:
            forkserver.ensure_running()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        if (number := _parent()) is not None and number != before:
            atexit.register(_end_parent, number)
    return context


def _parent() -> int | None:
    """Number of the process that worker processes are forked from."""
    return getattr(forkserver._forkserver, "_forkserver_pid", None)


def _end_parent(number: int | None) -> None:
    """End the process that worker processes are forked from: by itself it would import to the end first."""
    if number is not None and _parent() == number:
        with suppress(ProcessLookupError):
            os.kill(number, signal.SIGKILL)


def _begin(pages: str) -> None:
    """Tell the process that wants this worker's results which plugin it calls, and end when that is gone.

    Args:
        pages: Folder in which workers tell it, in files with the numbers of their processes.
    """
    supervised.own_page = supervised.page_in(Path(pages) / str(os.getpid()))
    parent = multiprocessing.parent_process()
    assert parent is not None, "a worker has a parent"

    def follow() -> None:
        wait_for([parent.sentinel])
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


class _Pool:
    """Some worker processes, until one of them dies."""

    def __init__(self, count: int) -> None:
        self._context = parent_of_workers()
        self._pages = tempfile.TemporaryDirectory(prefix="escort_mj_", ignore_cleanup_errors=True)
        self._executor = ProcessPoolExecutor(
            count, self._context, initializer=_begin, initargs=(self._pages.name,)
        )

    def submit(self, function: Callable[..., Result], *arguments: Any) -> Future[Result]:
        # A worker that starts is to be known; where that waits for imports, it has to do without them.
        with stopping.deferred(lambda: _end_parent(_parent())):
            return self._executor.submit(function, *arguments)

    def close(self) -> None:
        """Lets workers go that have nothing to do."""
        self._executor.shutdown(cancel_futures=True)

    def kill(self) -> None:
        """Ends workers whatever they do."""
        with stopping.deferred():
            for process in self._context.started:
                if process.pid is not None:
                    process.kill()
            self._executor.shutdown(cancel_futures=True)

    def end_overdue(self) -> None:
        """End workers in which a plugin's code takes so long that they do not break it off themselves."""
        for process in self._context.started:
            page = self._page(process)
            if page is not None and page.overdue and process.pid is not None:
                page.tell(f"{page.words}: {supervised.too_long()}", timed=False)
                os.kill(process.pid, signal.SIGKILL)

    def cause(self) -> str:
        """What the first worker that died died of, and what it called, once all have ended."""
        codes = {process: process.exitcode for process in self._context.started}
        calling = {process: page.words for process in codes if (page := self._page(process)) and page.words}
        first = [
            process
            for process, code in codes.items()
            if code not in (None, -signal.SIGTERM) and (code or process in calling)  # others were asked to
        ]
        if not first:
            return "it ended"
        found = next((process for process in first if process in calling), first[0])
        words, code = calling.get(found, ""), codes[found] or 0
        return supervised.told(words, code) if words else supervised.ending(code)

    def _page(self, process: ForkServerProcess) -> supervised.Page | None:
        """What a worker says; None where it has not begun."""
        file = Path(self._pages.name) / str(process.pid)
        return supervised.page_in(file) if file.exists() else None


class Workers:
    """Worker processes that compute jobs. A context manager, at whose end no process is left."""

    def __init__(self, count: int) -> None:
        """Starts none yet.

        Args:
            count: How many there are to be.
        """
        self._count, self._cause = count, ""
        self._pool: _Pool | None = None

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.close() if kind is None else pool.kill()

    def compute(
        self, function: Callable[[Item], Result], jobs: Iterable[Item]
    ) -> Generator[tuple[Item, Result | Died], None, None]:
        """Computes jobs, a few ahead of what takes the results.

        A worker that dies takes nothing with it: its jobs are computed again.

        Args:
            function: Of a module's top level.
            jobs: Taken as they are wanted.

        Yields:
            Jobs and results as they come, or what the workers died of that tried a job.
        """
        waiting = iter(jobs)
        flying: dict[Future[Result], tuple[Item, int]] = {}  # with the tries that they have had
        again: list[tuple[Item, int]] = []
        try:
            while True:
                self._pool = self._pool or _Pool(self._count)
                try:
                    # Suspects first and one at a time, so that it is seen which of them kills its worker.
                    while again:
                        job, tries = again.pop()
                        future = self._pool.submit(function, job)
                        flying[future] = job, tries
                        while not wait([future], supervised.LOOK).done:
                            self._pool.end_overdue()
                        result = future.result()
                        del flying[future]
                        yield job, result
                    while True:
                        while len(flying) < AHEAD * self._count and (more := list(islice(waiting, 1))):
                            flying[self._pool.submit(function, more[0])] = more[0], 0
                        if not flying:
                            return
                        done = wait(flying, supervised.LOOK, FIRST_COMPLETED).done
                        if not done:
                            self._pool.end_overdue()
                        for future in done:
                            result = future.result()
                            job, _ = flying.pop(future)
                            yield job, result
                except BrokenProcessPool:
                    self._replace()
                    for future, (job, tries) in flying.items():
                        if future.done() and not future.cancelled() and future.exception() is None:
                            yield job, future.result()
                        elif tries + 1 < TRIES:
                            again.append((job, tries + 1))
                        else:
                            yield job, Died(self._cause)
                    flying.clear()
        except BaseException:
            pool, self._pool = self._pool, None
            if pool is not None:
                pool.kill()
            raise

    def _replace(self) -> None:
        """Puts others in the place of workers one of which died, once they start: jobs are not to blame else.

        Raises:
            EscortError: If they do not start.
        """
        broken, self._pool = self._pool, None
        if broken is not None:
            broken.close()
            self._cause = broken.cause()
        self._pool = _Pool(self._count)
        try:
            self._pool.submit(os.getpid).result()
        except BrokenProcessPool:
            raise EscortError(
                "worker processes do not start; a script that uses them keeps what it does "
                'under  if __name__ == "__main__":'
            ) from None


def _one(function: Callable[[Item], Result], job: tuple[int, Item]) -> tuple[Result]:
    """The result of a numbered item, told from none."""
    return (function(job[1]),)


def side_by_side(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    workers: int,
    progress: Callable[[float, float], None] | None = None,
    lost: Callable[[Item, str], Result] | None = None,
) -> list[Result]:
    """Call a function for every item.

    Processes, not threads: a run takes samples in Python between its native stretches, and on two cores two
    threads need longer than one after the other.

    Args:
        function: Of the top level of a module, since it goes to other processes; so do items and results.
        items: What to call it with.
        workers: Processes; 1 stays in this one, unless an item is not to take this process with it.
        progress: Called with the number of items done and of all.
        lost: The result of an item that kills every process that tries it, from that and what they died of.

    Returns:
        One result per item, in the order of the items.

    Raises:
        EscortError: If a process was killed time and again, and `lost` is not given; whatever the function
            itself raises.
    """
    workers = min(workers, len(items))
    found: dict[int, Result] = {}

    def note(number: int, result: Result) -> None:
        found[number] = result
        if progress is not None:
            progress(len(found), len(items))

    if not items or (workers == 1 and lost is None):
        for number, item in enumerate(items):
            note(number, function(item))
    else:
        jobs = list(enumerate(items))
        with Workers(workers) as pool, closing(pool.compute(partial(_one, function), jobs)) as results:
            for (number, item), result in results:
                if not isinstance(result, Died):
                    note(number, result[0])
                elif lost is not None:
                    note(number, lost(item, result))
                else:
                    raise EscortError(
                        f"processes that compute were killed {TRIES} times ({result}; out of memory?); "
                        "what had ended is kept: run this again"
                    )
    return [found[number] for number in range(len(items))]
