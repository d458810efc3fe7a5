import math
import re
import stat
import subprocess
from types import SimpleNamespace

import imageio_ffmpeg
import numpy as np
import pytest

from escort_mj import gl, palette
from escort_mj.errors import RenderError, RunFolderError, WriteError
from escort_mj.files import MACHINE, PARTIAL
from escort_mj.record.folder import read_run
from escort_mj.record.outcome import Outcome
from escort_mj.report.video import video
from escort_mj.report.video.camera import plan_shot
from escort_mj.report.video.encode import VideoFile
from escort_mj.report.video.film import ENDING
from escort_mj.report.video.replay import replay_of
from escort_mj.scenario.schema.scenario import Video
from tests.drawing import needs_gl
from tests.limits import files_up_to
from tests.report.video.projecting import project

SMALL = Video(width=320, height=180, rate=5, speed=2.0)


def read(path):
    frames = imageio_ffmpeg.read_frames(path)
    width, height = next(frames)["size"]
    return np.array([np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in frames], dtype=int)


@pytest.fixture(scope="module")
def rendered(make_run):
    """A video of a planar mission: its folder, its frames, and what progress said."""
    folder, told = make_run(video="{width: 320, height: 180, rate: 5, speed: 2}"), []
    path = video.render_video(folder, progress=lambda done, total: told.append((done, total)))
    return SimpleNamespace(folder=folder, path=path, frames=read(path), told=told)


@needs_gl
def test_the_video_is_as_the_scenario_says_and_plays_in_browsers(rendered):
    words = subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", rendered.path], capture_output=True, text=True
    ).stderr
    assert re.search(r"Video: h264 .*yuv420p.* 320x180.* 5 fps", words)
    # 5.9 s at 2 s of the mission per second of the video, both ends shown.
    moving, held = 16, math.ceil(ENDING * 5)
    assert rendered.frames.shape == (moving + held, 180, 320, 3)
    assert rendered.told == [(done, moving + held) for done in range(1, moving + held + 1)]
    assert rendered.path == rendered.folder / "video.mp4"
    assert not list(rendered.folder.glob(".*"))


@needs_gl
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_robots_are_where_the_trace_says_in_their_colors(rendered, share):
    replay, number = replay_of(read_run(rendered.folder).trace), round(share * 15)
    moment = replay.at(min(number * 0.4, replay.end))
    view = plan_shot(replay, "overview", 45.0, 320 / 180, 4.0).view(moment.time)
    places = project(view, moment.robots, (320, 180), 45.0)
    for (column, row), color in zip(places, palette.robot_colors(5), strict=True):
        seen = rendered.frames[number, round(row), round(column)]
        assert hue_distance(seen, color) < 0.1, (column, row, seen)


def hue_distance(pixel, color):
    """Angle between two colors' directions away from grey; light and shade change neither."""
    one, other = (np.asarray(x, float) - np.mean(x) for x in (pixel, color))
    return 1 - one @ other / (np.linalg.norm(one) * np.linalg.norm(other))


@needs_gl
def test_things_move_until_the_end_and_then_the_outcome_stands(rendered):
    change = np.abs(np.diff(rendered.frames, axis=0)).mean(axis=(1, 2, 3))
    assert (change[:14] > 0.05).all()
    assert (change[16:] < 0.2).all()
    assert banner(rendered.frames[13]) == ""
    assert banner(rendered.frames[-1]) == "good"


def banner(frame):
    """Whether a line of the outcome stands in the lower part of a frame, by its color."""
    for words, ink in (("good", (0, 104, 77)), ("bad", (176, 0, 32))):
        covered = np.abs(frame[145:175] - np.array(ink)).max(axis=-1) < 40
        if covered.sum(axis=1).max() > 50:  # pixels of one row
            return words
    return ""


@needs_gl
@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "look"),
    [
        ({"axes": 3, "count": 6}, {"camera": "top"}),
        ({"count": 50, "obstacles": 30}, {"camera": "follow"}),
        ({"count": 1, "obstacles": 0, "samples": 1}, {}),
        ({"spread": lambda time: np.exp(12 * time), "outcome": Outcome.DIVERGED}, {}),
    ],
    ids=["space_top", "many_follow", "one_sample", "diverged"],
)
def test_every_mission_can_be_filmed(make_run, shape, look):
    folder = make_run(**{"samples": 8} | shape)
    frames = read(video.render_video(folder, SMALL.model_copy(update=look)))
    assert frames.shape[1:] == (180, 320, 3)
    assert frames.std() > 5
    assert banner(frames[-1]) == ("bad" if "outcome" in shape else "good")


