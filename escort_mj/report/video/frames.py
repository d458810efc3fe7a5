"""Several processes draw the frames of one film in turn; one of them writes the file."""

from __future__ import annotations

import contextlib
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

import numpy as np

from escort_mj.errors import RenderError
from escort_mj.report.video.encode import VideoFile
from escort_mj.report.video.film import Film, Pixels

FRAMES_EACH = 60  # a process more is worth its start from so many frames on
MOST_PROCESSES = 4
AHEAD = 4  # frames that a process may be ahead
THREADS = "LP_NUM_THREADS"  # of Mesa's software renderer, by process


def processes_for(frames: int) -> int:
    """How many processes draw so many frames on this machine."""
    return max(1, min(len(os.sched_getaffinity(0)), MOST_PROCESSES, frames // FRAMES_EACH))


def write_film(
    film: Film, path: Path, rate: int, share: Callable[[int, int], list[str]], say: Callable[[int, int], None]
) -> None:
    """Draw a film into a file, with other processes' help where it is long.

    Args:
        film: The film.
        path: The file; its suffix chooses the format.
        rate: Frames per second.
        share: Command of a process that draws a share (`send_share`): which, and of how many.
        say: Called with the number of frames done and of all, after each.

    Raises:
        RenderError: If a frame cannot be drawn, or the video cannot be written.
        WriteError: If the disk is full.
    """
    frames, total = len(film.times), len(film.times) + film.held
    processes = processes_for(frames)
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(VideoFile(path, film.size, rate))
        others = [
            stack.enter_context(_drawn_elsewhere(share(part, processes), film.size, processes))
            for part in range(1, processes)
        ]
        if others:
            os.environ.setdefault(THREADS, _threads(processes))
        stack.enter_context(film)
        frame = None
        for index in range(frames):
            part = index % processes
            frame = film.frame(index) if part == 0 else next(others[part - 1])
            file.add(frame)
            say(index + 1, total)
        for done in range(frames + 1, total + 1):
            assert frame is not None
            file.add(frame)
            say(done, total)


def send_share(film: Film, part: int, processes: int, output: IO[bytes]) -> None:
    """Draw every so many frames of a film and write their pixels.

    Args:
        film: The film.
        part: Which share, from 0.
        processes: How many shares there are.
        output: Where the pixels go, one frame after another.
    """
    with film:
        for index in range(part, len(film.times), processes):
            output.write(film.frame(index).data)
            output.flush()


def _threads(processes: int) -> str:
    return str(max(len(os.sched_getaffinity(0)) // processes, 1))


@contextlib.contextmanager
def _drawn_elsewhere(command: list[str], size: tuple[int, int], processes: int) -> Iterator[Iterator[Pixels]]:
    """The frames that another process draws, in their order; it ends with the context."""
    environment = {THREADS: _threads(processes)} | os.environ
    child = subprocess.Popen(
        [sys.executable, "-P", *command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, env=environment
    )
    assert child.stdout is not None
    output, ready = child.stdout, queue.Queue[bytes](AHEAD)
    length = size[0] * size[1] * 3

    def read() -> None:
        with contextlib.suppress(ValueError):  # closed meanwhile
            while len(data := output.read(length)) == length:
                ready.put(data)
            ready.put(b"")

    def frames() -> Iterator[Pixels]:
        while data := ready.get():
            yield np.frombuffer(data, dtype=np.uint8).reshape(size[1], size[0], 3)
        raise RenderError(f"a process that draws frames ended with exit code {child.wait()}")

    threading.Thread(target=read, daemon=True).start()
    try:
        yield frames()
    finally:
        child.kill()
        child.wait()
