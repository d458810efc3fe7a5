"""The video of a run: drawn by a child process, because only there may MuJoCo be loaded with GL.

The child is this same module, run as `python -m escort_mj.report.video.video FOLDER`. It says on its output
how far it is, one line per frame, and ends with an exit code; what went wrong is the last line of its errors.
"""

from __future__ import annotations

import argparse
import os
import queue
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import IO

from escort_mj.errors import EscortError, RenderError, WriteError
from escort_mj.gl import INSTALL_COMMAND, choose_backend
from escort_mj.record.folder import CLIP, MODEL, VIDEO, StoredRun, open_run
from escort_mj.scenario.reader.load import stored_scenario
from escort_mj.scenario.schema.scenario import Video

Progress = Callable[[float, float], None]
"""Called with the number of frames done and of all."""

PARTIAL = ".partial.{}"  # until the file of this name is complete
CLIP_SIZE, CLIP_RATE = (960, 540), 25
STALL = 180.0  # without a sign of life for so long, the child is given up [s]
_FRAME = re.compile(r"frame (\d+) of (\d+)")
_FAULT = "error: "
_NOT_WRITTEN = 4  # exit code of the child where the video has no room on the disk


def render_video(
    folder: str | os.PathLike[str], video: Video | None = None, progress: Progress | None = None
) -> Path:
    """Render the video of a run folder.

    Args:
        folder: A run folder.
        video: Size, rate, speed and camera; None takes the scenario's.
        progress: Called after each frame.

    Returns:
        The video, complete; until it is, an earlier one stays in place.

    Raises:
        RenderError: If nothing can be drawn on this machine, or drawing failed.
        WriteError: If the disk is full.
        RunFolderError: If the folder cannot be read.
    """
    options = [] if video is None else ["--video", video.model_dump_json()]
    return _render(open_run(folder), VIDEO, options, progress)


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
    return _render(open_run(folder), CLIP, ["--video", video.model_dump_json(), "--clip"], None)


def _render(run: StoredRun, name: str, options: list[str], progress: Progress | None) -> Path:
    """Let a child process draw one file of a run folder."""
    if run.trace.sizes["time"] == 0:
        raise RenderError(f"{run.path}: the trace holds no sample, so there is nothing to draw")
    backend, reason = choose_backend()
    if backend is None:
        raise RenderError(
            f"nothing can be drawn on this machine: {reason}. To add a renderer: {INSTALL_COMMAND}"
        )
    command = [sys.executable, "-P", "-m", "escort_mj.report.video.video", str(run.path), *options]
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as errors:
        child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env=_environment(backend),
        )
        try:
            _watch(child, progress)
        finally:
            if child.poll() is None:
                child.kill()
            child.wait()
            (run.path / PARTIAL.format(name)).unlink(missing_ok=True)
        if child.returncode != 0:
            errors.seek(0)
            reason = _reason(child.returncode, errors, run.path)
            if child.returncode == _NOT_WRITTEN:
                raise WriteError(run.path / name, reason)
            raise RenderError(reason)
    return run.path / name


def _environment(backend: str) -> dict[str, str]:
    """The child's environment: this one, with the back end, and with this package where it was found."""
    package = str(Path(__file__).resolve().parents[3])
    paths = [package, *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
    return os.environ | {"MUJOCO_GL": backend, "PYTHONPATH": os.pathsep.join(paths)}


def _watch(child: subprocess.Popen[str], progress: Progress | None) -> None:
    """Read the output of the child until it ends.

    Raises:
        RenderError: If it says nothing for too long.
    """
    lines: queue.Queue[str | None] = queue.Queue()

    def read(output: IO[str]) -> None:
        for line in output:
            lines.put(line)
        lines.put(None)

    assert child.stdout is not None
    reader = threading.Thread(target=read, args=(child.stdout,), daemon=True)
    reader.start()
    while True:
        try:
            line = lines.get(timeout=STALL)
        except queue.Empty:
            raise RenderError(f"the renderer gave no sign of life for {STALL:g} s, and was stopped") from None
        if line is None:
            return
        if progress is not None and (match := _FRAME.match(line)):
            progress(int(match[1]), int(match[2]))


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
    parser = argparse.ArgumentParser(
        prog="python -m escort_mj.report.video.video", description=render_here.__doc__
    )
    parser.add_argument("folder", help="a run folder")
    parser.add_argument("--video", help="size, rate, speed and camera as JSON; the scenario's where left out")
    parser.add_argument("--clip", action="store_true", help="only what is around the worst moment, slowly")
    options = parser.parse_args(arguments)
    try:
        run = open_run(options.folder)
        video = Video.model_validate_json(options.video) if options.video else scenario_video(run)
        _film(run, video, options.clip)
    except WriteError as fault:
        print(f"{_FAULT}{fault.reason}".replace("\n", " "), file=sys.stderr)
        return _NOT_WRITTEN
    except EscortError as fault:
        print(f"{_FAULT}{fault}".replace("\n", " "), file=sys.stderr)
        return 1
    return 0


def scenario_video(run: StoredRun) -> Video:
    """What the run's own scenario says of its video."""
    return stored_scenario(run.scenario_yaml, run.path).video


def ending(run: StoredRun) -> tuple[str, bool]:
    """How a run ended, in words for its last frame, and whether that is well."""
    outcome, message = str(run.outcome["outcome"]), str(run.outcome["message"])
    held, all_of_them = sum(bool(verdict["passed"]) for verdict in run.verdicts), len(run.verdicts)
    if outcome != "completed":
        return f"{outcome}: {message}", False
    if held < all_of_them:
        return f"{message}, {all_of_them - held} of {all_of_them} expectations failed", False
    return f"{message}, all expectations met" if run.verdicts else message, True


def _film(run: StoredRun, video: Video, short: bool) -> None:
    """Render a run that was opened, or only its clip."""
    from escort_mj.report.video.clip import plan_clip
    from escort_mj.report.video.film import film
    from escort_mj.report.video.replay import replay_of

    def say(done: int, total: int) -> None:
        print(f"frame {done} of {total}", flush=True)

    name, clip, words = VIDEO, None, ending(run)
    if short:
        name, clip = CLIP, plan_clip(run)
        video, words = video.model_copy(update={"speed": clip.speed, "rate": CLIP_RATE}), (clip.words, False)
    title, partial = str(run.trace.attrs["title"]), run.path / PARTIAL.format(name)
    film(replay_of(run.trace), run.path / MODEL, partial, video, title, words, say, clip)
    try:
        partial.replace(run.path / name)
    except OSError as fault:
        raise WriteError(run.path / name, fault) from fault


if __name__ == "__main__":
    sys.exit(render_here())
