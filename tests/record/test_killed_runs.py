import os
import subprocess
import sys

import numpy as np
import pytest
import xarray

from escort_mj.errors import RunFolderError
from escort_mj.record.folder import read_run
from tests.record.test_folder import outcome_of


class TestARunThatDies:
    def test_a_killed_run_opens_and_says_what_happened_each_time(self, tmp_path, record, killed):
        path = tmp_path / "run"
        pid = killed(path, record(1))
        stored = read_run(path)
        rows = stored.trace.sizes["time"]
        assert rows > 0
        np.testing.assert_allclose(stored.trace["time"], 0.02 * np.arange(rows))
        assert (stored.trace["q"] == 0.5).all()
        assert stored.scenario_yaml == "name: synthetic\n"
        assert stored.outcome["outcome"] == "killed"
        reached = 0.02 * (rows - 1)
        assert stored.outcome["simulated_time"] == pytest.approx(reached)
        assert stored.outcome["message"] == f"process {pid} died, recorded up to {reached:.2f} s"
        assert stored.outcome["platform"] == "some machine"
        assert (path / "trace.nc").is_file()
        assert outcome_of(path) == stored.outcome
        again = read_run(path)
        assert again.outcome == stored.outcome
        xarray.testing.assert_identical(again.trace, stored.trace)

    def test_killed_before_its_first_step(self, tmp_path, record, finish, killed):
        path = tmp_path / "run"
        killed(path, record(1), kind="prepares")
        for _ in range(2):
            with pytest.raises(RunFolderError, match="died, before the first step; it left nothing"):
                read_run(path)
        assert outcome_of(path)["outcome"] == "killed"
        finish(path, record(3))
        assert read_run(path).outcome["outcome"] == "completed"

    def test_a_folder_that_cannot_be_written_opens_as_well(self, tmp_path, record, monkeypatch, killed):
        path = tmp_path / "run"
        killed(path, record(1))

        def read_only(*_):
            raise PermissionError(13, "Permission denied")

        monkeypatch.setattr("escort_mj.record.stored.save_trace", read_only)
        stored = read_run(path)
        assert stored.outcome["outcome"] == "killed"
        assert stored.trace.sizes["time"] > 0
        assert outcome_of(path)["outcome"] == "running"


def test_what_killed_processes_left_among_temporary_files_goes_with_the_next(tmp_path):
    code = "import os; from escort_mj.files import temporary_folder; temporary_folder(); os.kill(0, {})"
    left = []
    for number in (9, 9, 0):
        command, place = [sys.executable, "-c", code.format(number)], {"TMPDIR": str(tmp_path)}
        subprocess.run(command, env=os.environ | place, start_new_session=True)
        left.append(len([*tmp_path.iterdir()]))
    assert left == [1, 1, 0]
