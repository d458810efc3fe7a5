"""A run whose process is killed leaves what it had recorded, and costs its own result alone."""

import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from escort_mj import sweep
from escort_mj.api import scenarios_folder
from escort_mj.record.folder import read_run
from escort_mj.record.stored import JOURNAL, read_outcome
from escort_mj.study.check import check_scenarios
from escort_mj.study.checked import Case
from escort_mj.study.engine import parallel
from escort_mj.study.sweeps.definition import load_study
from escort_mj.study.sweeps.design import Design

pytestmark = pytest.mark.usefixtures("compiled")


@pytest.fixture
def killer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Kills each process that writes a run in a folder, once it has written something."""
    monkeypatch.setattr(parallel, "TRIES", 2)

    def kill(folder: Path) -> None:
        samples, killed = folder / JOURNAL / "samples.f64", {os.getpid()}
        end = time.monotonic() + 60.0
        while len(killed) <= parallel.TRIES and time.monotonic() < end:
            time.sleep(0.01)
            if (
                samples.is_file()
                and samples.stat().st_size
                and (pid := read_outcome(folder)["pid"]) not in killed
            ):
                os.kill(pid, signal.SIGKILL)
                killed.add(pid)

    def begin(folder: Path) -> threading.Thread:
        thread = threading.Thread(target=kill, args=(folder,))
        thread.start()
        return thread

    return begin


def recorded(folder: Path) -> float:
    """How far a killed run came [s]."""
    stored = read_run(folder)
    assert stored.outcome["outcome"] == "killed"
    return float(stored.trace["time"][-1])


@pytest.mark.slow
def test_a_check_keeps_what_a_killed_run_recorded_and_goes_on(killer: Any, tmp_path: Path) -> None:
    main = scenarios_folder() / "main.yaml"
    long = Case(main, "long", overrides=("duration=20000", "expect=[]"))
    short = Case(main, "short", overrides=("duration=1", "expect=[]"))
    thread = killer(tmp_path / "long")
    first, second = check_scenarios([long, short], tmp_path, workers=1)
    thread.join()
    assert recorded(tmp_path / "long") > 1.0
    assert first.code == 3 and first.folder == tmp_path / "long"
    assert first.error.startswith("its worker process died, time and again: killed by SIGKILL")
    assert f"{tmp_path / 'long'} holds it up to {recorded(tmp_path / 'long'):.2f} s" in first.error
    assert second.code == 0 and not (tmp_path / "short").exists()


def test_a_study_keeps_what_a_killed_run_recorded_and_goes_on(killer: Any, tmp_path: Path) -> None:
    study = {"study": "s", "scenario": "main", "set": {"expect": []}, "traces": "failed"}
    study["vary"] = {"duration": [20000, 1, 2]}
    design = Design(load_study(study), scenarios_folder())
    place = tmp_path / "runs" / design.folder_of(next(iter(design.runs())))
    thread = killer(place)
    table = sweep(study, tmp_path, workers=2, confirmed=True, progress=False).table
    thread.join()
    assert list(table["outcome"]) == ["killed", "completed", "completed"]
    assert f"{place} holds it up to {recorded(place):.2f} s" in table["message"][0]
    assert recorded(place) > 1.0
