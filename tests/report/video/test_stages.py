"""Figures and videos of missions of more than three axes, from real runs."""

import mujoco
import numpy as np
import pytest
from PIL import Image

import escort_mj
from escort_mj import palette
from escort_mj.record.folder import MODEL, read_run
from escort_mj.report.figures import figures
from escort_mj.report.video import video
from escort_mj.report.video.replay import replay_of
from escort_mj.report.video.shots import plan_shot
from escort_mj.report.video.stages import panels_of, stage_replays
from escort_mj.scenario import parse_scenario
from tests.drawing import needs_gl
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


def test_stages_show_the_shadows_where_mujoco_has_them(folder):
    run = read_run(folder)
    replay, model = replay_of(run.trace), mujoco.MjModel.from_xml_path(str(run.path / MODEL))
    data = mujoco.MjData(model)
    axes = run.trace.sizes["axis"]
    stages = list(stage_replays(replay, model))
    assert [stage.axes for stage in stages] == {
        4: [("x4",)], 5: [("x4", "x5")], 7: [("x4", "x5", "x6"), ("x7",)],
    }[axes]  # fmt: skip
    assert [stage.facing for stage in stages] == [len(stage.axes) < 3 for stage in stages]
    for sample in (0, len(replay.time) // 2, len(replay.time) - 1):
        data.qpos = replay.qpos[sample]
        mujoco.mj_kinematics(model, data)
        for number, stage in enumerate(stages, 1):
            places = [data.body(f"robot_{i}_shadow_{number}").xpos for i in (1, 2, 3, 4)]
            np.testing.assert_allclose(stage.robots[sample], places, atol=1e-12)
            assert (
                data.body(f"obstacle_1_shadow_{number}").xpos.tolist() == stage.obstacles[sample, 0].tolist()
            )
            moved = np.zeros(3)
            directions = {1: [2], 2: [0, 2], 3: [0, 1, 2]}[len(stage.axes)]
            moved[directions] = [replay.time[sample] * (3 * number + k) for k in range(len(stage.axes))]
            np.testing.assert_allclose(stage.target[sample] - stage.target[0], moved, atol=1e-12)


@pytest.mark.parametrize(
    "folder", [5, *(pytest.param(axes, marks=pytest.mark.slow) for axes in (4, 7))], indirect=True
)
def test_paths_are_drawn_in_pairs_of_axes(folder, monkeypatch):
    every = figures.PLOTS
    trace = read_run(folder).trace
    applying = {plot.name for plot in every if plot.applies(trace)}
    assert {"paths", "panels", "forces", "obstacle_distances", "clearances"} <= applying
    monkeypatch.setattr(figures, "PLOTS", [plot for plot in every if plot.name == "paths"])
    written = {path.stem: path for path in figures.draw_figures(folder)}
    image = np.asarray(Image.open(written["paths"]).convert("RGB"), dtype=float)
    for color in palette.robot_colors(4):
        near = np.abs(image - np.round(255 * np.array(color))).max(axis=-1) <= 3
        left, right = near[:, : near.shape[1] // 2], near[:, near.shape[1] // 2 :]
        assert left.sum() > 60 and right.sum() > 60


@pytest.mark.slow
@pytest.mark.parametrize("folder", [7, 4, 5], indirect=True)
@needs_gl
def test_each_robot_is_seen_on_every_stage_in_its_color(folder):
    run = read_run(folder)
    replay, model = replay_of(run.trace), mujoco.MjModel.from_xml_path(str(run.path / MODEL))
    frames = read(video.render_video(folder))
    last = 10  # 1 s at half a second of the mission per second of the video, both ends shown
    seen = list(stage_replays(replay, model))
    panels = panels_of(len(seen), *SIZE)[1:]
    assert len(panels) == len(seen)
    for stage, panel in zip(seen, panels, strict=True):
        size = panel.width, panel.height
        for number, sample in ((0, 0), (last, -1)):
            view = plan_shot(stage, "overview", 45.0, size[0] / size[1], 1.0).view(replay.time[sample])
            places = view.project(stage.robots[sample], size, 45.0)
            for (column, row), color in zip(places, palette.robot_colors(4), strict=True):
                pixel = frames[number, panel.top + round(row), panel.left + round(column)]
                assert hue_distance(pixel, color) < 0.1, (stage.axes, column, row, pixel)
