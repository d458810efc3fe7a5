"""Figures and videos of missions of more than three axes, from real runs."""

import numpy as np
import pytest
from PIL import Image

import escort_mj
from escort_mj import palette
from escort_mj.record.folder import read_run
from escort_mj.report.figures import figures
from escort_mj.report.video import video
from escort_mj.report.video.camera import plan_shot
from escort_mj.report.video.replay import replay_of
from escort_mj.scenario import parse_scenario
from tests.drawing import needs_gl
from tests.report.video.projecting import project
from tests.report.video.test_video import hue_distance, read

SIZE = 640, 360
SCENARIO = """
axes: {axes}
duration: 1.0
target: {{position: [{target}]}}
robots: {{count: 4, radius: 0.35}}
mission: {{radius: 3}}
obstacles: [{{position: [{obstacle}], radius: 0.6}}]
video: {{width: 640, height: 360, rate: 5, speed: 0.5}}
"""


@pytest.fixture(scope="module", params=[4, 5, 7])
def folder(request, tmp_path_factory):
    """A short run in so many axes."""
    axes = request.param
    text = SCENARIO.format(
        axes=axes, target=", ".join(f"{k}*t" for k in range(axes)), obstacle=", ".join(["6"] * axes)
    )
    path = tmp_path_factory.mktemp(f"axes_{axes}") / "run"
    escort_mj.run(parse_scenario(text), path, figures=False, video=False)
    return path


@pytest.mark.parametrize(
    "folder", [5, *(pytest.param(axes, marks=pytest.mark.slow) for axes in (4, 7))], indirect=True
)
def test_paths_are_drawn_in_space(folder, monkeypatch):
    every = figures.PLOTS
    trace = read_run(folder).trace
    applying = {plot.name for plot in every if plot.applies(trace)}
    assert {"paths", "panels", "forces", "obstacle_distances", "clearances"} <= applying
    monkeypatch.setattr(figures, "PLOTS", [plot for plot in every if plot.name == "paths"])
    written = {path.stem: path for path in figures.draw_figures(folder)}
    image = np.asarray(Image.open(written["paths"]).convert("RGB"), dtype=float)
    for color in palette.robot_colors(4):
        assert (np.abs(image - np.round(255 * np.array(color))).max(axis=-1) <= 3).sum() > 60


@pytest.mark.slow
@pytest.mark.parametrize("folder", [7, 4, 5], indirect=True)
@needs_gl
def test_each_robot_is_seen_along_x_y_z_in_its_color(folder):
    replay = replay_of(read_run(folder).trace)
    frames = read(video.render_video(folder))
    last = 10  # 1 s at half a second of the mission per second of the video, both ends shown
    for number, sample in ((0, 0), (last, -1)):
        view = plan_shot(replay, "overview", 45.0, SIZE[0] / SIZE[1], 1.0).view(replay.time[sample])
        for (column, row), color in zip(
            project(view, replay.robots[sample], SIZE, 45.0), palette.robot_colors(4), strict=True
        ):
            pixel = frames[number, round(row), round(column)]
            assert hue_distance(pixel, color) < 0.1, (column, row, pixel)
