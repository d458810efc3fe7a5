"""Where the runs of a study are computed: processes or threads of this machine, or workers of a Dask cluster.

A backend takes jobs as they are wanted and gives results as they come; what a job computes depends on nothing
but the job, so every backend gives the same bits. A worker that dies takes nothing with it: its jobs are done
again, and a job that kills its worker time and again becomes a result of its own.
"""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from multiprocessing.connection import wait as wait_for
from typing import Any, TypeVar

from escort_mj.batch import in_threads
from escort_mj.errors import EscortError, UsageError
from escort_mj.study.parallel import parent_of_workers

Job = TypeVar("Job")
Result = TypeVar("Result")
Backend = Callable[[Callable[[Job], Result], Iterable[Job]], Iterator[tuple[Job, Result | None]]]
"""Called with a function of a module's top level and jobs; None stands for a job that killed its workers."""

AHEAD = 3  # jobs that are waiting for each worker
TRIES = 3  # of a job whose worker dies
DASK_RESTARTS = 30  # seconds that a worker that died has to start anew before its cluster is closed


def here(function: Callable[[Job], Result], jobs: Iterable[Job]) -> Iterator[tuple[Job, Result | None]]:
    """Computes jobs in this process, one after the other."""
    for job in jobs:
        yield job, function(job)


def threads(workers: int) -> Backend[Any, Any]:
    """Threads of this process: nothing has to start, but a job that kills its process kills all.

    Args:
        workers: How many cores to keep busy; 1 computes in this thread.
    """

    def compute(
        function: Callable[[Job], Result], jobs: Iterable[Job]
    ) -> Iterator[tuple[Job, Result | None]]:
        yield from in_threads(lambda job: (job, function(job)), jobs, workers)

    return compute


def _pool(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, parent_of_workers(), initializer=_die_with_parent)


def _working_pool(workers: int) -> ProcessPoolExecutor:
    """A pool whose workers start, so that jobs are not blamed where they do not.

    Raises:
        EscortError: If they do not start.
    """
    pool = _pool(workers)
    try:
        pool.submit(os.getpid).result()
    except BrokenProcessPool:
        pool.shutdown(wait=False)
        raise EscortError(
            "worker processes do not start; a script that uses them keeps what it does "
            'under  if __name__ == "__main__":'
        ) from None
    return pool


def _die_with_parent() -> None:
    """Ends this worker when the process that wants its results is gone, however that ended."""
    parent = multiprocessing.parent_process()
    assert parent is not None, "a worker has a parent"

    def follow() -> None:
        wait_for([parent.sentinel])
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def local(workers: int) -> Backend[Any, Any]:
    """Processes of this machine.

    Args:
        workers: How many; 1 computes in this process.
    """
    if workers == 1:
        return here
    idle: list[ProcessPoolExecutor] = []  # kept for the next call: a search makes many small ones

    def compute(
        function: Callable[[Job], Result], jobs: Iterable[Job]
    ) -> Iterator[tuple[Job, Result | None]]:
        waiting = iter(jobs)
        again: list[tuple[Job, int]] = []  # with the tries that they have had
        while True:
            # Not forked from this process, whose threads and native callbacks would not survive it.
            pool = idle.pop() if idle else _pool(workers)
            flying: dict[Future[Result], tuple[Job, int]] = {}
            try:
                # Suspects first and one at a time, so that it is seen which of them kills its worker.
                while again:
                    job, tries = again.pop()
                    future = pool.submit(function, job)
                    flying[future] = job, tries
                    result = future.result()
                    del flying[future]
                    yield job, result
                while True:
                    while len(flying) < AHEAD * workers and (more := list(islice(waiting, 1))):
                        flying[pool.submit(function, more[0])] = more[0], 0
                    if not flying:
                        idle.append(pool)
                        return
                    for future in wait(flying, return_when=FIRST_COMPLETED).done:
                        result = future.result()
                        job, _ = flying.pop(future)
                        yield job, result
            except BrokenProcessPool:
                pool.shutdown(wait=False)
                idle.append(_working_pool(workers))
                for future, (job, tries) in flying.items():
                    if future.done() and not future.cancelled() and future.exception() is None:
                        yield job, future.result()
                    elif tries + 1 < TRIES:
                        again.append((job, tries + 1))
                    else:
                        yield job, None
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise

    return compute


def dask(workers: int, address: str | None = None) -> Backend[Any, Any]:
    """Workers of a Dask cluster, on this machine or on many.

    Args:
        workers: Worker processes of a cluster of this machine's own, where no address is given.
        address: Of a cluster's scheduler that runs already, such as tcp://host:8786.

    Raises:
        UsageError: If Dask is not installed, or nobody answers at the address.
    """
    try:
        import distributed
    except ImportError:
        raise UsageError(
            "--backend dask: Dask is not installed; pip install 'escort-mj[dask]' adds it"
        ) from None

    def compute(
        function: Callable[[Job], Result], jobs: Iterable[Job]
    ) -> Iterator[tuple[Job, Result | None]]:
        with contextlib.ExitStack() as stack:
            try:
                if address is None:
                    client = stack.enter_context(_cluster_here(workers))
                else:
                    client = stack.enter_context(distributed.Client(address, timeout=20))
            except OSError as error:
                raise UsageError(f"--backend dask: no cluster answers at {address}: {error}") from None
            yield from _as_they_come(client, workers, function, jobs)

    return compute


@contextlib.contextmanager
def _cluster_here(workers: int) -> Iterator[Any]:
    """A cluster of this machine's own, and its client."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",  # None takes port 8787, and warns where another has it
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster) as client,
    ):
        try:
            yield client
        finally:
            # Dask fails, or leaves processes behind, where it closes while it starts a worker anew.
            with contextlib.suppress(TimeoutError):
                client.wait_for_workers(workers, timeout=DASK_RESTARTS)


def _as_they_come(
    client: Any, workers: int, function: Callable[[Job], Result], jobs: Iterable[Job]
) -> Iterator[tuple[Job, Result | None]]:
    """Hands jobs to a cluster, a few ahead, and yields results."""
    from distributed import KilledWorker, as_completed

    waiting = iter(jobs)
    flying: dict[Any, Job] = {}
    results = as_completed(raise_errors=False)

    def launch() -> bool:
        job = next(waiting, None)
        if job is None:
            return False
        future = client.submit(function, job, pure=False)
        flying[future] = job
        results.add(future)
        return True

    for _ in range(AHEAD * max(workers, len(client.scheduler_info()["workers"]))):
        if not launch():
            break
    suspects: list[Job] = []
    for future in results:
        job = flying.pop(future)
        if isinstance(future.exception(), KilledWorker):
            suspects.append(job)
        else:
            yield job, future.result()
        launch()
    # Dask blames whatever was waiting at a worker that died: one at a time shows which job it was.
    for job in suspects:
        future = client.submit(function, job, pure=False)
        yield job, None if isinstance(future.exception(), KilledWorker) else future.result()
