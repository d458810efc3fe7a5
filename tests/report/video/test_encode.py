import subprocess

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from escort_mj.errors import RenderError, UsageError
from escort_mj.report.video import encode
from escort_mj.report.video.encode import VideoFile
from escort_mj.report.video.video import check_format

COLORS = np.array([[200, 30, 30], [30, 160, 60], [40, 60, 200]], np.uint8)


def test_an_animated_picture_holds_every_frame_and_repeats(tmp_path):
    path = tmp_path / "video.webp"
    with VideoFile(path, (160, 120), 10) as file:
        for color in COLORS:
            file.add(np.broadcast_to(color, (120, 160, 3)))
    with Image.open(path) as picture:
        assert (picture.size, picture.n_frames, picture.info["loop"]) == ((160, 120), 3, 0)
        for number, color in enumerate(COLORS):
            picture.seek(number)
            seen = np.asarray(picture.convert("RGB"))[60, 80].astype(int)
            assert picture.info["duration"] == 100  # ms
            assert np.abs(seen - color).max() < 12
    assert [*tmp_path.iterdir()] == [path]


def test_a_video_of_three_frames_plays_everywhere(tmp_path):
    path = tmp_path / "video.mp4"
    with VideoFile(path, (160, 120), 10) as file:
        for color in COLORS:
            file.add(np.broadcast_to(color, (120, 160, 3)))
    asked = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", str(path)]
    said = subprocess.run(asked, capture_output=True, text=True, check=False).stderr
    assert "Video: h264" in said and "yuv420p" in said and "160x120" in said


def test_an_ffmpeg_without_the_encoder_is_one_error(tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho Codec is not recognized\n")
    program.chmod(0o755)
    monkeypatch.setattr(encode, "find_ffmpeg", lambda: str(program))
    with pytest.raises(RenderError, match="ffmpeg lacks the encoder libwebp_anim; .* pip install"):
        VideoFile(tmp_path / "video.webp", (160, 120), 10)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("video.gif", r"found the suffix \.gif; allowed are \.mp4, \.webp"),
        ("video", "found the suffix none"),
        ("no/video.mp4", "there is no folder"),
    ],
)
def test_a_video_that_cannot_be_written_so_is_an_error(tmp_path, name, words):
    with pytest.raises(UsageError, match=words):
        check_format(tmp_path / name)
