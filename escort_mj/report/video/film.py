"""Draws the frames of a run, each by itself. Runs in a process of its own, where MuJoCo may draw."""

from __future__ import annotations

import contextlib
import itertools
import math
from pathlib import Path

import mujoco
import numpy as np

from escort_mj.errors import RenderError
from escort_mj.palette import LOST, MOST_DISTINCT
from escort_mj.report.video.camera import View
from escort_mj.report.video.clip import Clip, Marks
from escort_mj.report.video.overlay import Overlay
from escort_mj.report.video.replay import Moment, Replay
from escort_mj.report.video.scene import Scenery
from escort_mj.report.video.shots import Viewpoint, plan_shot
from escort_mj.report.video.solids import load_model, pose
from escort_mj.report.video.stages import Pixels, panels_of, stage_replays
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


class Film:
    """The frames of a run, or of a clip of one, as a context; every frame can be drawn by itself.

    Attributes:
        size: Width and height of a frame [pixel].
        times: Simulated time of each frame, shape (k,) [s].
        held: How many times more the last frame is shown.
    """

    def __init__(
        self,
        replay: Replay,
        model_path: Path,
        video: Video,
        title: str,
        ending: tuple[str, bool],
        clip: Clip | None = None,
    ) -> None:
        """Plans a film.

        Args:
            replay: The run.
            model_path: Its model.xml.
            video: Size, rate, speed, camera and window.
            title: Name of the scenario.
            ending: How the run ended, in words, and whether that is well.
            clip: What to show of it; None for the video's window.

        Raises:
            RenderError: If the model does not fit the record, or the run ended before the window.
        """
        start, end = window_of(replay, video) if clip is None else (clip.start, clip.end)
        self.size = video.width, video.height
        self.times = frame_times(start, end, video)
        self._replay, self._ending, self._clip = replay, ending, clip
        self._model = model = load_model(model_path, replay.qpos.shape[1])
        prepare(model, video.width, video.height, replay.count)
        self._data = mujoco.MjData(model)
        self._glow = GLOW * video.speed
        self._replays = [replay, *stage_replays(replay, model)]
        self._panels = panels_of(len(self._replays) - 1, *self.size)
        stand, angle = Viewpoint(video.azimuth, video.elevation, video.distance), model.vis.global_.fovy
        self._shots = [
            plan_shot(seen, video.camera, angle, panel.width / panel.height, CALM * video.speed, stand)
            for seen, panel in zip(
                (seen.between(start, end) for seen in self._replays), self._panels, strict=True
            )
        ]
        self._scenery = Scenery(replay, video.speed, video.width)
        several = len(self._panels) > 1
        captions = [
            (seen.axes, panel) for seen, panel in zip(self._replays, self._panels, strict=True) if several
        ]
        self._overlay = Overlay(title, video.speed, replay.count, self.size, captions)
        self._marks = None if clip is None else Marks(clip, model, self._data)
        self._ends = clip is not None or end >= replay.end
        self.held = math.ceil(ENDING * video.rate) if clip is None and self._ends else 0
        if self._marks is not None:
            panel = self._panels[0]
            self._shots[0] = self._marks.shot(replay, self._posed, panel.width / panel.height)

    def __enter__(self) -> Film:
        with contextlib.ExitStack() as stack:
            self._renderers = {
                shape: stack.enter_context(mujoco.Renderer(self._model, *shape, MOST_MARKS))
                for shape in {(panel.height, panel.width) for panel in self._panels}
            }
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def frame(self, index: int) -> Pixels:
        """Draw one of the frames at `times`, shape (height, width, 3)."""
        replay, marks = self._replay, self._marks
        moment = self._posed(float(self.times[index]))
        colors = replay.colors(moment.sample)
        self._overlay.paint(colors)
        for number, color in enumerate(colors if replay.members.size else (), 1):
            self._model.geom(f"robot_{number}_body").rgba[:3] = color
        for name, color in zip(replay.targets, replay.target_colors(moment.sample), strict=True):
            self._model.geom(f"{name}_body").rgba[:3] = color
        for robot, seen in itertools.product(np.flatnonzero(replay.lost[moment.sample]), self._replays):
            self._model.geom(f"robot_{robot + 1}{seen.suffix}_body").rgba[:3] = LOST
        avoiding = replay.lately(replay.avoiding, moment, self._glow)
        touching = replay.lately(replay.touching, moment, self._glow)
        frame = np.full((*self.size[::-1], 3), 255, dtype=np.uint8)
        for panel, shot in zip(self._panels, self._shots, strict=True):
            view = shot.view(moment.time)
            self._model.stat.extent = view.distance  # near and far limits of the view are given in it
            renderer = self._renderers[panel.height, panel.width]
            renderer.update_scene(self._data, _camera(view), only(panel.number))
            skip_sky(renderer.scene, panel.width / panel.height)
            if panel.number == 0 and marks is None:
                self._scenery.draw(renderer.scene, moment, avoiding, touching)
            elif panel.number == 0 and marks is not None:  # rings instead of halos
                nobody = np.zeros(replay.count, dtype=bool)
                self._scenery.draw(renderer.scene, moment, nobody, nobody)
                marks.draw(renderer.scene, moment.time, replay.planar, panel.width)
            panel.cut(frame)[:] = renderer.render()
        last = self._ends and index == len(self.times) - 1
        ending = self._ending if self._clip is not None or last else None
        self._overlay.write(frame, moment.time, avoiding, touching, replay.lost[moment.sample], ending)
        return frame

    def _posed(self, time: float) -> Moment:
        """Put every body where it was at a time."""
        moment = self._replay.at(time)
        targets = {seen.suffix: seen.at(time).target for seen in self._replays}
        pose(self._model, self._data, moment.qpos, targets)
        mujoco.mj_camlight(self._model, self._data)
        return moment


