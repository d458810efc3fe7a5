import contextlib
import io
from types import SimpleNamespace

import numpy as np
import pytest

from escort_mj.errors import RenderError
from escort_mj.report.video import frames

SIZE = (160, 120)
LENGTH = SIZE[0] * SIZE[1] * 3


class Numbered(contextlib.nullcontext):
    """A film whose frames are their numbers."""

    size, times, held = SIZE, np.arange(5.0), 2

    def frame(self, index: int) -> np.ndarray:
        return np.full((*SIZE[::-1], 3), index, np.uint8)


@pytest.fixture
def written(monkeypatch):
    """The frames that go into the file, where two processes draw."""
    added: list[int] = []
    file = SimpleNamespace(add=lambda frame: added.append(int(frame[0, 0, 0])))
    monkeypatch.setattr(frames, "VideoFile", lambda *_: contextlib.nullcontext(file))
    monkeypatch.setattr(frames, "processes_for", lambda _: 2)
    monkeypatch.setenv(frames.THREADS, "1")
    return added


def test_frames_of_two_processes_stand_in_their_order(written, tmp_path):
    said: list[tuple[int, int]] = []
    program = f"import sys; [sys.stdout.buffer.write(bytes([k]) * {LENGTH}) for k in (1, 3)]"
    frames.write_film(
        Numbered(), tmp_path / "a.mp4", 10, lambda *_: ["-c", program], lambda *at: said.append(at)
    )
    assert written == [0, 1, 2, 3, 4, 4, 4]
    assert said == [(done, 7) for done in range(1, 8)]


def test_a_process_that_ends_early_is_an_error(written, tmp_path):
    with pytest.raises(RenderError, match="draws frames ended with exit code 5"):
        frames.write_film(
            Numbered(), tmp_path / "a.mp4", 10, lambda *_: ["-c", "raise SystemExit(5)"], lambda *_: None
        )


def test_a_share_is_every_so_many_frames():
    output = io.BytesIO()
    frames.send_share(Numbered(), 1, 3, output)
    data = output.getvalue()
    assert len(data) == 2 * LENGTH and (data[0], data[-1]) == (1, 4)


def test_short_films_are_drawn_by_one_process(monkeypatch):
    monkeypatch.setattr(frames.os, "sched_getaffinity", lambda _: set(range(16)))
    assert [frames.processes_for(count) for count in (1, 100, 150, 10_000)] == [1, 1, 2, 4]
