import json
import threading

import pytest

from escort_mj.errors import BrokenRunError, RunFolderError, UsageError
from escort_mj.record.folder import CHECK, RUN, STUDY, OccupiedError, RunFolder, free_place, read_run
from tests.record.test_folder import outcome_of
from tests.synthetic import begin_run


class TestWhoMayWrite:
    def test_of_two_processes_one_wins_and_is_left_alone(self, tmp_path, record, finish, start_run):
        two = [start_run(tmp_path / "run", record(1)) for _ in range(2)]
        said = {process.stdout.readline(): process for process in two}
        process = said.pop("ready\n")
        words = f"process {process.pid} is writing a run here now"
        assert len(said) == 1 and all(words in line for line in said)
        with pytest.raises(UsageError, match=words):
            RunFolder.create(tmp_path / "run")
        assert read_run(tmp_path / "run").outcome["outcome"] == "running"
        process.kill()
        process.wait()
        finish(tmp_path / "run", record(2), overwrite=True)
        assert read_run(tmp_path / "run").trace.sizes["time"] == 2

    def test_of_many_at_once_one_wins(self, tmp_path):
        barrier, won, lost = threading.Barrier(8), [], []

        def claim():
            barrier.wait()
            try:
                won.append(RunFolder.create(tmp_path / "run"))
            except UsageError as error:
                lost.append(error)

        threads = [threading.Thread(target=claim) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert (len(won), len(lost)) == (1, 7)
        assert all("is writing a run here now" in str(error) for error in lost)

    @pytest.mark.parametrize(
        "changes",
        [
            {"process_start": "another boot 12345"},  # its number went to another process
            {"process_start": None},
            *({"pid": pid} for pid in (2**22 + 1, 10**30, -1, None, "somebody")),
        ],
    )
    def test_a_process_number_alone_proves_nothing(self, tmp_path, record, changes):
        begin_run(tmp_path / "run", record(5))
        (tmp_path / "run" / "outcome.json").write_text(json.dumps(outcome_of(tmp_path / "run") | changes))
        assert read_run(tmp_path / "run").outcome["outcome"] == "killed"

    def test_an_earlier_run_is_replaced_only_if_asked(self, tmp_path, record, finish):
        finish(tmp_path / "run", record(30))
        for made_by in (RUN, CHECK, STUDY):
            with pytest.raises(OccupiedError, match="holds a run already"):
                RunFolder.create(tmp_path / "run", made_by)
        assert read_run(tmp_path / "run").trace.sizes["time"] == 30

    @pytest.mark.parametrize("made_by", [CHECK, STUDY])
    def test_checks_and_studies_replace_their_own(self, tmp_path, made_by):
        RunFolder.create(tmp_path / "run", made_by).fail("broke")
        (tmp_path / "run" / "trace.nc").touch()
        RunFolder.create(tmp_path / "run", made_by).fail("broke")
        (tmp_path / "run" / "trace.nc").touch()
        with pytest.raises(OccupiedError):
            RunFolder.create(tmp_path / "run")

    def test_a_run_beside_earlier_ones(self, tmp_path, record, finish):
        for name in ("run", "run-2", "run-3"):
            assert free_place(tmp_path / "run") == tmp_path / name
            finish(tmp_path / name, record(2))
        going_on = RunFolder.create_beside(tmp_path / "run")
        assert going_on.path == tmp_path / "run-4"
        assert RunFolder.create_beside(tmp_path / "run").path == tmp_path / "run-5"
        assert free_place(tmp_path / "new") == tmp_path / "new"
        (tmp_path / "other").mkdir()
        (tmp_path / "other" / "file").touch()
        with pytest.raises(UsageError, match="holds files but no run"):
            RunFolder.create_beside(tmp_path / "other")

    def test_a_run_of_an_older_version_counts_as_a_study_s(self, tmp_path):
        path = tmp_path / "run"
        RunFolder.create(path).fail("broke")
        (path / "trace.nc").touch()
        found = {key: value for key, value in outcome_of(path).items() if key != "made_by"}
        (path / "outcome.json").write_text(json.dumps(found))
        assert free_place(path, CHECK) == tmp_path / "run-2"
        assert free_place(path, STUDY) == path

    def test_an_earlier_run_is_replaced_whole(self, tmp_path, record, finish):
        path = tmp_path / "run"
        finish(path, record(30))
        (path / "figures").mkdir()
        (path / "figures" / "paths.png").write_text("old")
        for name in ("video.mp4", "clip.mp4"):
            (path / name).write_text("old")
        (path / ".partial.123.1.trace.nc").write_text("left by a kill")
        (path / "notes.txt").write_text("mine")
        RunFolder.create(path, overwrite=True)
        assert {entry.name for entry in path.iterdir()} == {"outcome.json", "notes.txt"}

    def test_a_link_in_place_of_the_figures_is_not_followed(self, tmp_path, record, finish):
        elsewhere = tmp_path / "elsewhere"
        elsewhere.mkdir()
        (elsewhere / "keep").touch()
        finish(tmp_path / "run", record(3))
        (tmp_path / "run" / "figures").symlink_to(elsewhere)
        RunFolder.create(tmp_path / "run", overwrite=True)
        assert (elsewhere / "keep").exists()
        assert not (tmp_path / "run" / "figures").is_symlink()

    def test_a_folder_of_other_things_is_refused(self, tmp_path):
        (tmp_path / "thesis.tex").touch()
        with pytest.raises(UsageError, match="holds files but no run"):
            RunFolder.create(tmp_path)
        assert [entry.name for entry in tmp_path.iterdir()] == ["thesis.tex"]

    @pytest.mark.parametrize("text", ["{}", "[]", '{"outcome": 3}', '{"outcome": "won"}', "{", ""])
    def test_an_outcome_of_something_else_is_no_run(self, tmp_path, text):
        (tmp_path / "outcome.json").write_text(text)
        (tmp_path / "video.mp4").write_text("a holiday")
        with pytest.raises(RunFolderError):
            RunFolder.create(tmp_path)
        with pytest.raises(RunFolderError):
            read_run(tmp_path)
        assert (tmp_path / "video.mp4").exists()

    def test_what_a_kill_left_of_a_folder_is_claimed(self, tmp_path, record, finish):
        (tmp_path / ".partial.123.1.outcome.json").write_text("{")
        finish(tmp_path, record(2))
        assert read_run(tmp_path).outcome["outcome"] == "completed"

    def test_places_that_cannot_be_written_are_one_clear_error(self, tmp_path):
        (tmp_path / "file").touch()
        for path in (tmp_path / "file", tmp_path / "file" / "run", tmp_path / ("x" * 300)):
            with pytest.raises(RunFolderError, match="cannot be written"):
                RunFolder.create(path)

    def test_a_full_disk_is_one_clear_error(self, tmp_path, record, monkeypatch):
        made = record(3)
        message = "cannot be written: No space left on device"
        with pytest.raises(BrokenRunError, match=message), begin_run(tmp_path / "run", made) as folder:
            journal = folder._journal
            journal._file.close()
            journal._file = open("/dev/full", "wb", buffering=0)
            monkeypatch.setattr(folder, "fail", lambda *_: journal.append(made[0]))  # as full as before
            folder.append(made[0])
        assert journal._file.closed and journal._episodes.closed
