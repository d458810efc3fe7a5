"""The video of a run: drawn by a child process, because only there may MuJoCo be loaded with GL.

The child is this same module, run as `python -m escort_mj.report.video.video FOLDER`. It says on its output
how far it is, one line per frame, and ends with an exit code; what went wrong is the last line of its errors.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from multiprocessing.connection import wait
from pathlib import Path
from typing import IO, TYPE_CHECKING

from escort_mj.errors import EscortError, RenderError, RunFolderError, WriteError
from escort_mj.files import check_place, remove_left, replaced
from escort_mj.gl import INSTALL_COMMAND, choose_backend
from escort_mj.record.folder import CLIP, MODEL, VIDEO, StoredRun, read_run
from escort_mj.report.video.encode import ENCODINGS
from escort_mj.scenario.reader.load import stored_scenario
from escort_mj.scenario.schema.scenario import Video

if TYPE_CHECKING:
    from escort_mj.report.video.film import Film

Progress = Callable[[float, float], None]
"""Called with the number of frames done and of all."""

MODULE = "escort_mj.report.video.video"
CLIP_SIZE, CLIP_RATE = (960, 540), 25
STALL = 180.0  # without a sign of life for so long, the child is given up [s]
_FRAME = re.compile(rb"frame (\d+) of (\d+)")
_FAULT = "error: "
_NOT_WRITTEN = 4  # exit code of the child where the video has no room on the disk
_DAMAGED = 5  # where the run folder cannot be read


def render_video(
    folder: str | os.PathLike[str],
    video: Video | None = None,
    progress: Progress | None = None,
    out: str | os.PathLike[str] | None = None,
) -> Path:
    """Render the video of a run folder.

    Args:
        folder: A run folder.
        video: Size, rate, speed, camera and window; None takes the scenario's.
        progress: Called after each frame.
        out: The file; its suffix (.mp4, .webp) chooses the format. None: video.mp4 in the folder.

    Returns:
        The video, complete; until it is, an earlier one stays in place.

    Raises:
        UsageError: If there is no such format.
        RenderError: If nothing can be drawn on this machine, or drawing failed.
        WriteError: If the disk is full.
        RunFolderError: If the folder cannot be read.
    """
    with started_video(folder, video, out) as rendering:
        return rendering.finish(progress)


def started_video(
    folder: str | os.PathLike[str], video: Video | None = None, out: str | os.PathLike[str] | None = None
) -> AbstractContextManager[Rendering]:
    """Begin to render the video of a run folder, while something else is done.

    Args:
        folder: As of `render_video`.
        video: As of `render_video`.
        out: As of `render_video`.

    Returns:
        A context with the rendering, which is given up where it is not finished.
    """
    run = read_run(folder)
    path = run.path / VIDEO if out is None else Path(out)
    wanted = scenario_video(run) if video is None else video
    check_format(path)
    return _started(run, path, ["--video", wanted.model_dump_json()])


def check_format(path: Path) -> None:
    """Check that a video can have this name.

    Raises:
        UsageError: If it cannot.
    """
    check_place(path, ENCODINGS)


def render_clip(folder: str | os.PathLike[str], video: Video | None = None) -> Path:
    """Render a few seconds around the worst moment of a run folder whose verdicts failed.

    Args:
        folder: A run folder.
        video: Its size; None is small.

    Returns:
        The clip.

    Raises:
        RenderError: If nothing can be drawn on this machine, or drawing failed.
        WriteError: If the disk is full.
        RunFolderError: If the folder cannot be read.
    """
    video = Video(width=CLIP_SIZE[0], height=CLIP_SIZE[1]) if video is None else video
    run = read_run(folder)
    with _started(run, run.path / CLIP, ["--video", video.model_dump_json(), "--clip"]) as rendering:
        return rendering.finish()


class Rendering:
    """A video that a child process draws.

    Attributes:
        path: The file.
    """

    def __init__(self, run: StoredRun, path: Path, child: subprocess.Popen[bytes], errors: IO[str]) -> None:
        self.path = path
        self._run, self._child, self._errors = run, child, errors

    def finish(self, progress: Progress | None = None) -> Path:
        """Wait for the video.

        Args:
            progress: Called after each frame.

        Raises:
            RenderError: If drawing failed.
            WriteError: If the disk is full.
            RunFolderError: If the model of the run cannot be read.
        """
        _watch(self._child, progress)
        code = self._child.wait()
        if code != 0:
            self._errors.seek(0)
            reason = _reason(code, self._errors, self._run.path)
            if code == _NOT_WRITTEN:
                raise WriteError(self.path, reason)
            if code == _DAMAGED:
                raise RunFolderError(reason)
            raise RenderError(reason)
        return self.path


@contextmanager
def _started(run: StoredRun, path: Path, options: list[str]) -> Iterator[Rendering]:
    """Let a child process draw a file, while the context lasts."""
    if run.recording.sizes["time"] == 0:
        raise RenderError(f"{run.path}: the trace holds no sample, so there is nothing to draw")
    environment = drawing_environment()
    command = [sys.executable, "-P", "-m", MODULE, str(run.path), "--out", str(path), *options]
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as errors:
        nothing, pipe = subprocess.DEVNULL, subprocess.PIPE
        child = subprocess.Popen(
            command, bufsize=0, stdin=nothing, stdout=pipe, stderr=errors, env=environment
        )
        try:
            yield Rendering(run, path, child, errors)
        finally:
            if child.poll() is None:
                child.kill()
            child.wait()
            remove_left(path.parent)


def drawing_environment() -> dict[str, str]:
    """Return the environment of a child that draws with a back end that works.

    Raises:
        RenderError: If there is none.
    """
    backend, reason = choose_backend()
    if backend is None:
        raise RenderError(
            f"nothing can be drawn on this machine: {reason}. To add a renderer: {INSTALL_COMMAND}"
        )
    return child_environment(backend)


def child_environment(backend: str) -> dict[str, str]:
    """Return the environment of a child that draws: this one, with the back end and this package."""
    package = str(Path(__file__).resolve().parents[3])
    paths = [package, *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
    return os.environ | {"MUJOCO_GL": backend, "PYTHONPATH": os.pathsep.join(paths)}


def _watch(child: subprocess.Popen[bytes], progress: Progress | None) -> None:
    """Read the output of the child until it ends.

    Raises:
        RenderError: If it says nothing for too long.
    """
    assert child.stdout is not None
    while wait([child.stdout.fileno()], STALL):
        line = child.stdout.readline()
        if not line:
            return
        if progress is not None and (match := _FRAME.match(line)):
            progress(int(match[1]), int(match[2]))
    raise RenderError(f"the renderer gave no sign of life for {STALL:g} s, and was stopped")


def _reason(code: int, errors: IO[str], folder: Path) -> str:
    """Why the child failed, in a sentence."""
    said = [line for line in errors.read().splitlines() if line.strip()]
    for line in reversed(said):
        if line.startswith(_FAULT):
            return line.removeprefix(_FAULT)
    if code < 0:
        reason = f"the renderer was killed by {signal.Signals(-code).name}"
    else:
        reason = f"the renderer failed with exit code {code}"
    if shutil.disk_usage(folder).free < (1 << 20):
        reason += ", and the disk is full"
    return f"{reason}: {said[-1]}" if said else reason


def render_here(arguments: list[str] | None = None) -> int:
    """Render one folder in this process. MUJOCO_GL must name a back end that works.

    Returns:
        The exit code.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {MODULE}", description=render_here.__doc__)
    parser.add_argument("folder", help="a run folder")
    parser.add_argument("--out", type=Path, required=True, help="the file to write")
    parser.add_argument("--video", required=True, help="size, rate, speed, camera and window as JSON")
    parser.add_argument("--clip", action="store_true", help="only what is around the worst moment, slowly")
    parser.add_argument("--share", type=int, nargs=2, help="write the pixels of this share, of so many")
    options = parser.parse_args(arguments)
    try:
        run, video = read_run(options.folder), Video.model_validate_json(options.video)
        if options.share is None:
            _write(run, options.out, video, options.clip)
        else:
            from escort_mj.report.video.frames import send_share

            part, processes = options.share
            send_share(_film(run, video, options.clip)[0], part, processes, sys.stdout.buffer)
    except WriteError as fault:
        print(f"{_FAULT}{fault.reason}".replace("\n", " "), file=sys.stderr)
        return _NOT_WRITTEN
    except EscortError as fault:
        print(f"{_FAULT}{fault}".replace("\n", " "), file=sys.stderr)
        return _DAMAGED if isinstance(fault, RunFolderError) else 1
    return 0


