"""A short video around the worst moment of a run that failed: when, how slow, whom to mark."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.record.folder import StoredRun
from escort_mj.record.outcome import Verdict
from escort_mj.report.video.camera import PLANAR_ELEVATION, SPACE_ELEVATION, Insets, Shot, frame
from escort_mj.report.video.replay import Moment, Replay
from escort_mj.report.video.scene import SceneWriter, circle

Array = NDArray[np.float64]

LENGTH = 4.0  # of a clip [s of the video]
PAIR_SPAN, LONE_SPAN = 1.6, 4.0  # what it shows of a pair that meets, and of anything else [s]
BEFORE = 0.6  # share of a clip before its moment
VIEW = 7.0  # how far around a meeting is seen, in radii of the smaller body
LARGE = 3.0  # a body so many times larger than the other is marked where they meet only
MARGINS = Insets(side=0.04, top=0.14, bottom=0.24)  # room for words
FAR = 1e3  # nearest points are looked for within this distance [m]


class Clip(NamedTuple):
    """What a clip shows.

    Attributes:
        start: First time [s].
        end: Last time [s].
        moment: What it is about [s].
        speed: Simulated seconds per second of the video.
        bodies: Whom to mark.
        words: What failed.
    """

    start: float
    end: float
    moment: float
    speed: float
    bodies: tuple[str, ...]
    words: str


def plan_clip(run: StoredRun) -> Clip:
    """The clip of a run: of a verdict that failed and has a moment, best of a pair; else of the run's end."""
    first, last = (float(run.recording["time"][place]) for place in (0, -1))
    failed = [verdict for verdict in run.verdicts if not verdict.passed] or run.verdicts
    worst = max(failed, key=_telling, default=None)
    moment, bodies = (None, ()) if worst is None else (worst.time, worst.bodies)
    moment = last if moment is None else min(max(moment, first), last)
    span = min(PAIR_SPAN if len(bodies) == 2 else LONE_SPAN, last - first)
    start = min(max(moment - BEFORE * span, first), last - span)
    words = str(run.outcome["message"]) if worst is None else worst.message
    return Clip(start, start + span, moment, max(span / LENGTH, 1e-3), bodies, words)


def _telling(verdict: Verdict) -> tuple[bool, int]:
    """How much there is to see of a verdict."""
    return verdict.time is not None, len(verdict.bodies)


class Rings:
    """Rings around the bodies that a clip is about, and around where two of them are nearest.

    Attributes:
        clip: What the clip shows.
    """

    def __init__(self, clip: Clip, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Find the bodies in a model; those that it does not have are not marked."""
        self.clip = clip
        self._model, self._data = model, data
        bodies = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) for name in clip.bodies]
        self._bodies = [body for body in bodies if body > 0]
        self._radius = [_reach(model, body) for body in self._bodies]
        self._on_floor = "floor" in clip.bodies

    def shot(self, replay: Replay, pose: Callable[[float], Moment], aspect: float) -> Shot:
        """A camera at rest: near where two bodies meet, or on the escort and the robots that are marked.

        Args:
            replay: The run.
            pose: Puts every body where it was at a time.
            aspect: Width over height of the picture.
        """
        azimuth, seen = 90.0, []
        if self._meets:
            pose(self.clip.moment)
            small, large = min(self._radius), min(max(self._radius), LARGE * min(self._radius))
            seen = [_around(self._meeting(), max(VIEW * small, 3.0 * large))]
            apart = self._data.xpos[self._bodies[-1]] - self._data.xpos[self._bodies[0]]
            if np.linalg.norm(apart[:2]) > 0.1 * self._radius[0]:  # none of the two in front of the other
                azimuth = (math.degrees(math.atan2(apart[1], apart[0])) + 90.0) % 180.0
        else:
            for time in np.linspace(self.clip.start, self.clip.end, 5):
                seen.append(_around(pose(float(time)).target, 1.1 * replay.radius))
                seen += [_around(self._data.xpos[body], 3.0 * self._radius[0]) for body in self._bodies]
        elevation = PLANAR_ELEVATION if replay.planar else SPACE_ELEVATION
        angle = self._model.vis.global_.fovy
        view = frame(np.concatenate(seen), azimuth, elevation, angle, aspect, MARGINS)
        times, look_at = np.array([self.clip.start, self.clip.end]), np.tile(view.look_at, (2, 1))
        return Shot(times, look_at, np.full(2, view.distance), np.full(2, azimuth), elevation)

    def draw(self, scene: mujoco.MjvScene, time: float, planar: bool, width: int) -> None:
        """Add the rings to a scene that was just updated from the data.

        Args:
            scene: MuJoCo's scene.
            time: Now [s]; where two bodies meet is marked once they did.
            planar: Whether rings lie flat, or face the camera.
            width: Of the picture [pixel].
        """
        writer = SceneWriter(scene)
        across, up = np.eye(3)[:2] if planar else writer.facing
        line, small = 4.0 * max(width / 1280.0, 0.5), min(self._radius, default=0.0)
        for body, radius in zip(self._bodies, self._radius, strict=True):
            if radius <= LARGE * small:
                ring = circle(self._data.xpos[body].copy(), 1.4 * radius, 60, across, up)
                writer.path(ring, palette.CONTACT, line, 1.0)
        if self._meets and time >= self.clip.moment:
            foot = self._meeting()  # hidden between the bodies: a pin shows it
            head = foot + np.array([0.0, 0.0, 2.5 * small])
            writer.path(np.array([foot, head]), palette.CONTACT, line, 1.0)
            writer.ball(head, 0.3 * small, palette.CONTACT, 1.0)

    @property
    def _meets(self) -> bool:
        """Whether it is about two bodies, and where they meet."""
        return len(self._bodies) == 2 or (self._on_floor and bool(self._bodies))

    def _meeting(self) -> Array:
        """Midpoint of where two bodies are nearest to each other, shape (3,) [m]."""
        first = self._bodies[0]
        center: Array = self._data.xpos[first].copy()
        if len(self._bodies) < 2:
            return center - np.array([0.0, 0.0, self._radius[0]]) if self._on_floor else center
        least, ends = math.inf, np.zeros(6)
        for one in _geoms(self._model, first):
            for other in _geoms(self._model, self._bodies[1]):
                found = np.zeros(6)
                distance = mujoco.mj_geomDistance(self._model, self._data, one, other, FAR, found)
                if distance < least:
                    least, ends = distance, found
        return 0.5 * (ends[:3] + ends[3:])


def _around(center: Array, size: float) -> Array:
    """Points around a place that a picture of it must hold, shape (4, 3) [m]."""
    return center + size * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])


def _geoms(model: mujoco.MjModel, body: int) -> Sequence[int]:
    """The geoms of a body."""
    return range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])


def _reach(model: mujoco.MjModel, body: int) -> float:
    """Radius of the sphere around a body's largest geom [m]."""
    return float(max((model.geom_rbound[geom] for geom in _geoms(model, body)), default=0.0))
