"""Sweeps: every run of a study once, whatever happens on the way; the same bits wherever they are made."""

import csv
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

from escort_mj.errors import EscortError, ScenarioError, UsageError
from escort_mj.measuring import measures_of
from escort_mj.mission import fly
from escort_mj.record.folder import read_run
from escort_mj.record.tables import parted
from escort_mj.stopping import Interrupted
from escort_mj.study.engine.backends import dask, here, local
from escort_mj.study.engine.store import FILE, Row, Store
from escort_mj.study.engine.work import Job, perform
from escort_mj.study.sweeps.design import Design
from escort_mj.study.sweeps.sweep import check_size, sweep_design
from tests.limits import files_up_to
from tests.plugged import METRIC
from tests.study import planted

STUDY = """
study: small
scenario: main
set: {duration: 0.4, expect: [{metric: contacts, at_most: 0}]}
seeds: 3
vary: {controller: [apd_smc, pd], robots.mass: [0.5, 2]}
"""


def design(folder: Path, text: str = STUDY) -> Design:
    return planted.design(folder, text)


def table(folder: Path) -> list[dict[str, str]]:
    with (folder / "runs.csv").open() as file:
        return [{parted(head)[0]: cell for head, cell in row.items()} for row in csv.DictReader(file)]


def stored(folder: Path) -> list[dict[str, str]]:
    with sqlite3.connect(folder / FILE) as connection:
        return [{"folder": folder} for (folder,) in connection.execute("SELECT folder FROM runs")]