def scenario_video(run: StoredRun) -> Video:
    """What the run's own scenario says of its video."""
    return stored_scenario(run.scenario_yaml, run.scenario_file).video


def ending(run: StoredRun) -> tuple[str, bool]:
    """How a run ended, in words for its last frame, and whether that is well."""
    outcome, message = str(run.outcome["outcome"]), str(run.outcome["message"])
    held, all_of_them = sum(verdict.passed for verdict in run.verdicts), len(run.verdicts)
    if outcome != "completed":
        return f"{outcome}: {message}", False
    if held < all_of_them:
        return f"{message}, {all_of_them - held} of {all_of_them} verdicts failed", False
    skipped = sum(bool(verdict.skip) for verdict in run.verdicts)
    if skipped:
        return f"{message}, {held - skipped} verdicts passed, {skipped} not judged", True
    return f"{message}, all expectations met" if len(run.verdicts) > 1 else message, True


def _film(run: StoredRun, video: Video, short: bool) -> tuple[Film, int]:
    """The film of a run that was opened, or of its clip, and frames per second."""
    from escort_mj.report.video.clip import plan_clip
    from escort_mj.report.video.film import Film
    from escort_mj.report.video.replay import replay_of

    clip, words = None, ending(run)
    if short:
        clip = plan_clip(run)
        video, words = video.model_copy(update={"speed": clip.speed, "rate": CLIP_RATE}), (clip.words, False)
    title = str(run.recording.attrs["title"])
    return Film(replay_of(run.recording), run.path / MODEL, video, title, words, clip), video.rate


def _write(run: StoredRun, path: Path, video: Video, short: bool) -> None:
    """Write the film of a run that was opened, or only its clip."""
    from escort_mj.report.video.frames import write_film

    def say(done: int, total: int) -> None:
        print(f"frame {done} of {total}", flush=True)

    def share(part: int, processes: int) -> list[str]:
        options = ["--out", str(path), "--video", video.model_dump_json(), *(["--clip"] if short else [])]
        return ["-m", MODULE, str(run.path), *options, "--share", str(part), str(processes)]

    film, rate = _film(run, video, short)
    with replaced(path) as partial:
        write_film(film, partial, rate, share, say)


if __name__ == "__main__":
    sys.exit(render_here())
