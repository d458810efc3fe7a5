"""Work side by side in processes: a worker that dies costs the job that it did, which is tried again."""

from __future__ import annotations

import atexit
import multiprocessing
import os
import signal
import tempfile
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable
from contextlib import suppress
from itertools import islice
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from multiprocessing.context import ForkServerContext
from pathlib import Path
from queue import SimpleQueue
from typing import Any, TypeVar

from escort_mj import stopping, supervised
from escort_mj.errors import EscortError
from escort_mj.files import temporary_folder

Item = TypeVar("Item")
Result = TypeVar("Result")

WORK = "escort_mj.study.engine.work"  # the module that worker processes need
FORKED = "escort_mj.study.engine.forked"  # imported before it where they are forked
AHEAD = 3  # jobs that are waiting for each worker
TRIES = 3  # of a job whose worker dies
UNBORN = (
    "worker processes do not start; a script that uses them keeps what it does "
    'under  if __name__ == "__main__":'
)


class Died(str):
    """What the worker processes of a job died of, which killed every one that tried it; empty if unknown."""


def cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1


def parent_of_workers() -> ForkServerContext:
    """Start the process that worker processes are forked from, or find it.

    It imports what a run needs, once for all workers, while this process gets ready itself: call this early.
    Workers are not forked from this process, whose threads and native callbacks would not survive it. Ctrl-C
    in a terminal goes to all processes; workers leave it to this one.
    """
    context = ForkServerContext()
    context.set_forkserver_preload([FORKED, WORK])
    with stopping.deferred():
        temporary_folder()
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


def _serve(pipe: Connection, pages: str) -> None:
    """Be a worker: do jobs as they come, until none comes any more or the process that wants them is gone.

    Args:
        pipe: Brings functions and jobs, and takes whether each was done and what came of it.
        pages: Folder in which workers tell which plugin they call, in files with their processes' numbers.
    """
    with suppress(OSError):  # a full disk
        supervised.own_page = supervised.page_in(Path(pages) / str(os.getpid()))
    parent = multiprocessing.parent_process()
    assert parent is not None, "a worker has a parent"

    def follow() -> None:
        wait_for([parent.sentinel])
        os._exit(1)

    given: SimpleQueue[Any] = SimpleQueue()

    def take() -> None:
        """Take jobs at once, or two ends that send would wait for each other."""
        while True:
            try:
                given.put(pipe.recv())
            except (EOFError, OSError):
                given.put(None)
                return

    for work in (follow, take):
        threading.Thread(target=work, daemon=True).start()
    pipe.send(None)  # it has started
    while (task := given.get()) is not None:
        function, job = task
        try:
            answer = True, function(job)
        except Exception as error:
            answer = False, error
        with suppress(OSError):
            pipe.send(answer)


class _Worker:
    """A worker process, and the jobs that it was given.

    Attributes:
        jobs: The first is the one that it does; with the tries that each has had.
        pipe: To it.
        begun: Whether it has started.
    """

    def __init__(self, pages: str) -> None:
        self.jobs: deque[tuple[Any, int]] = deque()
        self.begun, self._pages = False, Path(pages)
        context = parent_of_workers()
        self.pipe, its = context.Pipe()
        self._process = context.Process(target=_serve, args=(its, pages))
        # A worker that starts is to be known; where that waits for imports, it has to do without them.
        with stopping.deferred(lambda: _end_parent(_parent())):
            self._process.start()
        its.close()

    def give(self, function: Callable[[Any], Any], job: Any, tries: int) -> None:
        """Give it a job; one that has died says so when it is asked for results."""
        self.jobs.append((job, tries))
        with suppress(OSError):
            self.pipe.send((function, job))

    @property
    def _page(self) -> supervised.Page | None:
        """What it says; None where it says nothing."""
        file = self._pages / str(self._process.pid)
        try:
            return supervised.page_in(file) if file.exists() else None
        except OSError:
            return None

    def end_overdue(self) -> None:
        """End it if a plugin's code takes so long that it does not break that off itself."""
        if (page := self._page) is not None and page.overdue:
            page.tell(f"{page.words}: {supervised.too_long()}", timed=False)
            self._process.kill()

    def cause(self) -> str:
        """What it died of, and what it called."""
        self._process.join()
        page, code = self._page, self._process.exitcode or 0
        return (
            supervised.told(page.words, code) if page is not None and page.words else supervised.ending(code)
        )

    def end(self, kill: bool) -> None:
        """Let it go, or end it whatever it does."""
        if kill and self._process.pid is not None:
            self._process.kill()
        self.pipe.close()

    def join(self) -> None:
        """Wait until it has ended."""
        if self._process.pid is not None:
            self._process.join()


