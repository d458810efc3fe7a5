"""Pictures of missions under way."""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from escort_mj.api import load_scenario
from escort_mj.environments import Simulation
from escort_mj.environments.picture import Camera
from escort_mj.errors import RenderError, UsageError
from escort_mj.report.video import live, video
from tests.drawing import needs_gl

gymnasium = pytest.importorskip("gymnasium")

SHORT = {"duration": 0.1, "expect": []}


@needs_gl
@pytest.mark.slow
def test_gymnasium_records_a_video(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clips = []

    class Clip:
        def __init__(self, frames: list[np.ndarray], fps: int) -> None:
            clips.append((frames, fps))

        def write_videofile(self, path: str, **options: object) -> None:
            Path(path).touch()

    module = ModuleType("moviepy.video.io.ImageSequenceClip")
    module.ImageSequenceClip = Clip  # type: ignore[attr-defined]
    for name in ("moviepy", "moviepy.video", "moviepy.video.io"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    environment = gymnasium.wrappers.RecordVideo(
        gymnasium.make(
            "escort_mj/Escort-v0",
            scenario=load_scenario("main", SHORT),
            render_mode="rgb_array",
            size=(160, 90),
        ),
        str(tmp_path / "videos"),
        episode_trigger=lambda episode: True,
    )
    for seed in (1, 2):  # a mission in another place
        environment.reset(seed=seed)
        over = False
        while not over:
            *_, over, _ = environment.step(np.ones((5, 2), np.float32))
    environment.close()
    assert "OpenGL" not in sys.modules
    assert [(len(frames), fps) for frames, fps in clips] == [(6, 50), (6, 50)]
    (first, *_, last), (other, *_) = (frames for frames, _ in clips)
    assert first.shape == (90, 160, 3) and first.std() > 10.0
    assert (first != last).any() and (first != other).any()


@pytest.mark.slow_cases("sixteen_cell")
@needs_gl
@pytest.mark.parametrize(
    ("name", "shown"),
    [
        pytest.param("paper/case1_3d", "overview", marks=pytest.mark.slow),
        ("sixteen_cell", "overview"),
        ("main", "robot"),
    ],
)
def test_cameras_missions_in_more_axes_and_frames_left_out(name: str, shown: str) -> None:
    simulation = Simulation(load_scenario(name, SHORT).replace({"video.camera": shown, "video.robot": 2}))
    camera = Camera(simulation, (160, 90))
    simulation.reset()
    first = camera.picture()
    for _ in range(3):
        simulation.step(np.ones((simulation.count, simulation.axes)))
    last = camera.picture()
    camera.close()
    assert (first != last).any()


@needs_gl
@pytest.mark.slow
@pytest.mark.parametrize("name", ["main", "main_3d"])
@pytest.mark.parametrize("shown", ["overview", "top"])
def test_the_camera_stands_where_the_video_has_it(name: str, shown: str) -> None:
    painter, pictures = Camera(Simulation(load_scenario(name, SHORT)), (160, 90))._painter, []
    target = [0.0, 0.0, 0.3] if name == "main" else [0.0, 0.0, 0.0]
    for chosen in ({}, {"azimuth": 90.0}, {"azimuth": 0.0}, {"look_at": target, "distance": 2.0}):
        keys = {f"video.{key}": value for key, value in {"camera": shown, **chosen}.items()}
        camera = Camera(Simulation(load_scenario(name, SHORT | keys)), (160, 90))
        camera._painter = painter
        camera._simulation.reset()
        pictures.append(camera.picture().astype(float))
    painter.close()
    plain, same, turned, near = pictures
    assert abs(plain - same).mean() < 2.0 < abs(plain - turned).mean()  # by default they look along +y
    assert near[43:48, 78:83].mean() < 60.0 < near.mean()  # the target, which is black


def test_what_cannot_be_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    from escort_mj.environments.single import EscortEnv

    scenario = load_scenario("main", SHORT)
    with pytest.raises(UsageError, match='render_mode: found "human"; expected rgb_array or None'):
        EscortEnv(scenario, render_mode="human")
    environment = EscortEnv(scenario, render_mode="rgb_array")
    with pytest.raises(UsageError, match="call reset"):
        environment.render()
    environment.reset()
    monkeypatch.setattr(video, "choose_backend", lambda: (None, "EGL finds no device"))
    with pytest.raises(RenderError, match="nothing can be drawn on this machine: EGL finds no device"):
        environment.render()
    assert EscortEnv(scenario).render() is None


def test_a_child_that_fails_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(video, "choose_backend", lambda: ("egl", ""))
    broken = SimpleNamespace(executable="false")
    monkeypatch.setattr(live, "sys", broken)
    simulation = Simulation(load_scenario("main", SHORT))
    simulation.reset()
    with pytest.raises(RenderError, match="the renderer failed with exit code 1"):
        Camera(simulation).picture()
