"""Renders the frames of a run, one after another. Runs in a process of its own, where MuJoCo may draw."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from escort_mj.palette import MOST_DISTINCT
from escort_mj.report.figures.losses import LOST
from escort_mj.report.video.camera import View
from escort_mj.report.video.clip import Clip, Marks
from escort_mj.report.video.encode import VideoFile
from escort_mj.report.video.overlay import Overlay
from escort_mj.report.video.replay import Moment, Replay
from escort_mj.report.video.scene import Scenery
from escort_mj.report.video.shots import plan_shot
from escort_mj.report.video.solids import load_model, pose
from escort_mj.report.video.stages import panels_of, stage_replays
from escort_mj.scenario.schema.scenario import Video

ENDING = 1.5  # how long the last frame stays, with how the run ended [s of the video]
GLOW = 0.5  # how long a short event stays visible [s of the video]
CALM = 2.0  # how slowly a gliding camera answers [s of the video]
MOST_MARKS = 20000
FINE, COARSE = (32, 16), (20, 10)  # slices and stacks of a ball: of a few large ones, and of many small ones


def frame_times(start: float, end: float, video: Video) -> np.ndarray:
    """Simulated times of the frames: evenly spaced from the first sample to the last [s]."""
    step = video.speed / video.rate
    return np.append(np.arange(start, end - 0.5 * step, step), end)


def film(
    replay: Replay,
    model_path: Path,
    path: Path,
    video: Video,
    title: str,
    ending: tuple[str, bool],
    on_frame: Callable[[int, int], None],
    clip: Clip | None = None,
) -> None:
    """Render a run, or a clip of one, into a video file.

    Args:
        replay: The run.
        model_path: Its model.xml.
        path: The video to write.
        video: Size, rate, speed and camera.
        title: Name of the scenario.
        ending: How the run ended, in words, and whether that is well.
        on_frame: Told the number of frames done and of all, after each.
        clip: What to show of it; None for all.

    Raises:
        RenderError: If the model does not fit the record, or the video cannot be written.
    """
    model = _model(model_path, replay, video)
    data = mujoco.MjData(model)
    size = video.width, video.height
    replays = [replay, *stage_replays(replay, model)]
    panels = panels_of(len(replays) - 1, *size)
    shots = [
        plan_shot(seen, video.camera, model.vis.global_.fovy, panel.width / panel.height, CALM * video.speed)
        for seen, panel in zip(replays, panels, strict=True)
    ]
    scenery = Scenery(replay, video.speed, video.width)
    captions = [(seen.axes, panel) for seen, panel in zip(replays, panels, strict=True) if len(panels) > 1]
    overlay = Overlay(title, video.speed, replay.count, size, captions)
    marks = None if clip is None else Marks(clip, model, data)

    def posed(time: float) -> Moment:
        moment = replay.at(time)
        pose(model, data, moment.qpos, {seen.suffix: seen.at(time).target for seen in replays})
        mujoco.mj_camlight(model, data)
        return moment

    if marks is None or clip is None:
        times, held = frame_times(replay.time[0], replay.end, video), math.ceil(ENDING * video.rate)
    else:
        times, held = frame_times(clip.start, clip.end, video), 0
        shots[0] = marks.shot(replay, posed, panels[0].width / panels[0].height)
    total = len(times) + held
    nobody = np.zeros(replay.count, dtype=bool)
    frame = np.full((video.height, video.width, 3), 255, dtype=np.uint8)
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(VideoFile(path, size, video.rate))
        renderers = {
            shape: stack.enter_context(mujoco.Renderer(model, *shape, MOST_MARKS))
            for shape in {(panel.height, panel.width) for panel in panels}
        }
        for done, time in enumerate(times, 1):
            moment = posed(float(time))
            for robot, seen in itertools.product(np.flatnonzero(replay.lost[moment.sample]), replays):
                model.geom(f"robot_{robot + 1}{seen.suffix}_body").rgba[:3] = LOST
            avoiding = replay.lately(replay.avoiding, moment, GLOW * video.speed)
            touching = replay.lately(replay.touching, moment, GLOW * video.speed)
            for panel, shot in zip(panels, shots, strict=True):
                view = shot.view(moment.time)
                model.stat.extent = view.distance  # near and far limits of the view are given in it
                renderer = renderers[panel.height, panel.width]
                renderer.update_scene(data, _camera(view), _only(panel.number))
                if panel.number == 0:
                    if marks is None:
                        scenery.draw(renderer.scene, moment, avoiding, touching)
                    else:  # rings instead of halos
                        scenery.draw(renderer.scene, moment, nobody, nobody)
                        marks.draw(renderer.scene, moment.time, replay.planar, panel.width)
                panel.cut(frame)[:] = renderer.render()
            said = ending if clip is not None or done == len(times) else None
            overlay.write(frame, moment.time, avoiding, touching, replay.lost[moment.sample], said)
            file.add(frame)
            on_frame(done, total)
        for done in range(len(times) + 1, total + 1):
            file.add(frame)
            on_frame(done, total)


def _model(path: Path, replay: Replay, video: Video) -> mujoco.MjModel:
    """The run's model, set up for drawing only."""
    model = load_model(path, replay.qpos.shape[1])
    model.vis.global_.offwidth, model.vis.global_.offheight = video.width, video.height
    model.light_castshadow[:] = False  # half of a frame's cost; the scenery lays soft discs instead
    detail = FINE if replay.count <= MOST_DISTINCT else COARSE
    model.vis.quality.numslices, model.vis.quality.numstacks = detail
    return model


def _only(group: int) -> mujoco.MjvOption:
    """Show the geoms of one group."""
    option = mujoco.MjvOption()
    option.geomgroup[:] = 0
    option.geomgroup[group] = 1
    return option


def _camera(view: View) -> mujoco.MjvCamera:
    """A view as MuJoCo takes it."""
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = view.look_at
    camera.distance, camera.azimuth, camera.elevation = view.distance, view.azimuth, view.elevation
    return camera