def test_the_child_says_in_one_line_what_is_wrong(make_run, capsys):
    """What the parent makes of such a line: `test_a_child_that_fails_is_an_error_not_a_hang`."""
    options = ["--out", "video.mp4", "--video", SMALL.model_dump_json()]
    folder = make_run(samples=2)
    (folder / "model.xml").write_text("<mujoco><oops/></mujoco>")
    assert video.render_here([str(folder), *options]) == 5
    (line,) = capsys.readouterr().err.splitlines()
    assert re.match(r"error: .*model\.xml: is damaged: MuJoCo refuses it: XML Error", line)
    late = SMALL.model_copy(update={"start": 7.0}).model_dump_json()
    assert video.render_here([str(make_run()), *options[:-1], late]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert re.match(r"error: .*begins at 7 s; the run ended at 5\.\d* s", line)


def test_without_gl_the_error_names_the_command(make_run, monkeypatch):
    monkeypatch.setattr(video, "choose_backend", lambda: (None, "libEGL.so.1 is missing"))
    with pytest.raises(RenderError, match=re.escape(gl.INSTALL_COMMAND)):
        video.render_video(make_run(samples=2))


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    with pytest.raises(RunFolderError):
        video.render_video(tmp_path)


@pytest.mark.parametrize(
    ("script", "words", "error"),
    [
        ("kill -9 $$", "killed by SIGKILL", RenderError),
        ("echo frame 1 of 9; echo boom >&2; exit 7", "exit code 7: boom", RenderError),
        ("echo nonsense >&2; echo 'error: the moon is full' >&2; exit 1", "^the moon is full$", RenderError),
        ("echo 'error: model.xml: is damaged' >&2; exit 5", "^model.xml: is damaged$", RunFolderError),
        ("exec sleep 60", "no sign of life", RenderError),
    ],
)
def test_a_child_that_fails_is_an_error_not_a_hang(make_run, monkeypatch, tmp_path, script, words, error):
    folder = make_run(samples=2)
    (folder / "video.mp4").write_text("an earlier video")
    half = f"echo half a video > {folder}/{PARTIAL}.{MACHINE}.$$.1.{video.VIDEO}"
    child = tmp_path / "python"
    child.write_text(f"#!/bin/sh\n{half}\n{script}\n")
    child.chmod(child.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(video, "choose_backend", lambda: ("egl", "as if"))
    monkeypatch.setattr(video.sys, "executable", str(child))
    monkeypatch.setattr(video, "STALL", 1.0)
    with pytest.raises(error, match=words):
        video.render_video(folder)
    assert (folder / "video.mp4").read_text() == "an earlier video"
    assert not [*folder.glob(f"{PARTIAL}*")]


def test_a_full_disk_is_an_error(tmp_path):
    path = tmp_path / "video.mp4"
    path.symlink_to("/dev/full")
    frame = np.random.default_rng(0).integers(0, 255, (180, 320, 3), dtype=np.uint8)
    with (
        pytest.raises((RenderError, WriteError), match="cannot be written"),
        VideoFile(path, (320, 180), 10) as file,
    ):
        for _ in range(30):
            file.add(frame)
    assert not path.is_symlink()


def test_a_limit_of_a_files_size_is_an_error_with_its_reason(tmp_path):
    """The encoder is killed by SIGXFSZ there."""
    path = tmp_path / "video.mp4"
    random = np.random.default_rng(0)
    with (
        files_up_to(20_000),
        pytest.raises(WriteError, match="at most 20000 bytes here") as raised,
        VideoFile(path, (320, 180), 10) as file,
    ):
        for _ in range(60):
            file.add(random.integers(0, 255, (180, 320, 3), dtype=np.uint8))
    assert raised.value.exit_code == 3
    assert not path.exists()


def test_a_video_that_is_given_up_goes(tmp_path):
    path = tmp_path / "video.mp4"
    with pytest.raises(KeyboardInterrupt), VideoFile(path, (320, 180), 10) as file:
        file.add(np.zeros((180, 320, 3), np.uint8))
        raise KeyboardInterrupt
    assert not path.exists()


@needs_gl
@pytest.mark.slow
def test_a_window_is_filmed_without_the_end(make_run, tmp_path):
    folder = make_run()
    window = SMALL.model_copy(update={"start": 1.0, "end": 3.0})
    frames = read(video.render_video(folder, window, out=tmp_path / "part.mp4"))
    assert len(frames) == 6 and banner(frames[-1]) == ""
    assert not (folder / "video.mp4").exists()
