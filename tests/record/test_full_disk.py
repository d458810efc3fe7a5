"""A disk that fills while a run is written: one message, and a folder that can be read up to there."""

import os
import pickle
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from escort_mj import files
from escort_mj.errors import BrokenRunError, WriteError
from escort_mj.record import journal
from escort_mj.record.folder import RunFolder, read_run
from escort_mj.record.outcome import Outcome
from escort_mj.record.trace import save_trace
from tests.limits import files_up_to
from tests.synthetic import build_trace

ROWS, BLOCK = 400, 50


def write_run(path: Path, made) -> None:
    """A run of ROWS samples, as a mission writes it."""
    samples, sizes, labels = made
    with RunFolder.create(path) as folder:
        folder.begin("name: synthetic\n", "<mujoco/>\n", sizes, labels)
        for start in range(0, ROWS, BLOCK):
            folder.append(samples[start : start + BLOCK])
        folder.finish(Outcome.COMPLETED, "it ended", build_trace(*made), {}, [])


EVERY_PLACE = [pytest.param(k, marks=() if k in (0, 6, 19) else pytest.mark.slow) for k in range(20)]


@pytest.mark.parametrize("place", EVERY_PLACE)
def test_whatever_the_size_at_which_writing_fails(tmp_path, record, place, monkeypatch) -> None:
    monkeypatch.setattr(journal, "RESERVED", 4096)
    made = record(ROWS)
    whole = made[0].nbytes
    header = 4200
    size = int(header + (0.98 * whole - header) * place / 19)
    path = tmp_path / "run"
    with (
        pytest.raises(BrokenRunError, match="cannot be written: File too large") as raised,
        files_up_to(size),
    ):
        write_run(path, made)
    assert raised.value.exit_code == 3
    assert "\n" not in str(raised.value)
    stored = read_run(path)
    assert stored.outcome["outcome"] == "failed"
    rows = stored.trace.sizes["time"]
    kept = size // (made[0].shape[1] * 8)
    assert rows == kept
    np.testing.assert_array_equal(stored.trace["q"], build_trace(*made)["q"][:kept])
    assert f"holds what was recorded up to {0.02 * (kept - 1):.2f} s" in str(raised.value)


@pytest.fixture
def full(monkeypatch):
    """A disk that is full for files of some names."""

    def fill(*names: str) -> None:
        def write(path, content, durable=False):
            if path.name in names:
                raise WriteError(path, OSError(28, os.strerror(28)))
            return before(path, content, durable)

        before = files.write_bytes
        for module in ("files", "record.trace", "record.journal"):
            monkeypatch.setattr(f"escort_mj.{module}.write_bytes", write)

    return fill


@pytest.mark.parametrize("name", ["trace.nc", "metrics.json", "verdicts.json"])
def test_results_that_find_no_room_leave_the_samples(tmp_path, record, full, name) -> None:
    made = record(ROWS)
    full(name)
    with pytest.raises(BrokenRunError, match=rf"run/{name}: cannot be written: No space left on device"):
        write_run(tmp_path / "run", made)
    stored = read_run(tmp_path / "run")
    assert (stored.outcome["outcome"], stored.trace.sizes["time"]) == ("failed", ROWS)
    assert name in stored.outcome["message"]


@pytest.mark.parametrize("name", ["scenario.yaml", "model.xml", "reserve", "header.json"])
def test_a_run_that_cannot_begin_is_broken(tmp_path, record, full, name) -> None:
    full(name)
    with pytest.raises(BrokenRunError, match=rf"{name}: cannot be written: .*; .*run holds no sample"):
        write_run(tmp_path / "run", record(ROWS))


def test_a_trace_never_reaches_hdf5s_own_files(tmp_path, record) -> None:
    """HDF5 ends the process by a signal where it cannot write; so it must not see a disk."""
    path = tmp_path / "trace.nc"
    path.write_text("earlier")
    for size in (0, 100, 2048, 10_000):
        with pytest.raises(WriteError, match="File too large"), files_up_to(size):
            save_trace(build_trace(*record(ROWS)), path)
    assert path.read_text() == "earlier"
    assert [each.name for each in tmp_path.iterdir()] == ["trace.nc"]


def test_a_device_is_written_to_and_not_replaced(tmp_path) -> None:
    with pytest.raises(WriteError, match="/dev/full: cannot be written: No space left"):
        files.write_text(Path("/dev/full"), "text")
    files.write_text(Path("/dev/null"), "text")
    assert Path("/dev/null").is_char_device()


def test_a_name_that_no_file_can_have_is_one_error(tmp_path) -> None:
    with pytest.raises(WriteError, match="cannot be written: Invalid or incomplete") as caught:
        files.write_text(tmp_path / "\ud800", "text")
    assert caught.value.exit_code == 2 and not list(tmp_path.iterdir())


def test_the_error_survives_another_process(tmp_path) -> None:
    error = WriteError(tmp_path / "x", OSError(13, "Permission denied"))
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.exit_code) == (str(error), 2)


@pytest.mark.slow
@pytest.mark.parametrize("size", [8, 60, 150, 400])
def test_the_command_line_under_a_limit(compiled, tmp_path, size) -> None:
    """With `ulimit -f` as with a full disk: exit code 3, one line, a folder that can be shown."""
    # -B: else Python itself leaves parts of bytecode behind, which no later process can read.
    command = [sys.executable, "-B", "-m", "escort_mj", "run", "main", "--no-video", "--out", "run"]
    done = subprocess.run(
        ["bash", "-c", f'ulimit -f {size}; exec "$@"', "bash", *command],
        cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 3, signal.Signals(-done.returncode) if done.returncode < 0 else done.stderr
    assert len(done.stderr.splitlines()) == 1 and "cannot be written" in done.stderr
    show = [sys.executable, "-m", "escort_mj", "show", "run"]
    shown = subprocess.run(show, cwd=tmp_path, capture_output=True, text=True)
    assert shown.returncode == (0 if "holds what was recorded" in done.stderr else 2), shown.stderr
