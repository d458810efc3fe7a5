"""The video's camera: as near as it can be while everything it must show is in the picture, and its way.

It shows the whole mission where that stays readable, else it glides along. The view is handed to MuJoCo as a
free camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.report.video.replay import Replay

if TYPE_CHECKING:
    from escort_mj.scenario.schema.scenario import Video

Array = NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """A free camera, as MuJoCo describes it.

    Attributes:
        look_at: Point in the middle of the picture, shape (3,) [m].
        distance: From the camera to that point [m].
        azimuth: Direction of view around the vertical [deg]; 90 looks along +y.
        elevation: Direction of view above the horizon [deg]; -90 looks straight down.
    """

    look_at: Array
    distance: float
    azimuth: float
    elevation: float


def view_axes(azimuth: float, elevation: float) -> Array:
    """Right, up and forward of a camera, as rows, shape (3, 3)."""
    a, e = math.radians(azimuth), math.radians(elevation)
    forward = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.array([math.sin(a), -math.cos(a), 0.0])
    return np.stack([right, np.cross(right, forward), forward])


class Insets(NamedTuple):
    """Rims of a picture that stay free, as shares of its width and height."""

    side: float
    top: float
    bottom: float


def frame(
    points: Array,
    azimuth: float,
    elevation: float,
    field_of_view: float,
    aspect: float,
    insets: Insets,
) -> View:
    """The nearest camera of a given direction that sees every point.

    A point is in the picture when it lies between four planes through the camera. Across the picture,
    and up and down it, that is linear in the camera's place, so the nearest place has a closed form.

    Args:
        points: What must be seen, shape (k, 3) [m].
        azimuth: Direction of view [deg].
        elevation: Direction of view [deg].
        field_of_view: Vertical angle of the picture [deg].
        aspect: Width over height of the picture.
        insets: Rims in which no point may be.
    """
    axes = view_axes(azimuth, elevation)
    right, up, forward = (np.asarray(points) @ axes.T).T
    slope = math.tan(math.radians(field_of_view) / 2)
    side = aspect * slope * (1.0 - 2.0 * insets.side)
    limits = (
        (right, side, side),
        (up, slope * (1.0 - 2.0 * insets.top), slope * (1.0 - 2.0 * insets.bottom)),
    )
    reach = [(np.max(x - plus * forward), np.max(-x - minus * forward)) for x, plus, minus in limits]
    depth = min(-(p + m) / (plus + minus) for (p, m), (_, plus, minus) in zip(reach, limits, strict=True))
    across = [
        ((p + plus * depth) + (-m - minus * depth)) / 2
        for (p, m), (_, plus, minus) in zip(reach, limits, strict=True)
    ]
    distance = max(float(np.median(forward)) - depth, 1e-3)
    return View(np.array([*across, depth + distance]) @ axes, distance, azimuth, elevation)


CameraName = Literal["overview", "follow", "top", "robot"]

PLANAR_ELEVATION = -55.0
SPACE_ELEVATION = -20.0
BEHIND, BEHIND_ELEVATION = 14.0, -20.0  # radii of the robot, degrees: of the camera behind it
ORBIT = 14.0  # degrees to either side: parallax shows depth
LEAST_CIRCLE = 0.2  # of the picture's height, or else the camera glides along
FRAMED_POINTS, FRAMED_MOMENTS, MOST_FRAMED = 400, 40, 20_000  # of a path: at most, at least, of all robots
INSETS = Insets(side=0.025, top=0.12, bottom=0.09)  # room for words


@dataclass(frozen=True)
class Shot:
    """A camera's way through a mission.

    Attributes:
        times: Key times [s].
        look_at: Shape (k, 3) [m].
        distance: Shape (k,) [m].
        azimuth: Shape (k,) [deg].
        elevation: [deg].
    """

    times: Array
    look_at: Array
    distance: Array
    azimuth: Array
    elevation: float

    def view(self, time: float) -> View:
        """Where the camera stands at a time."""
        look_at = np.array([np.interp(time, self.times, axis) for axis in self.look_at.T])
        distance = float(np.interp(time, self.times, self.distance))
        return View(look_at, distance, float(np.interp(time, self.times, self.azimuth)), self.elevation)


class Viewpoint(NamedTuple):
    """Where the camera stands, as far as the user says so; None where the mission decides.

    Attributes:
        azimuth: Direction of view around the vertical [deg].
        elevation: Direction of view above the horizon [deg].
        distance: From the point it looks at [m].
        robot: That the camera `robot` goes behind, from 0.
        look_at: The point, shape (3,) [m].
    """

    azimuth: float | None = None
    elevation: float | None = None
    distance: float | None = None
    robot: int = 0
    look_at: tuple[float, ...] | None = None

    @classmethod
    def of(cls, video: Video) -> Viewpoint:
        """Return where a scenario has the camera."""
        return cls(video.azimuth, video.elevation, video.distance, video.robot - 1, video.look_at)

    def chosen(self, view: View) -> View:
        """Return a view with what of it the user says."""
        said = {field.name: getattr(self, field.name) for field in fields(View)}
        return replace(view, **{name: value for name, value in said.items() if value is not None})


def plan_shot(
    replay: Replay,
    camera: CameraName,
    field_of_view: float,
    aspect: float,
    calm: float,
    stand: Viewpoint = Viewpoint(),  # noqa: B008
) -> Shot:
    """Plans the camera's way.

    Args:
        replay: The run.
        camera: `overview`, `follow`, `top` or `robot`.
        field_of_view: Vertical angle of the picture [deg].
        aspect: Width over height of the picture.
        calm: Time over which a gliding camera's motion is smoothed [s].
        stand: What of it the user chose.
    """
    elevation = -90.0 if camera == "top" else PLANAR_ELEVATION if replay.planar else SPACE_ELEVATION
    if stand.elevation is not None:
        elevation = stand.elevation
    times = np.linspace(replay.time[0], replay.end, 200)
    if camera == "robot":
        return _at(_behind(replay, times, calm, stand), stand)
    azimuth = np.full(len(times), 90.0)
    if stand.azimuth is not None:
        azimuth = np.full(len(times), stand.azimuth)
    elif not replay.planar and camera != "top":
        azimuth = _across(replay.target) + ORBIT * np.linspace(-1.0, 1.0, len(times))
    optics = (field_of_view, aspect, INSETS)
    if camera != "follow":
        everything = _everything(replay)
        views = [frame(everything, a, elevation, *optics) for a in azimuth]
        nearest = 2 * replay.radius / (2 * views[0].distance * math.tan(math.radians(field_of_view) / 2))
        if nearest >= LEAST_CIRCLE:
            return _at(_shot(times, views), stand)
    views = [
        frame(_around(replay, t, camera), a, elevation, *optics) for t, a in zip(times, azimuth, strict=True)
    ]
    return _at(_smooth(_shot(times, views), calm), stand)


def _behind(replay: Replay, times: Array, calm: float, stand: Viewpoint) -> Shot:
    """The way of a camera that goes behind a robot; it keeps its direction while the robot stands still."""
    path = np.array([replay.at(time).robots[stand.robot] for time in times])
    distance = np.full(len(times), BEHIND * float(replay.robot_radius[stand.robot]))
    elevation = BEHIND_ELEVATION if stand.elevation is None else stand.elevation
    glide = _smooth(Shot(times, path, distance, distance, elevation), calm)
    step = np.gradient(glide.look_at[:, :2], axis=0)
    moves = np.linalg.norm(step, axis=1) > 1e-3 * distance[0]
    azimuth = np.full(len(times), 90.0 if stand.azimuth is None else stand.azimuth)
    if stand.azimuth is None and moves.any():
        last = np.maximum.accumulate(np.where(moves, np.arange(len(times)), np.argmax(moves)))
        azimuth = np.degrees(np.unwrap(np.arctan2(step[last, 1], step[last, 0])))
    return Shot(times, path, distance, azimuth, elevation)


def _at(shot: Shot, stand: Viewpoint) -> Shot:
    """The same way at the distance and past the point that the user chose."""
    if stand.distance is not None:
        shot = replace(shot, distance=np.full(len(shot.times), stand.distance))
    if stand.look_at is not None:
        shot = replace(shot, look_at=np.tile(stand.look_at, (len(shot.times), 1)))
    return shot


def _shot(times: Array, views: list[View]) -> Shot:
    look_at = np.array([view.look_at for view in views])
    distance = np.array([view.distance for view in views])
    azimuth = np.array([view.azimuth for view in views])
    return Shot(times, look_at, distance, azimuth, views[0].elevation)


def _smooth(shot: Shot, duration: float) -> Shot:
    """The same way with the camera's place averaged over a time, so that it glides."""
    spacing = shot.times[1] - shot.times[0]
    half = int(np.clip(round(duration / max(spacing, 1e-9)), 0, len(shot.times) // 4))
    if half == 0:
        return shot
    weight = np.hanning(2 * half + 3)[1:-1]
    weight /= weight.sum()

    def average(values: Array) -> Array:
        return np.convolve(np.pad(values, half, mode="edge"), weight, mode="valid")

    look_at = np.stack([average(axis) for axis in shot.look_at.T], axis=1)
    return Shot(shot.times, look_at, average(shot.distance), shot.azimuth, shot.elevation)


def _across(path: Array) -> float:
    """Azimuth of a view across the main direction of a path, from the south side [deg]."""
    level = path[:, :2] - path[:, :2].mean(axis=0)
    if np.ptp(level, axis=0).max() < 1e-6:
        return 75.0
    heading = np.linalg.svd(level[:: max(1, len(level) // 1000)], full_matrices=False)[2][0]
    return (math.degrees(math.atan2(heading[1], heading[0])) + 90.0) % 180.0 - 15.0


def _circles(replay: Replay, centers: Array, radius: float | Array) -> Array:
    """Points on the outline of circles or spheres, shape (k, 3)."""
    angle = np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    if not replay.planar:
        ring = np.concatenate([ring, ring[:, [0, 2, 1]], ring[:, [2, 0, 1]]])
    size = np.broadcast_to(np.asarray(radius, dtype=float), (len(centers),))
    return (centers[:, None] + size[:, None, None] * ring).reshape(-1, 3)


def _reach(replay: Replay) -> float:
    """How far from the target robots are still followed: a diverged run must not shrink the picture [m]."""
    start = np.linalg.norm(replay.robots[0] - replay.target[0], axis=-1).max()
    return 2.0 * max(2.0 * replay.radius, float(start))


def _everything(replay: Replay) -> Array:
    """Points that the whole mission needs in the picture, shape (k, 3)."""
    moments = max(FRAMED_MOMENTS, min(FRAMED_POINTS, MOST_FRAMED // replay.count))
    rows = np.unique(np.linspace(0, len(replay.time) - 1, moments).astype(int))
    target = replay.target[rows]
    offset = replay.robots[rows] - target[:, None]
    near = (np.linalg.norm(offset, axis=-1) <= _reach(replay)) & ~replay.lost[rows]
    parts = [replay.robots[rows][near], replay.goals[rows].reshape(-1, 3)]
    if replay.escorts:
        parts += [_circles(replay, target[:: max(1, len(rows) // 40)], replay.radius)]
        parts += [_circles(replay, target[-1:], replay.radius)]
    if len(replay.obstacles):
        radius = np.maximum(replay.safe_radius, replay.obstacle_radius)
        for centers in (replay.obstacles[0], replay.obstacles[-1]):
            parts += [_circles(replay, centers, radius), (centers[:, None] + replay.outlines).reshape(-1, 3)]
    return np.concatenate(parts)


def _around(replay: Replay, time: float, camera: CameraName) -> Array:
    """Points that must be in the picture of a camera that goes with the target."""
    moment = replay.at(time)
    if camera == "follow":
        return _circles(replay, moment.target[None], 1.6 * replay.radius)
    near = np.linalg.norm(moment.robots - moment.target, axis=-1) <= _reach(replay)
    near &= ~replay.lost[moment.sample]
    return np.concatenate([_circles(replay, moment.target[None], 2.2 * replay.radius), moment.robots[near]])
