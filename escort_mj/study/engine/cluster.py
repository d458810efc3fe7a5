"""A Dask cluster of this machine's own, in a session of its own: whatever happens, it goes as one.

Dask starts and closes workers in its own time, and says much when that is interrupted.
"""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from escort_mj.errors import EscortError

CLOSING = 5.0  # s that a cluster has to close by itself


@contextmanager
def cluster(workers: int) -> Iterator[tuple[str, Callable[[], None]]]:
    """Start a cluster; its scheduler's address, and what kills it at once.

    Args:
        workers: How many processes, each with one thread.

    Raises:
        EscortError: If it does not start.
    """
    # -P: what lies in the user's folder by the name of a module is none of Dask's.
    command = [sys.executable, "-P", "-m", "escort_mj.study.engine.cluster", str(workers)]
    child = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        start_new_session=True,
    )
    assert child.stdin is not None and child.stdout is not None

    def kill() -> None:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)

    try:
        address = child.stdout.readline().strip()
        if not address:
            raise EscortError(
                "--backend dask: the cluster did not start (python -m escort_mj.study.engine.cluster 1)"
            )
        yield address, kill
        child.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            child.wait(CLOSING)
    finally:
        kill()
        child.wait()
        child.stdout.close()


def _serve(workers: int) -> None:
    """Is a cluster until standard input ends, as it does when it is no longer needed."""
    from distributed import LocalCluster

    ended = threading.Event()

    def follow() -> None:
        sys.stdin.read()
        ended.set()
        time.sleep(CLOSING)
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=follow, daemon=True).start()
    with LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",  # None takes port 8787, and warns where another has it
        silence_logs=logging.CRITICAL,
    ) as started:
        print(started.scheduler_address, flush=True)
        ended.wait()


if __name__ == "__main__":
    _serve(int(sys.argv[1]))