def window_of(replay: Replay, video: Video) -> tuple[float, float]:
    """When a video begins and ends [s].

    Raises:
        RenderError: If the run ended before.
    """
    start = max(float(replay.time[0]), video.start or 0.0)
    if start > replay.end:
        raise RenderError(f"the video begins at {start:g} s; the run ended at {replay.end:g} s")
    return start, replay.end if video.end is None else min(replay.end, video.end)


def prepare(model: mujoco.MjModel, width: int, height: int, robots: int) -> None:
    """Set up a model for drawing only.

    Args:
        model: What to change.
        width: Of a picture [pixel].
        height: Of a picture [pixel].
        robots: How many there are.
    """
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    model.light_castshadow[:] = False  # half of a frame's cost; the scenery lays soft discs instead
    detail = FINE if robots <= MOST_DISTINCT else COARSE
    model.vis.quality.numslices, model.vis.quality.numstacks = detail


def skip_sky(scene: mujoco.MjvScene, aspect: float) -> None:
    """Leave out the sky, a third of the cost of an empty picture, where the floor hides all of it.

    Args:
        scene: Just updated; the floor is a plane in it.
        aspect: Width of the picture over its height.
    """
    camera = scene.camera[0]
    forward, up = np.array(camera.forward, dtype=float), np.array(camera.up, dtype=float)
    half = 0.5 * (camera.frustum_top - camera.frustum_bottom)
    middle = camera.frustum_near * forward + 0.5 * (camera.frustum_top + camera.frustum_bottom) * up
    corners = [
        middle + half * (y * up + x * aspect * np.cross(forward, up))
        for x in (-1.0, 1.0)
        for y in (-1.0, 1.0)
    ]
    hidden = any(
        _is_behind(geom, np.array(camera.pos, dtype=float), corners, camera.frustum_far)
        for geom in scene.geoms[: scene.ngeom]
        if geom.type == mujoco.mjtGeom.mjGEOM_PLANE
    )
    for flag in (mujoco.mjtRndFlag.mjRND_SKYBOX, mujoco.mjtRndFlag.mjRND_HAZE):
        scene.flags[flag] = not hidden


def _is_behind(plane: mujoco.MjvGeom, eye: np.ndarray, rays: list[np.ndarray], far: float) -> bool:
    """Whether all rays from an eye end on a plane without bounds, and well within the view's depth."""
    if plane.size[:2].any() or plane.rgba[3] < 1.0:
        return False
    normal = np.array(plane.mat, dtype=float).reshape(3, 3)[:, 2]
    height = normal @ (eye - np.array(plane.pos, dtype=float))
    return height > 0.0 and all(
        (sinking := -(normal @ ray) / np.linalg.norm(ray)) > 0.0 and height / sinking < 0.5 * far
        for ray in rays
    )


def only(group: int) -> mujoco.MjvOption:
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
