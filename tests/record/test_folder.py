import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray

from escort_mj.errors import RunFolderError
from escort_mj.record.folder import RunFolder, read_run
from escort_mj.record.outcome import Outcome
from tests.synthetic import begin_run, build_trace, make_verdict


def outcome_of(path: Path) -> dict:
    return json.loads((path / "outcome.json").read_text(), parse_constant=pytest.fail)


class TestARunThatEnds:
    def test_the_folder_gives_back_everything(self, tmp_path, record, finish):
        path = tmp_path / "renders" / "main"
        trace = finish(path, record(300), Outcome.DIVERGED)
        stored = read_run(path)
        xarray.testing.assert_identical(stored.trace, trace)
        assert stored.path == path
        assert stored.scenario_yaml == "name: synthetic\n"
        assert stored.verdicts == [make_verdict()]
        assert stored.metrics["energy"]["unit"] == "J"
        assert (path / "model.xml").read_text() == "<mujoco/>\n"
        names = {entry.name for entry in path.iterdir()}
        assert names == {
            "outcome.json", "scenario.yaml", "model.xml", "trace.nc", "metrics.json", "verdicts.json",
        }  # fmt: skip
        outcome = stored.outcome
        assert (outcome["outcome"], outcome["message"]) == ("diverged", "it ended")
        assert outcome["simulated_time"] == pytest.approx(0.02 * 299)
        assert (outcome["steps"], outcome["wall_time"]) == (42, 0.5)
        assert outcome["versions"] == {"numpy": np.__version__}
        assert outcome["platform"] == "some machine"
        assert outcome["started"] <= outcome["ended"]
        assert outcome["pid"] == os.getpid()

    def test_every_json_is_free_of_nan(self, tmp_path, record):
        made = record(3)
        metric = {"value": np.nan, "unit": "J", "window": [0.0, 1.0], "time": np.inf, "who": ""}
        verdict = make_verdict(margin=-np.inf)
        folder = begin_run(tmp_path / "run", made)
        folder.finish(Outcome.COMPLETED, "", build_trace(*made), {"energy": metric}, [verdict])
        for file in (tmp_path / "run").glob("*.json"):
            json.loads(file.read_text(), parse_constant=pytest.fail)
        stored = read_run(tmp_path / "run")
        assert stored.metrics == {"energy": metric | {"value": None, "time": None}}
        assert stored.verdicts == [make_verdict(margin=None)]

    def test_a_run_can_be_looked_at_while_it_goes_on(self, tmp_path, record):
        made = record(200)
        RunFolder.create(tmp_path / "preparing")
        with pytest.raises(RunFolderError, match="still preparing"):
            read_run(tmp_path / "preparing")
        begin_run(tmp_path / "run", made)
        stored = read_run(tmp_path / "run")
        assert stored.outcome["outcome"] == "running"
        xarray.testing.assert_identical(stored.trace, build_trace(*made))
        assert stored.metrics == {}
        assert outcome_of(tmp_path / "run")["outcome"] == "running"

    def test_a_run_that_ends_while_it_is_looked_at(self, tmp_path, record, monkeypatch):
        made = record(10)
        folder = begin_run(tmp_path / "run", made)
        trace = build_trace(*made)

        def ends_meanwhile(outcome):
            folder.finish(Outcome.COMPLETED, "it ended", trace, {}, [make_verdict()])
            return True

        monkeypatch.setattr("escort_mj.record.stored.alive", ends_meanwhile)
        stored = read_run(tmp_path / "run")
        assert stored.outcome["outcome"] == "completed"
        xarray.testing.assert_identical(stored.trace, trace)

    def test_append_needs_a_beginning(self, tmp_path, record):
        with pytest.raises(RunFolderError, match="has not begun"):
            RunFolder.create(tmp_path / "run").append(record(1)[0])


class TestARunThatBreaks:
    def test_an_error_ends_the_run_as_failed_with_its_trace(self, tmp_path, record):
        made = record(20)
        with pytest.raises(ZeroDivisionError), begin_run(tmp_path / "run", made):
            raise ZeroDivisionError("by zero")
        stored = read_run(tmp_path / "run")
        assert stored.outcome["outcome"] == "failed"
        assert stored.outcome["message"] == "ZeroDivisionError: by zero"
        xarray.testing.assert_identical(stored.trace, build_trace(*made))
        assert not (tmp_path / "run" / "journal").exists()

    def test_an_error_before_the_first_step_frees_the_folder(self, tmp_path, record, finish):
        with pytest.raises(KeyError), RunFolder.create(tmp_path / "run"):
            raise KeyError("model")
        with pytest.raises(RunFolderError, match="failed: KeyError: 'model'; it left nothing"):
            read_run(tmp_path / "run")
        finish(tmp_path / "run", record(2))

    def test_a_stop_from_the_keyboard_is_an_interruption(self, tmp_path):
        with pytest.raises(KeyboardInterrupt), RunFolder.create(tmp_path / "run"):
            raise KeyboardInterrupt
        outcome = outcome_of(tmp_path / "run")
        assert (outcome["outcome"], outcome["message"]) == ("interrupted", "KeyboardInterrupt")

    def test_an_interrupted_run_leaves_its_trace_to_the_reader(self, tmp_path, record):
        made = record(20)
        trace = build_trace(*made)
        folder = begin_run(tmp_path / "run", made)
        folder.finish(Outcome.INTERRUPTED, "by SIGINT", trace, {}, [make_verdict()])
        assert outcome_of(tmp_path / "run")["simulated_time"] == made[0][-1, 0]
        assert (tmp_path / "run" / "verdicts.json").is_file()
        assert not (tmp_path / "run" / "trace.nc").exists()
        for _ in range(2):  # from the journal, then from what the first reader wrote
            stored = read_run(tmp_path / "run")
            assert stored.outcome["outcome"] == "interrupted"
            xarray.testing.assert_identical(stored.trace, trace)
            assert (tmp_path / "run" / "trace.nc").is_file()

    def test_an_error_after_the_end_changes_nothing(self, tmp_path, record):
        made = record(4)
        with pytest.raises(ValueError), begin_run(tmp_path / "run", made) as folder:
            folder.finish(Outcome.COMPLETED, "it ended", build_trace(*made), {}, [])
            raise ValueError("in a figure")
        assert outcome_of(tmp_path / "run")["outcome"] == "completed"


def test_no_run_folder(tmp_path):
    for path in (tmp_path, tmp_path / "nowhere", str(tmp_path)):
        with pytest.raises(RunFolderError, match="is this a run folder"):
            read_run(path)


def test_every_outcome_has_a_meaning_and_only_one_is_good():
    assert [outcome for outcome in Outcome if outcome.good] == [Outcome.COMPLETED]
    assert len({outcome.meaning for outcome in Outcome}) == len(Outcome)


def test_importing_the_floor_is_light():
    heavy = "{'xarray', 'pandas', 'h5netcdf', 'mujoco', 'matplotlib', 'numba', 'dm_control'}"
    code = "import sys, escort_mj.record.folder, escort_mj.measuring; print({'h5py'} & set(sys.modules))"
    code += f"; import escort_mj.record.netcdf; print({heavy} & set(sys.modules))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.split() == ["set()"] * 2
