"""Draws the frames of a run, each by itself. Runs in a process of its own, where MuJoCo may draw."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj.errors import RenderError
from escort_mj.palette import LOST, MOST_DISTINCT
from escort_mj.report.video.camera import View, Viewpoint, plan_shot
from escort_mj.report.video.clip import Clip, Rings
from escort_mj.report.video.overlay import Overlay
from escort_mj.report.video.replay import Moment, Replay
from escort_mj.report.video.scene import draw_marks
from escort_mj.report.video.solids import load_model, pose
from escort_mj.scenario.schema.scenario import Video

Pixels = NDArray[np.uint8]

ENDING = 1.5  # how long the last frame stays, with how the run ended [s of the video]
TRAIL = 8.0  # how long trails are [s of the video]
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
            RunFolderError: If the model is damaged or does not fit the record.
            RenderError: If the run ended before the window.
        """
        start, end = window_of(replay, video) if clip is None else (clip.start, clip.end)
        self.size = video.width, video.height
        self.times = frame_times(start, end, video)
        self._replay, self._ending, self._clip = replay, ending, clip
        self._model = model = load_model(model_path, replay.qpos.shape[1])
        prepare(model, video.width, video.height, replay.count)
        self._data = mujoco.MjData(model)
        self._glow = GLOW * video.speed
        self._aspect = video.width / video.height
        stand = Viewpoint.of(video)
        angle = model.vis.global_.fovy
        self._trail = TRAIL * video.speed
        self._overlay = Overlay(title, video.speed, replay.count, self.size)
        self._ends = clip is not None or end >= replay.end
        self.held = math.ceil(ENDING * video.rate) if clip is None and self._ends else 0
        if clip is None:
            self._rings = None
            shown = replay.between(start, end)
            self._shot = plan_shot(shown, video.camera, angle, self._aspect, CALM * video.speed, stand)
        else:
            self._rings = Rings(clip, model, self._data)
            self._shot = self._rings.shot(replay, self._posed, self._aspect)

    def __enter__(self) -> Film:
        width, height = self.size
        self._renderer = mujoco.Renderer(self._model, height, width, MOST_MARKS)
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()

    def frame(self, index: int) -> Pixels:
        """Draw one of the frames at `times`, shape (height, width, 3)."""
        replay, rings = self._replay, self._rings
        moment = self._posed(float(self.times[index]))
        colors = replay.colors(moment.sample)
        self._overlay.paint(colors)
        for number, color in enumerate(colors if replay.members.size else (), 1):
            self._model.geom(f"robot_{number}_body").rgba[:3] = color
        for name, color in zip(replay.targets, replay.target_colors(moment.sample), strict=True):
            self._model.geom(f"{name}_body").rgba[:3] = color
        for robot in np.flatnonzero(replay.lost[moment.sample]):
            self._model.geom(f"robot_{robot + 1}_body").rgba[:3] = LOST
        avoiding, touching = replay.lately(moment, self._glow)
        view, scene = self._shot.view(moment.time), self._renderer.scene
        self._model.stat.extent = view.distance  # near and far limits of the view are given in it
        self._renderer.update_scene(self._data, free_camera(view), in_space())
        skip_sky(scene, self._aspect)
        halos = None if rings else (avoiding, touching)
        draw_marks(scene, replay, moment, self._trail, halos, self.size[0])
        if rings:
            rings.draw(scene, moment.time, replay.planar, self.size[0])
        frame: Pixels = self._renderer.render()
        last = self._ends and index == len(self.times) - 1
        ending = self._ending if self._clip is not None or last else None
        self._overlay.write(frame, moment.time, avoiding, touching, replay.lost[moment.sample], ending)
        return frame

    def _posed(self, time: float) -> Moment:
        """Put every body where it was at a time."""
        moment = self._replay.at(time)
        pose(self._model, self._data, moment.qpos, moment.target)
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


def in_space() -> mujoco.MjvOption:
    """Show the bodies along x, y, z, and none of further axes, whose geoms are of other groups."""
    option = mujoco.MjvOption()
    option.geomgroup[:] = [1, 0, 0, 0, 0, 0]
    return option


def free_camera(view: View) -> mujoco.MjvCamera:
    """Return a view as MuJoCo takes it."""
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = view.look_at
    camera.distance, camera.azimuth, camera.elevation = view.distance, view.azimuth, view.elevation
    return camera