class Workers:
    """Worker processes that compute jobs. A context manager, at whose end no process is left."""

    def __init__(self, count: int) -> None:
        """Starts none yet.

        A worker imports the user's script. If that has no main guard and wants workers again, the worker ends
        here without a word, before it waits for what the first process holds; that one says why.

        Args:
            count: How many there are to be.
        """
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            os._exit(1)
        self._count = count
        self._workers: list[_Worker] = []
        self._pages = tempfile.TemporaryDirectory(dir=temporary_folder(), ignore_cleanup_errors=True)

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._end(kill=kind is not None)
        self._pages.cleanup()

    def _end(self, kill: bool) -> None:
        with stopping.deferred():
            for worker in self._workers:
                worker.end(kill)
            for worker in self._workers:
                worker.join()
            self._workers = []

    def compute(
        self, function: Callable[[Item], Result], jobs: Iterable[Item]
    ) -> Generator[tuple[Item, Result | Died], None, None]:
        """Computes jobs, a few ahead of what takes the results.

        A worker that dies takes nothing with it: another one does its jobs.

        Args:
            function: Of a module's top level.
            jobs: Taken as they are wanted.

        Yields:
            Jobs and results as they come, or what the workers died of that tried a job.

        Raises:
            EscortError: If workers do not start.
        """
        untaken = iter(jobs)
        waiting: deque[tuple[Item, int]] = deque()
        unborn = 0
        try:
            while True:
                waiting += ((job, 0) for job in islice(untaken, max(AHEAD * self._count - len(waiting), 0)))
                self._hand_out(function, waiting)
                busy = [worker for worker in self._workers if worker.jobs]
                if not busy:
                    return
                ready = wait_for([worker.pipe for worker in busy], supervised.LOOK)
                for worker in busy if not ready else ():
                    worker.end_overdue()
                for worker in busy:
                    if worker.pipe not in ready:
                        continue
                    try:
                        answer = worker.pipe.recv()
                    except (EOFError, OSError):
                        self._workers.remove(worker)
                        cause, unborn = worker.cause(), unborn + (not worker.begun)
                        if unborn == TRIES:
                            raise EscortError(UNBORN) from None
                        job, tries = worker.jobs.popleft()
                        waiting.extendleft(reversed(worker.jobs))
                        if tries + worker.begun < TRIES:
                            waiting.appendleft((job, tries + worker.begun))
                        else:
                            yield job, Died(cause)
                        continue
                    if answer is None:
                        worker.begun, unborn = True, 0
                        continue
                    done, result = answer
                    if not done:
                        raise result
                    yield worker.jobs.popleft()[0], result
        except BaseException:
            self._end(kill=True)
            raise

    def _hand_out(self, function: Callable[[Item], Result], waiting: deque[tuple[Item, int]]) -> None:
        """Give each worker a job, and one ahead while there are enough that none waits for a slow worker."""
        while waiting:
            worker = min(self._workers, key=lambda one: len(one.jobs), default=None)
            if len(self._workers) < self._count and (worker is None or worker.jobs):
                worker = _Worker(self._pages.name)
                self._workers.append(worker)
            assert worker is not None, "there is one at least"
            if len(worker.jobs) > 1 or (worker.jobs and len(waiting) <= self._count):
                return
            worker.give(function, *waiting.popleft())
