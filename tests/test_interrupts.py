"""Interrupts at random moments: every command stops soon, in order, without a trace; what resumes ends alike.

`ESCORT_MJ_INTERRUPTS` says how many are sent in all, spread over the commands, and
`ESCORT_MJ_INTERRUPT_SEED` when.
"""

import json
import math
import os
import random
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from escort_mj.record.folder import read_run

pytestmark = [pytest.mark.slow, pytest.mark.timeout(7200)]

COUNT = int(os.environ.get("ESCORT_MJ_INTERRUPTS", "16"))
SEED = int(os.environ.get("ESCORT_MJ_INTERRUPT_SEED", "1"))
SOON, SOON_COLD = 3.0, 10.0  # s of a machine that does nothing else
RUN, RUN_COLD = 6.0, 25.0  # s within which a run that has no end is interrupted
MARK = "ESCORT_MJ_INTERRUPTED"  # in the environment of all that a command starts

SCENARIO = """\
name: mission
duration: {duration}
target: {{position: ['0.3*t', '2*sin(0.2*t)']}}
robots: {{count: 4}}
obstacles: [{{position: [9, 4], radius: 0.6}}]
sensing: {{position: {{noise: 0.01}}}}
expect: [{{contacts: none}}]
"""
STUDIES = {
    "sweep": "vary: {robots.mass: [1, 2, 3, 1.5], mission.radius: [4, 5]}\n",
    "tune": "tune: {over: {controller.slope: {low: 1, high: 50}}, objectives: [{metric: radius_error_mean}],"
    " trials: 4, batch: 2, held_out: 1, verdicts: false}\n",
    "falsify": "falsify: {over: {robots.mass: {low: 0.5, high: 3}}, method: random, runs: 8, batch: 4}\n",
}


class Command(NamedTuple):
    """A command to interrupt, and what it leaves that must not depend on interrupts."""

    arguments: tuple[str, ...]
    tables: Callable[[Path], Any] | None = None
    cold: bool = False  # whether machine code is compiled at every start


def facts(*files: str) -> Callable[[Path], Any]:
    """What tables say, but for how much of it was made in which go."""

    def read(folder: Path) -> Any:
        found = []
        for name in files:
            text = (folder / name).read_text()
            found.append(_plain(json.loads(text)) if name.endswith(".json") else text)
        return found

    return read


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items() if k not in ("made", "ran", "scenario", "folder")}
    return [_plain(one) for one in value] if isinstance(value, list) else value


QUIET = ("--no-video", "--no-figures")
COMMANDS = {
    "run": Command(("run", "long.yaml", *QUIET)),
    "run cold": Command(("run", "long.yaml", *QUIET), cold=True),
    "check": Command(("check", "several", "--workers", "2", "--no-video")),
    "sweep": Command(("sweep", "sweep.yaml", "--workers", "2"), facts("runs.csv")),
    "sweep here": Command(("sweep", "sweep.yaml", "--workers", "1"), facts("runs.csv")),
    "threads": Command(("sweep", "sweep.yaml", "--workers", "2", "--backend", "threads"), facts("runs.csv")),
    "dask": Command(("sweep", "sweep.yaml", "--workers", "2", "--backend", "dask"), facts("runs.csv")),
    "tune": Command(
        ("tune", "tune.yaml", "--workers", "2", "--no-figures"), facts("trials.csv", "tune.json")
    ),
    "falsify": Command(("falsify", "falsify.yaml", "--workers", "2", "--no-video"), facts("falsify.json")),
    "compare": Command(
        ("compare", "mission.yaml", "--laws", "apd_smc,pd,asmc", "--seeds", "2", "--workers", "2"),
        facts("runs.csv", "table.json"),
    ),
}


class Told(NamedTuple):
    """How a command ended, and what it said."""

    code: int
    out: str
    err: str
    seconds: float


class Bench:
    """A folder with input for every command, and what commands give where nothing disturbs them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "long.yaml").write_text(SCENARIO.format(duration=20_000))
        (folder / "mission.yaml").write_text(SCENARIO.format(duration=60))
        (folder / "several").mkdir()
        for k in range(6):
            (folder / "several" / f"{k}.yaml").write_text(SCENARIO.format(duration=60 + k))
        for name, text in STUDIES.items():
            (folder / f"{name}.yaml").write_text(f"study: {name}\nscenario: mission.yaml\n{text}")
        self.undisturbed: dict[str, tuple[float, Any]] = {}

    def start(self, name: str, out: str) -> tuple[subprocess.Popen[str], str]:
        mark = f"{MARK}={uuid.uuid4()}"
        key, value = mark.split("=")
        cache = self.folder / f"cache of {out}"
        empty = {"ESCORT_MJ_CACHE_DIR": str(cache)} if COMMANDS[name].cold else {}
        process = subprocess.Popen(
            [sys.executable, "-m", "escort_mj", *COMMANDS[name].arguments, "--out", out],
            cwd=self.folder,
            env=os.environ | {key: value} | empty,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        return process, mark

    def whole(self, name: str, out: str) -> Told:
        """A command that nobody interrupts."""
        began = time.monotonic()
        process, mark = self.start(name, out)
        said, err = process.communicate()
        told = Told(process.returncode, said, err, time.monotonic() - began)
        assert told.code in (0, 1) and "Exception ignored" not in err and "Traceback" not in err, told
        assert gone(mark), (name, marked(mark))
        return told

    def expected(self, name: str) -> tuple[float, Any]:
        """How long a command takes, and its tables."""
        if name not in self.undisturbed:
            tables = COMMANDS[name].tables
            if name.startswith("run"):
                self.undisturbed[name] = RUN_COLD if COMMANDS[name].cold else RUN, None
            else:
                self.whole(name, "warm")  # kernels are there from now on
                out = f"whole {name}"
                told = self.whole(name, out)
                self.undisturbed[name] = told.seconds, tables(self.folder / out) if tables else None
        return self.undisturbed[name]


def marked(mark: str) -> list[str]:
    """Command lines of living processes that a command has started."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if mark in (process / "environ").read_bytes().decode(errors="replace").split("\0"):
                found.append((process / "cmdline").read_bytes().replace(b"\0", b" ").decode()[:200])
        except OSError:
            continue
    return found


