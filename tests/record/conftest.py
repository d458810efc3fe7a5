"""Synthetic records, and runs that write them."""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from escort_mj.measuring import measures_of, summarize
from escort_mj.record.outcome import Outcome
from escort_mj.signals import SIGNALS
from tests.synthetic import begin_run, build_trace, describe, dimensions, make_verdict, pack

# Signals of whole numbers, with the least and the largest that a record has.
WHOLE = (
    ({"avoidance_active"}, 0, 1),
    ({"ruling"}, -1, 1),
    ({"phase", "opponent_status", "interceptor", "threat", "target_seen", "heard_from"}, 0, 2),
    ({"messages_sent", "messages_heard", "messages_lost"}, 0, 2),
    ({"goals_left"}, 0, 3),
    ({"lost"}, 0, 0),
    ({"member_of", "obstacle_team"}, 1, 1),
)


@pytest.fixture
def record() -> Callable[..., tuple[np.ndarray, dict[str, int], dict[str, Any]]]:
    """Random samples with their sizes and labels."""

    def make(
        rows: int, robots: int = 3, axes: int = 2, obstacles: int = 2, seed: int = 0
    ) -> tuple[np.ndarray, dict[str, int], dict[str, Any]]:
        sizes = dimensions(robots, axes, obstacles, teams=int(obstacles > 0))
        random = np.random.default_rng(seed)
        given = {
            s.name: random.standard_normal((rows, *(sizes[d] for d in s.dims)))
            for s in SIGNALS[1:]
            if s.recorded(sizes)
        }
        for total in {"saturated_time", "effort", "work", "force_variation", "mover_work"} & given.keys():
            given[total] = np.cumsum(np.abs(given[total]), axis=0)
        for names, least, most in WHOLE:
            for name in sorted(names & given.keys()):
                given[name] = random.integers(least, most + 1, given[name].shape)
        for name in ("clearance_body", "target_clearance_body"):
            given[name] = random.integers(-1, robots + obstacles, given[name].shape)
        for name in ("outer_updates", "contacts_untold"):
            given[name] = np.cumsum(random.integers(0, 10, given[name].shape), axis=0)
        return pack(0.02 * np.arange(rows), sizes, **given), sizes, describe(sizes)

    return make


# A run in a process of its own: writes blocks of 100 samples until it is killed, or says why it may not.
CHILD = """
import json, sys, time
from pathlib import Path
import numpy as np
from escort_mj.errors import EscortError
from escort_mj.record.folder import RunFolder

path, kind = sys.argv[1:]
sizes, labels, width = json.loads(sys.stdin.read())
try:
    folder = RunFolder.create(Path(path))
except EscortError as error:
    print(error, flush=True)
    sys.exit(error.exit_code)
if kind == "writes":
    folder.begin("name: synthetic\\n", "<mujoco/>\\n", sizes, labels)
row = 0
print("ready", flush=True)
while True:
    if kind == "writes":
        block = np.full((100, width), 0.5)
        block[:, 0] = 0.02 * np.arange(row, row + 100)
        row += 100
        folder.append(block)
    time.sleep(0.001)
"""


@pytest.fixture
def start_run() -> Iterator[Callable[..., subprocess.Popen]]:
    """Starts runs in processes of their own; none outlives its test."""
    started: list[subprocess.Popen] = []

    def start(path: Path, made: Any, kind: str = "writes") -> subprocess.Popen:
        samples, sizes, labels = made
        process = subprocess.Popen(
            [sys.executable, "-c", CHILD, str(path), kind],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        assert process.stdin is not None
        process.stdin.write(json.dumps([sizes, labels, samples.shape[1]]))
        process.stdin.close()
        return process

    yield start
    for process in started:
        end(process)


def end(process: subprocess.Popen) -> None:
    """Kills a process as kill -9 does."""
    process.kill()
    process.wait()
    assert process.stdout is not None
    process.stdout.close()


@pytest.fixture
def killed(start_run: Callable[..., subprocess.Popen]) -> Callable[..., int]:
    """A run that got under way and was killed; its process number."""

    def run(path: Path, made: Any, kind: str = "writes") -> int:
        process = start_run(path, made, kind)
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        written = path / "journal" / "samples.f64"
        while kind == "writes" and not written.stat().st_size:
            time.sleep(0.001)
        end(process)
        return process.pid

    return run


@pytest.fixture
def finish() -> Callable[..., Any]:
    """A run that ended in order; its trace."""

    def run(path: Path, made: Any, outcome: Outcome = Outcome.COMPLETED, overwrite: bool = False) -> Any:
        trace = build_trace(*made)
        metrics = summarize(measures_of(trace), trace, outcome, 42, 0.5)
        begin_run(path, made, overwrite).finish(outcome, "it ended", trace, metrics, [make_verdict()])
        return trace

    return run
