"""Backends: every job once, whoever dies."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from escort_mj.study.engine.backends import Backend, dask, local, threads
from escort_mj.study.engine.parallel import Died
from tests.study.jobs import Job, sleep, stumble, work

DASK = pytest.param("dask", marks=pytest.mark.slow)


def start(kind: str) -> AbstractContextManager[Backend[Job, int]]:
    """A backend of two workers, or none."""
    if kind == "dask":
        pytest.importorskip("distributed", reason="Dask is an extra")
    make = {"dask": dask, "threads": threads}.get(kind, local)
    return make(1 if kind == "here" else 2)


@pytest.mark.parametrize("kind", ["here", "local", "threads"])  # dask: below, where a worker dies
def test_every_job_once(kind: str, tmp_path: Path) -> None:
    jobs = [Job(number, tmp_path) for number in range(40)]
    with start(kind) as backend:
        results = list(backend(work, iter(jobs)))
        assert list(backend(work, iter([]))) == []
    assert sorted(results) == [(job, job.number**2) for job in jobs]
    assert len(list(tmp_path.iterdir())) == 40


@pytest.mark.parametrize("kind", ["local", DASK])
def test_a_worker_that_dies_takes_nothing_with_it(kind: str, tmp_path: Path) -> None:
    jobs = [Job(number, tmp_path, deaths=1 if number == 3 else 0) for number in range(30)]
    with start(kind) as backend:
        results = list(backend(work, iter(jobs)))
    assert sorted(results) == [(job, job.number**2) for job in jobs]


@pytest.mark.parametrize("kind", ["local", DASK])
def test_a_job_that_kills_every_worker_becomes_a_result(kind: str, tmp_path: Path) -> None:
    jobs = [Job(number, tmp_path, deaths=99 if number == 5 else 0) for number in range(12)]
    with start(kind) as backend:
        results = dict(backend(work, iter(jobs)))
    died = results.pop(jobs[5])
    assert isinstance(died, Died)
    assert died == ("killed by SIGKILL" if kind == "local" else "")  # Dask does not say
    assert results == {job: job.number**2 for job in jobs if job.number != 5}


@pytest.mark.parametrize("kind", ["here", "local", "threads", DASK])
def test_an_error_of_the_job_is_an_error(kind: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="job 0"), start(kind) as backend:
        list(backend(stumble, iter([Job(0, tmp_path)])))


def test_jobs_are_taken_as_they_are_wanted(tmp_path: Path) -> None:
    """A study of a million runs must not be laid out in memory."""
    taken = 0

    def jobs() -> Iterator[Job]:
        nonlocal taken
        for number in range(1000):
            taken += 1
            yield Job(number, tmp_path)

    with local(2) as backend:
        results = backend(work, jobs())
        for _ in range(10):
            next(results)
        assert taken <= 10 + 2 * 3 + 2
        results.close()


MAIN = """
import sys
from pathlib import Path
from escort_mj.study.engine.backends import local
from tests.study.jobs import Job, sleep

if __name__ == "__main__":
    with local(2) as backend:
        list(backend(sleep, [Job(k, Path(sys.argv[1])) for k in range(4)]))
"""


@pytest.mark.slow
def test_workers_go_when_the_process_that_wants_them_is_killed(tmp_path: Path) -> None:
    (tmp_path / "main.py").write_text(MAIN)
    (tmp_path / "workers").mkdir()
    root = str(Path(__file__).parents[3])
    process = subprocess.Popen(
        [sys.executable, str(tmp_path / "main.py"), str(tmp_path / "workers")],
        env=os.environ | {"PYTHONPATH": root},
    )
    assert until(lambda: len(list((tmp_path / "workers").iterdir())) == 2)
    process.kill()
    process.wait()
    workers = [Path("/proc") / path.name for path in (tmp_path / "workers").iterdir()]
    assert until(lambda: not any(worker.exists() for worker in workers))


SWEEP = """
import escort_mj
study = {"study": "few", "scenario": "main", "set": {"duration": 0.1, "expect": []}, "seeds": 2}
escort_mj.sweep(study, "out", workers=2)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "script",
    [
        MAIN.replace('if __name__ == "__main__":', "if True:"),
        pytest.param(SWEEP, id="whose folder is locked"),
    ],
)
def test_a_script_that_its_workers_cannot_import_is_told_so(tmp_path: Path, script: str) -> None:
    (tmp_path / "main.py").write_text(script)
    ended = subprocess.run(
        [sys.executable, str(tmp_path / "main.py"), str(tmp_path)],
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode != 0
    assert "worker processes do not start" in ended.stderr
    assert '__name__ == "__main__"' in ended.stderr.splitlines()[-1]
    assert ended.stderr.count("Traceback") == 1, "workers end without a word"


@pytest.mark.parametrize(
    "begun", [pytest.param("", marks=pytest.mark.slow), "list(parallel.Workers(2).compute(str, [1, 2]))"]
)
def test_an_interrupt_does_not_wait_until_workers_can_be_forked(begun: str, tmp_path: Path) -> None:
    (tmp_path / "slow_to_import.py").write_text("import time\ntime.sleep(60.0)\n")
    program = f"""
import os, signal, threading
from escort_mj import stopping
from escort_mj.study.engine import parallel

def run():
    parallel.parent_of_workers()
    threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
    {begun}
    threading.Event().wait()

if __name__ == "__main__":
    parallel.WORK = "slow_to_import"
    stopping.command(run)
"""
    (tmp_path / "program.py").write_text(program)
    done = subprocess.run([sys.executable, "program.py"], cwd=tmp_path, capture_output=True, timeout=30.0)
    assert done.returncode == 130  # and nobody holds its output any longer


@pytest.mark.parametrize("kind", ["local", DASK])
def test_an_interrupt_leaves_no_worker(kind: str, tmp_path: Path) -> None:
    def interrupt() -> None:
        until(lambda: len(list(tmp_path.iterdir())) == 2)
        os.kill(os.getpid(), signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), start(kind) as backend:
            threading.Thread(target=interrupt, daemon=True).start()
            list(backend(sleep, [Job(number, tmp_path) for number in range(4)]))
    finally:
        signal.signal(signal.SIGINT, before)
    workers = [Path("/proc") / path.name for path in tmp_path.iterdir()]
    assert until(lambda: not any(worker.exists() for worker in workers), 3.0)


def until(there: Callable[[], bool], patience: float = 60.0) -> bool:
    """Waits for something."""
    end = time.monotonic() + patience
    while not there() and time.monotonic() < end:
        time.sleep(0.05)
    return there()