def gone(mark: str) -> bool:
    """Whether all processes of a command end, soon after it."""
    end = time.monotonic() + soon() / 2.0
    while marked(mark) and time.monotonic() < end:
        time.sleep(0.02)
    return not marked(mark)


def soon(cold: bool = False) -> float:
    """A few seconds, as long as they are on a machine that has as much else to do as this one [s]."""
    return (SOON_COLD if cold else SOON) * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Bench(tmp_path_factory.mktemp("interrupts"))


@pytest.fixture(scope="module")
def slowest() -> Iterator[dict[str, list[float]]]:
    """How long commands took to stop, by their names; said at the end."""
    found: dict[str, list[float]] = {}
    yield found
    for name, times in found.items():
        middle = sorted(times)[len(times) // 2]
        print(f"\n{name}: {len(times)} interrupts, median {middle:.2f} s, slowest {max(times):.2f} s", end="")


def interrupted(bench: Bench, name: str, out: str, chance: random.Random) -> Told | None:
    """Interrupts a command at some moment; None if it had ended before."""
    usual, _ = bench.expected(name)
    delay = chance.uniform(0.0, usual if chance.random() < 0.7 else min(usual, 2.0))
    number = chance.choice([signal.SIGINT, signal.SIGTERM])
    process, mark = bench.start(name, out)
    while not catches(process, signal.SIGTERM):  # until then it is Python that starts, as for any program
        time.sleep(0.005)
    try:
        said, err = process.communicate(timeout=delay)
        assert process.returncode in (0, 1), (process.returncode, said, err)
        return None
    except subprocess.TimeoutExpired:
        pass
    patience, began = soon(COMMANDS[name].cold), time.monotonic()
    if chance.random() < 0.5:
        process.send_signal(number)
    else:  # as a terminal and `timeout` do
        os.killpg(process.pid, number)
    try:
        said, err = process.communicate(timeout=patience + 60.0)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        raise AssertionError(
            f"goes on after {number.name} at {delay:.3f} s: {process.communicate()[1]}"
        ) from None
    told = Told(process.returncode, said, err, time.monotonic() - began)
    about = f"{number.name} after {delay:.3f} s: {told.code} in {told.seconds:.2f} s\n{err}"
    assert gone(mark), f"{about}\nleft: {marked(mark)}"
    if told.code in (0, 1, -number) and said and not err:
        return None  # it had ended: only Python had not
    assert told.code == 130, about
    *notes, last = err.splitlines()
    assert last.startswith("escort-mj: interrupted; "), about
    assert all("the trace will take" in note or "is there already" in note for note in notes), about
    assert told.seconds < max(patience, soon(COMMANDS[name].cold)), about
    return told


def catches(process: subprocess.Popen[str], number: signal.Signals) -> bool:
    """Whether a process has a handler of its own for a signal, or has ended."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    caught = next(line for line in status.splitlines() if line.startswith("SigCgt"))
    return bool(int(caught.split()[1], 16) >> (number - 1) & 1) or process.poll() is not None


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_stops_soon_and_leaves_nothing_but_what_it_says(
    bench: Bench, slowest: dict[str, list[float]], name: str
) -> None:
    chance = random.Random(f"{SEED} {name}")
    _, expected = bench.expected(name)
    wanted, sent, fresh, ended = math.ceil(COUNT / len(COMMANDS)), 0, 0, 0
    wrong: list[str] = []
    while sent < wanted:
        out = f"{name} {fresh}"
        try:
            told = interrupted(bench, name, out, chance)
        except AssertionError as error:
            wrong.append(str(error))
            sent, fresh = sent + 1, fresh + 1
            continue
        if told is not None:
            sent += 1
            slowest.setdefault(name, []).append(told.seconds)
            if (bench.folder / out / "outcome.json").is_file():
                readable(bench.folder / out, told)
        else:
            ended += 1
            assert ended < 10 * wanted, "the command always ends before it is interrupted"
            compare(bench, name, out, expected)
        if told is None or COMMANDS[name].arguments[0] == "run":
            fresh += 1
    if COMMANDS[name].tables is not None:
        bench.whole(name, f"{name} {fresh}")
        compare(bench, name, f"{name} {fresh}", expected)
    assert not wrong, "\n".join([f"{len(wrong)} of {sent} interrupts", *wrong])


def compare(bench: Bench, name: str, out: str, expected: Any) -> None:
    """The tables of a command that was interrupted and went on are those of one that was not."""
    tables = COMMANDS[name].tables
    if tables is not None:
        assert tables(bench.folder / out) == expected


def readable(folder: Path, told: Told) -> None:
    """The folder of an interrupted run says how far it came, and holds that much."""
    outcome = json.loads((folder / "outcome.json").read_text())
    assert outcome["outcome"] == "interrupted", (outcome, told)
    if outcome.get("simulated_time"):
        stored = read_run(folder)
        assert float(stored.trace["time"][-1]) == pytest.approx(outcome["simulated_time"])
        assert stored.verdicts and "metrics.json" in {path.name for path in folder.iterdir()}
