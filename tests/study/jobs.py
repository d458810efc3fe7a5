"""Jobs for tests of backends: of a module's top level, so that other processes find them."""

import os
import signal
import time
from pathlib import Path
from typing import NamedTuple


class Job(NamedTuple):
    number: int
    folder: Path
    deaths: int = 0  # how many workers it kills before it is done


def work(job: Job) -> int:
    """The square of a number; some kill their worker first, a few times."""
    tried = len(list(job.folder.glob(f"{job.number}-*")))
    (job.folder / f"{job.number}-{os.getpid()}-{tried}").touch()
    if tried < job.deaths:
        os.kill(os.getpid(), signal.SIGKILL)
    return job.number**2


def stumble(job: Job) -> int:
    raise ValueError(f"job {job.number}")


def sleep(job: Job) -> int:
    """Says who works, and does nothing for long."""
    (job.folder / str(os.getpid())).touch()
    time.sleep(300.0)
    return 0
