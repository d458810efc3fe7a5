"""Pictures of crowds: bands instead of lines, dots instead of paths, links only between near neighbors."""

import mujoco
import numpy as np
import pytest
from matplotlib.figure import Figure

from escort_mj import palette
from escort_mj.record.folder import read_run
from escort_mj.report.figures import paths, timelines
from escort_mj.report.figures.drawing import curves, style
from escort_mj.report.figures.figures import draw_figures
from escort_mj.report.video.marks import marks
from escort_mj.report.video.replay import replay_of
from escort_mj.report.video.scene import SceneWriter

COUNT = palette.MOST_LINES + 20
GEOM = mujoco.mjtGeom


@pytest.mark.slow
@pytest.mark.parametrize("axes", [2, 3])
def test_a_crowd_gets_its_figures(make_run, monkeypatch, axes) -> None:
    monkeypatch.setattr(style, "DPI", 60)
    folder = make_run(count=COUNT, axes=axes, samples=20)
    assert {path.stem for path in draw_figures(folder)} >= {"panels", "paths", "clearances", "forces"}


@pytest.mark.parametrize("axes", [2, 3])
def test_a_crowd_is_drawn_of_few_artists(make_run, axes) -> None:
    folder = make_run(count=COUNT, axes=axes, samples=20)
    trace = read_run(folder).trace
    canvas = Figure()
    timelines.panels(canvas, trace)
    assert sum(len(panel.lines) for panel in canvas.axes) < COUNT
    words = {text.get_text() for text in canvas.legends[0].get_texts()}
    assert {"median robot", "90 % of robots", "all robots"} <= words
    assert len(canvas.axes) == 6, "no color bar where no line has a robot's color"
    plan = Figure()
    (paths.plan_view if axes == 2 else paths.space_view)(plan, trace)
    assert len(plan.axes[0].lines) < COUNT
    dots = [dots for dots in plan.axes[0].collections if len(dots.get_offsets()) == COUNT]
    assert dots, "every robot has a dot"


def test_bands_hold_all_robots_but_those_that_are_lost() -> None:
    time = np.linspace(0.0, 1.0, 50)
    values = np.random.default_rng(0).random((50, 200)) + np.arange(50)[:, None]
    lost = np.zeros(values.shape, dtype=bool)
    lost[10:, 3] = True
    values[10:, 3] = 1e6
    axes = Figure().subplots()
    curves.draw_curves(axes, time, values, palette.robot_colors(200), lost=lost)
    here = np.where(lost, np.nan, values)
    (median,) = axes.lines
    np.testing.assert_allclose(median.get_ydata(), np.nanmedian(here, axis=1))
    every, most = (band.get_paths()[0].vertices[:, 1] for band in axes.collections)
    assert every.max() == np.nanmax(here) and every.min() == np.nanmin(here)
    assert most.max() == pytest.approx(np.nanpercentile(here[-1], 95))


def test_a_disc_is_a_closed_fan_of_the_right_size() -> None:
    scene = mujoco.MjvScene(mujoco.MjModel.from_xml_string("<mujoco/>"), 100)
    SceneWriter(scene).disc(np.array([1.0, 2.0, 3.0]), 0.5, palette.CONTACT, 0.3, 24)
    geoms = scene.geoms[: scene.ngeom]
    corners = np.array([(geom.mat[:, 0], geom.mat[:, 1]) for geom in geoms], dtype=float)
    assert {geom.type for geom in geoms} == {GEOM.mjGEOM_TRIANGLE}
    np.testing.assert_allclose([geom.pos for geom in geoms], [[1.0, 2.0, 3.0]] * 24)
    np.testing.assert_allclose(np.linalg.norm(corners, axis=2), 0.5, rtol=1e-6)
    np.testing.assert_allclose(corners[:, 1], np.roll(corners[:, 0], -1, axis=0), atol=1e-6)
    area = 0.5 * np.cross(corners[:, 0], corners[:, 1])[:, 2].sum()
    assert area == pytest.approx(np.pi * 0.5**2, rel=0.02)


def test_neighbors_in_a_crowd_are_linked_once_they_are_near(make_run) -> None:
    trace = read_run(make_run(count=COUNT, samples=60, spread=lambda time: 5.0 * np.exp(-time))).trace
    replay = replay_of(trace)
    lines = [sum(mark.layer == "links" for mark in marks(replay, replay.at(time))) for time in (0.0, 5.9)]
    assert lines == [0, COUNT]
