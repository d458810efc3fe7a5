"""Clips of runs that fail: what they show, when, how slowly, and whom they mark."""

import json
import re
import subprocess
from dataclasses import asdict
from types import SimpleNamespace

import imageio_ffmpeg
import numpy as np
import pytest

from escort_mj import palette
from escort_mj.record.outcome import Outcome
from escort_mj.report.video import video
from escort_mj.report.video.clip import LENGTH, plan_clip
from escort_mj.scenario.schema.scenario import Video
from tests.drawing import needs_gl
from tests.report.video.test_video import banner, read
from tests.synthetic import make_verdict

SMALL = Video(width=320, height=180, rate=5)


def verdict(passed=False, time=None, bodies=(), message="contacts none: 1"):
    return make_verdict(passed=passed, time=time, bodies=bodies, message=message)


def run(*verdicts, end=20.0, outcome="diverged: robot 1 is far away"):
    return SimpleNamespace(
        recording={"time": np.linspace(0.0, end, 201)}, verdicts=list(verdicts), outcome={"message": outcome}
    )


class TestPlan:
    def test_of_a_pair_it_is_slow_and_around_the_moment(self):
        clip = plan_clip(run(verdict(time=10.0, bodies=("robot_1", "rock"))))
        assert clip.start < 10.0 < clip.end and clip.moment == 10.0
        assert clip.end - clip.start == pytest.approx(LENGTH * clip.speed) == pytest.approx(1.6)
        assert clip.bodies == ("robot_1", "rock")

    def test_of_one_robot_it_runs_in_real_time(self):
        clip = plan_clip(run(verdict(time=10.0, bodies=("robot_1",))))
        assert (clip.end - clip.start, clip.speed) == (4.0, 1.0)

    @pytest.mark.parametrize("moment", [0.0, 0.1, 19.9, 20.0, 25.0])
    def test_it_stays_within_the_run(self, moment):
        clip = plan_clip(run(verdict(time=moment, bodies=("robot_1", "rock"))))
        assert 0.0 <= clip.start < clip.end <= 20.0
        assert clip.end - clip.start == pytest.approx(1.6)
        assert clip.start <= clip.moment <= clip.end

    def test_a_short_run_is_slowed(self):
        clip = plan_clip(run(verdict(time=0.2), end=0.4))
        assert (clip.start, clip.end, clip.speed) == (0.0, 0.4, 0.1)

    def test_a_pair_tells_most_and_what_passed_tells_nothing(self):
        verdicts = [
            verdict(passed=True, time=1.0, bodies=("robot_1", "robot_2")),
            verdict(),
            verdict(time=3.0, bodies=("robot_1",)),
            verdict(time=5.0, bodies=("robot_2", "rock")),
        ]
        assert plan_clip(run(*verdicts)).moment == 5.0
        assert plan_clip(run(*verdicts[:3])).moment == 3.0
        assert plan_clip(run(*verdicts[:2])).moment == 20.0

    def test_without_verdicts_it_is_the_end(self):
        clip = plan_clip(run())
        assert (clip.moment, clip.words) == (20.0, "diverged: robot 1 is far away")


@pytest.fixture(scope="module")
def meeting(make_run):
    """A run whose verdict says that robot 1 and the first obstacle met at 3 s."""
    folder = make_run(outcome=Outcome.COMPLETED)
    where = folder / "verdicts.json"
    where.write_text(json.dumps([asdict(verdict(time=3.0, bodies=("robot_1", "obstacle_1")))]))
    return folder


def redness(frames):
    """How many pixels of each frame are as red as a contact, the words at the bottom aside."""
    color = np.asarray(palette.CONTACT) * 255
    upper = frames[:, 30 : frames.shape[1] * 3 // 4]
    return (np.abs(upper - color).max(axis=3) < 60).sum(axis=(1, 2))


@needs_gl
@pytest.mark.slow
def test_a_clip_of_four_seconds_with_the_pair_marked(meeting):
    path = video.render_clip(meeting, SMALL)
    assert path == meeting / "clip.mp4" and not list(meeting.glob(".*"))
    words = subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", path], capture_output=True, text=True
    ).stderr
    assert re.search(r"Duration: 00:00:04.*320x180", words, re.DOTALL)
    frames = read(path)
    assert (redness(frames) > 20).all()
    assert banner(frames[-1]) == "bad"


@needs_gl
@pytest.mark.slow
def test_the_same_bodies_are_less_red_in_the_video_of_the_whole_run(meeting):
    frames = read(video.render_clip(meeting, SMALL))
    whole = read(video.render_video(meeting, SMALL.model_copy(update={"rate": 5, "speed": 2.0})))
    assert redness(whole[:-10]).max() < redness(frames).min()


@needs_gl
@pytest.mark.slow
def test_bodies_that_the_model_does_not_have_are_not_marked(meeting):
    (meeting / "verdicts.json").write_text(
        json.dumps([asdict(verdict(time=3.0, bodies=("robot_1", "ghost")))])
    )
    assert len(read(video.render_clip(meeting, SMALL))) > 30