@pytest.fixture(scope="module")
def made(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of the study, made by one process in one go; they stay as they are."""
    folder = tmp_path_factory.mktemp("made")
    seen: list[tuple[float, float]] = []
    laid_out = design(folder)
    swept = sweep_design(laid_out, folder / "out", here, 1, progress=lambda *now: seen.append(now))
    assert swept == (12, 12, 0, 0, 4) and seen[-1] == (12, 12)
    rows = table(folder / "out")
    assert [row["key"] for row in rows] == [run.key for run in laid_out.runs()]
    assert {row["outcome"] for row in rows} == {"completed"}
    return folder / "out"


@pytest.fixture
def out(made: Path, tmp_path: Path) -> Path:
    """The same for a test that goes on with them."""
    return Path(shutil.copytree(made, tmp_path / "out"))


def test_a_run_is_never_made_again(out: Path, tmp_path: Path) -> None:
    before = (out / "runs.csv").read_bytes()
    assert sweep_design(design(tmp_path), out, here, 1) == (12, 0, 0, 0, 4)
    assert (out / "runs.csv").read_bytes() == before


def test_a_row_is_what_a_run_of_its_own_gives(out: Path, tmp_path: Path) -> None:
    laid_out = design(tmp_path)
    run = list(laid_out.runs())[7]
    alone = fly(laid_out.scenario(laid_out.cells[run.cell], run.seed))
    with Store(out) as store:
        row = store.get([run.key])[run.key]
    assert row.metrics == {name: found.value for name, found in measures_of(alone.trace).items()}
    assert row.versions["mujoco"] == alone.trace.attrs["version_mujoco"]
    assert "seed: 2" in row.scenario


def test_a_changed_study_makes_only_what_is_new(out: Path, tmp_path: Path) -> None:
    text = STUDY.replace("[apd_smc, pd]", "[pd]").replace("[0.5, 2]", "[0.5, 3]")
    assert sweep_design(design(tmp_path, text.replace("seeds: 3", "seeds: 4")), out, here, 1) == (
        8,
        5,
        0,
        0,
        2,
    )


def test_what_is_interrupted_is_not_stored_and_goes_on(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    laid_out, out = design(tmp_path), tmp_path / "out"
    keys: list[str] = []

    def until_the_fifth(job: Job) -> Row:
        if len(keys) == 5:
            signal.raise_signal(signal.SIGINT)
        keys.append(job.key)
        return perform(job)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with monkeypatch.context() as patch, pytest.raises(Interrupted, match="5 of 12 runs are kept in"):
            patch.setattr("escort_mj.study.sweeps.sweep.perform", until_the_fifth)
            sweep_design(laid_out, out, here, 1, confirmed=True)
    finally:
        signal.signal(signal.SIGINT, before)
    with Store(out) as store:
        assert store.known() == set(keys)
    assert sweep_design(laid_out, out, here, 1).made == 12 - 5
    assert (out / "runs.csv").read_bytes() == (made / "runs.csv").read_bytes()


@pytest.mark.parametrize("kind", ["local", pytest.param("dask", marks=pytest.mark.slow)])
def test_processes_give_the_same_bits(made: Path, tmp_path: Path, kind: str) -> None:
    if kind == "dask":
        pytest.importorskip("distributed", reason="Dask is an extra")
    with {"local": local, "dask": dask}[kind](2) as backend:
        sweep_design(design(tmp_path), tmp_path / "two", backend, 2)
    assert (made / "runs.csv").read_bytes() == (tmp_path / "two" / "runs.csv").read_bytes()


def test_what_goes_wrong_is_a_row(tmp_path: Path) -> None:
    """A verdict that fails, a run that diverges, a seed without room: each with its words."""
    text = STUDY.replace("contacts, at_most: 0", "radius_error_max, at_most: 1.0e-6").replace(
        "robots.mass: [0.5, 2]", "mission.radius: [5.0, 6.0]"
    )
    text += "traces: failed\n"
    out = tmp_path / "out"
    swept = sweep_design(design(tmp_path, text.replace("seeds: 3", "seeds: 1")), out, here, 1)
    assert swept.failed == swept.runs
    rows = table(out)
    assert {row["passed"] for row in rows} == {"False"}
    folders = sorted((out / "runs").iterdir())
    assert len(folders) == sum(row["outcome"] == "completed" for row in rows)
    assert not read_run(folders[0]).verdicts[1].passed


def test_a_run_that_ends_as_its_scenario_expects_did_not_break(tmp_path: Path) -> None:
    text = "study: s\nscenario: faults/blown_away\nvary: {expect: [%s]}\n"
    as_expected = design(tmp_path, text % "[{outcome: diverged}], [{outcome: completed}]")
    swept = sweep_design(as_expected, tmp_path / "out", here, 1)
    assert (swept.runs, swept.failed, swept.broken) == (2, 1, 1)
    assert [row["outcome"] for row in table(tmp_path / "out")] == ["diverged"] * 2


def test_a_large_study_says_so_before_it_begins(tmp_path: Path) -> None:
    laid_out, out = design(tmp_path, STUDY + "at_most: {runs: 11}\n"), tmp_path / "out"
    many = r"takes 12 runs, more than at_most.runs allows \(11\); --yes"
    with pytest.raises(UsageError, match=many):  # before its cells are laid out
        check_size(laid_out.file, out)
    with pytest.raises(UsageError, match=many):
        sweep_design(laid_out, out, here, 1)
    check_size(design(tmp_path, STUDY + "at_most: {runs: 12}\n").file, out)
    few = STUDY.replace("seeds: 3", "seeds: 1")
    slow = design(tmp_path, few + "at_most: {hours: 1.0e-7}\n")
    with pytest.raises(UsageError, match=r"would take .* h on 1 workers, more than at_most.hours"):
        sweep_design(slow, out, here, 1)
    assert sweep_design(slow, out, here, 1, confirmed=True).made == 3  # the one that was timed is kept


SCRIPT = """
import sys
from pathlib import Path
from escort_mj.api import scenarios_folder
from escort_mj.study.engine.backends import local
from escort_mj.study.sweeps.definition import load_study
from escort_mj.study.sweeps.design import Design
from escort_mj.study.sweeps.sweep import sweep_design
if __name__ == "__main__":
    study, out, workers = sys.argv[1:]
    design = Design(load_study(study), scenarios_folder())
    with local(int(workers)) as backend:
        print(sweep_design(design, Path(out), backend, int(workers), True))
"""


def begin(folder: Path, out: Path, workers: int) -> "subprocess.Popen[str]":
    script = folder / "script.py"
    script.write_text(SCRIPT)
    command = [sys.executable, str(script), str(folder / "study.yaml"), str(out), str(workers)]
    return subprocess.Popen(command, text=True, stdout=subprocess.PIPE, start_new_session=True)


def count(out: Path) -> int:
    try:
        with sqlite3.connect(out / FILE, timeout=10) as connection:
            return int(connection.execute("SELECT count(*) FROM runs").fetchone()[0])
    except sqlite3.OperationalError:
        return 0


MANY = STUDY.replace("seeds: 3", "seeds: 8")


@pytest.fixture(scope="module")
def whole(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The table of 32 runs made by one process in one go."""
    folder = tmp_path_factory.mktemp("whole")
    sweep_design(design(folder, MANY), folder / "out", here, 1, confirmed=True)
    return (folder / "out" / "runs.csv").read_bytes()


@pytest.mark.slow
def test_killed_twice_and_begun_again_nothing_is_lost_or_doubled(tmp_path: Path, whole: bytes) -> None:
    design(tmp_path, MANY)
    out = tmp_path / "out"
    chance, kills, reached = random.Random(4), 0, 0
    while reached < 32 and kills < 2:
        process = begin(tmp_path, out, 1 + kills % 2)
        goal = min(reached + chance.randint(1, 9), 31)
        deadline = time.monotonic() + 120.0
        while count(out) < goal and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        kills += 1
        assert count(out) >= reached
        reached = count(out)
    assert 0 < reached < 32
    finished = begin(tmp_path, out, 2)
    assert finished.communicate(timeout=240)[0].startswith(f"Swept(runs=32, made={32 - reached}")
    assert (out / "runs.csv").read_bytes() == whole


@pytest.mark.slow
def test_two_at_once_share_the_work(tmp_path: Path, whole: bytes) -> None:
    design(tmp_path, MANY)
    out = tmp_path / "out"
    both = [begin(tmp_path, out, 1) for _ in range(2)]
    said = [process.communicate(timeout=240)[0] for process in both]
    made = [int(words.partition("made=")[2].partition(",")[0]) for words in said]
    assert sum(made) == 32
    assert (out / "runs.csv").read_bytes() == whole


def test_an_impossible_seed_is_a_row_of_its_own(tmp_path: Path) -> None:
    text = "study: s\nscenario: main\nset: {duration: 0.1, expect: [], robots.positions: null,"
    laid_out = design(tmp_path, text + " robots.placement: {within: 3, least_gap: 0.1}}\n")
    (run,) = laid_out.runs()
    settings = laid_out.cells[0].settings | {"robots.placement.within": 0.5}
    row = perform(Job(run.key, 1, settings, laid_out.templates["main"].text, "main", None, None, False))
    assert row.outcome == "failed"
    assert "no free place" in row.message
    assert not row.passed


def test_metrics_of_plugins_are_kept_and_stand_in_the_table(tmp_path: Path) -> None:
    (tmp_path / "own_metric.py").write_text(METRIC)
    text = STUDY.replace("set: {", "set: {plugins: [own_metric.py], ").replace("seeds: 3", "seeds: 1")
    out = tmp_path / "out"
    assert sweep_design(design(tmp_path, text), out, here, 1).failed == 0
    rows = table(out)
    assert len(rows) == 4 and all(float(row["farthest"]) > 1.0 for row in rows)
    wrong = text + "tune: {over: {robots.radius: {low: 0.1, high: 0.3}}, objectives: [{metric: farthes}]}\n"
    with pytest.raises(ScenarioError, match='found .farthes.; .*did you mean "farthest"'):
        design(tmp_path, wrong)
    assert design(tmp_path, wrong.replace("farthes}", "farthest}")).study.tune is not None


def test_a_full_disk_is_no_result_of_a_run(tmp_path: Path) -> None:
    text = STUDY.replace("seeds: 3", "seeds: 1") + "traces: all\n"
    laid_out, out = design(tmp_path, text), tmp_path / "out"
    sweep_design(laid_out, tmp_path / "warm", here, 1, True)
    with files_up_to(60_000), pytest.raises(EscortError, match="cannot be written"):
        sweep_design(laid_out, out, here, 1, True)
    assert sweep_design(laid_out, out, here, 1, True) == (4, 4, 0, 0, 4)
    assert all(read_run(out / row["folder"]).outcome["outcome"] == "completed" for row in stored(out))


def test_what_an_accident_ended_is_made_again_where_that_is_wanted(out: Path, tmp_path: Path) -> None:
    laid_out = design(tmp_path)
    with sqlite3.connect(out / FILE) as connection:
        connection.execute("UPDATE runs SET outcome = 'killed', passed = 0 WHERE seed = 1")
    assert sweep_design(laid_out, out, here, 1, True)[:3] == (12, 0, 4)
    assert sweep_design(laid_out, out, here, 1, True, again="broken_off")[:3] == (12, 4, 0)
