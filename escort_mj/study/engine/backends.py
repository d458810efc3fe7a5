"""Where the runs of a study are computed: processes or threads of this machine, or workers of a Dask cluster.

A backend takes jobs as they are wanted and gives results as they come; what a job computes depends on nothing
but the job, so every backend gives the same bits. A worker that dies takes nothing with it: its jobs are done
again, and a job that kills its worker time and again becomes a result of its own.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Any, TypeVar

from escort_mj.errors import UsageError
from escort_mj.mission.batch import in_threads
from escort_mj.scenario.findings import shown
from escort_mj.study.engine.cluster import cluster
from escort_mj.study.engine.parallel import AHEAD, Died, Workers

Job = TypeVar("Job")
Result = TypeVar("Result")
Results = Generator[tuple[Job, Result | Died], None, None]
Backend = Callable[[Callable[[Job], Result], Iterable[Job]], Results[Job, Result]]
"""Called with a function of a module's top level and jobs; `Died` is the result of one that kills workers."""

CONNECTING = 20  # s that a scheduler has to answer


def here(function: Callable[[Job], Result], jobs: Iterable[Job]) -> Results[Job, Result]:
    """Computes jobs in this process, one after the other."""
    for job in jobs:
        yield job, function(job)


@contextmanager
def threads(workers: int) -> Iterator[Backend[Any, Any]]:
    """Threads of this process: nothing has to start, but a job that kills its process kills all.

    Args:
        workers: How many cores to keep busy; 1 computes in this thread.
    """

    def compute(function: Callable[[Job], Result], jobs: Iterable[Job]) -> Results[Job, Result]:
        yield from in_threads(lambda job: (job, function(job)), jobs, workers)

    yield compute


@contextmanager
def local(workers: int) -> Iterator[Backend[Any, Any]]:
    """Processes of this machine; at the end none is left.

    Args:
        workers: How many; 1 computes in this process.
    """
    if workers == 1:
        yield here
        return
    with Workers(workers) as pool:  # kept from call to call: a search makes many small ones
        yield pool.compute


@contextmanager
def dask(workers: int, address: str | None = None) -> Iterator[Backend[Any, Any]]:
    """Workers of a Dask cluster, on this machine or on many.

    Args:
        workers: Worker processes of a cluster of this machine's own, where no address is given.
        address: Of a cluster's scheduler that runs already, such as tcp://host:8786.

    Raises:
        UsageError: If Dask is not installed, or nothing answers at the address.
    """
    try:
        import distributed
    except ImportError:
        raise UsageError(
            "--backend dask: Dask is not installed; pip install 'escort-mj[dask]' adds it"
        ) from None

    with ExitStack() as stack:
        where, kill = (address, None) if address is not None else stack.enter_context(cluster(workers))
        for name in [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]:
            logging.getLogger(name).setLevel(logging.CRITICAL)
        try:
            client = stack.enter_context(distributed.Client(where, timeout=CONNECTING, set_as_default=False))
        except (OSError, ValueError, TypeError) as error:  # the latter two of what is no address
            raise UsageError(f"--backend dask: no cluster answers at {shown(where)}: {error}") from None
        if kill is not None:  # before the client asks a busy scheduler for leave to go
            stack.push(lambda kind, *_: kill() if kind is not None else None)
        yield partial(_as_they_come, client, workers)


def _as_they_come(
    client: Any, workers: int, function: Callable[[Job], Result], jobs: Iterable[Job]
) -> Results[Job, Result]:
    """Hands jobs to a cluster, a few ahead, and yields results."""
    from distributed import KilledWorker, as_completed

    waiting = iter(jobs)
    flying: dict[Any, Job] = {}
    results = as_completed(loop=client.loop, raise_errors=False)

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
        yield job, Died() if isinstance(future.exception(), KilledWorker) else future.result()
