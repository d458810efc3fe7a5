"""What the video draws beside MuJoCo's model: escort circle, safe spheres, trails, links, halos, shadows."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.numerics.formation import widest_spacing
from escort_mj.palette import LOST
from escort_mj.report.video.pen import Pen, circle
from escort_mj.report.video.replay import Flags, Moment, Replay
from escort_mj.scenario.geometry.shapes import in_space, outward

Array = NDArray[np.float64]

NEAR = 1.7  # spacings up to which neighbors in a crowd are linked
SIGHT_PIECES = 24
TRAIL_PIECES = 60
MOST_TRAIL_PIECES = 1000  # of all robots together; a crowd has no trails

_X, _Y, _Z = np.eye(3)
_FLAT = np.array([1.0, 1.0, 0.0])
_LINKS, _TRAILS, _MARKS = 0.010, 0.014, 0.018  # heights above the floor, so that none hides another [m]


class Scenery:
    """Draws one moment of a mission after another.

    Attributes:
        replay: The run.
        trail: How long trails are [s].
        ground: Height of the floor, or of the grid that stands for one in space [m].
    """

    def __init__(self, replay: Replay, speed: float, width: int) -> None:
        """Prepare the constant marks.

        Args:
            replay: The run.
            speed: Simulated seconds per second of the video.
            width: Width of the picture [pixel]; lines are made for 1280.
        """
        self.replay = replay
        self.trail = 8.0 * speed
        self.ground = 0.0 if replay.planar else _ground(replay)
        self._pixel = max(width / 1280.0, 0.5)
        self._colors = replay.colors(0)
        self._pieces = max(6, min(TRAIL_PIECES, MOST_TRAIL_PIECES // replay.count))
        self._crowd = replay.count > palette.MOST_LINES
        self._near = NEAR * widest_spacing(replay.count, 2 if replay.planar else 3, replay.radius)
        self._safe = np.maximum(replay.safe_radius, 0.0)

    def draw(self, scene: mujoco.MjvScene, moment: Moment, avoiding: Flags, touching: Flags) -> None:
        """Add the marks of one moment to a scene that holds the model.

        Args:
            scene: MuJoCo's scene, just updated from the data.
            moment: Now.
            avoiding: Robots to show as avoiding something, shape (n,).
            touching: Robots to show as touching something, shape (n,).
        """
        pen, self._colors = Pen(scene), self.replay.colors(moment.sample)
        if not self.replay.planar:
            self._grid(pen)
        self._shadows(pen, moment)
        self._obstacles(pen, moment)
        self._escort(pen, moment)
        self._links(pen, moment)
        if not self._crowd:
            self._knowledge(pen, moment)
            self._returns(pen, moment)
        self._trails(pen, moment)
        self._events(pen, moment, avoiding, touching)

    def _down(self, points: Array, height: float) -> Array:
        """Points laid on the floor in a planar mission; elsewhere as they are."""
        return points * _FLAT + height * _Z if self.replay.planar else points

    def _grid(self, pen: Pen) -> None:
        """A grid below a mission in space, faint: without one, nothing tells near from far."""
        replay = self.replay
        low = replay.target.min(axis=0) - 2.5 * replay.radius
        high = replay.target.max(axis=0) + 2.5 * replay.radius
        step = replay.radius / 2 * max(1.0, np.ceil((high - low)[:2].max() / (30 * replay.radius)))
        (left, right), (front, back) = (
            (np.floor(low[k] / step) * step, np.ceil(high[k] / step) * step) for k in (0, 1)
        )
        for x in np.arange(left, right + step / 2, step):
            line = np.array([[x, front, self.ground], [x, back, self.ground]])
            pen.path(line, palette.OBSTACLE, self._pixel, 0.25)
        for y in np.arange(front, back + step / 2, step):
            line = np.array([[left, y, self.ground], [right, y, self.ground]])
            pen.path(line, palette.OBSTACLE, self._pixel, 0.25)

    def _shadows(self, pen: Pen, moment: Moment) -> None:
        """Soft discs below everything: what a vertical sun would cast, at no cost."""
        replay = self.replay
        bodies = [] if self._crowd else [*zip(moment.robots, replay.robot_radius, strict=True)]
        bodies += [*zip(moment.obstacles, replay.obstacle_radius, strict=True)]
        if replay.escorts:
            bodies.append((moment.target, 1.5 * float(replay.robot_radius.mean())))
        for center, radius in bodies:
            spot = center * _FLAT + (self.ground + 0.003) * _Z
            for size, alpha in ((1.25, 0.10), (1.0, 0.14)):
                pen.disc(
                    spot, size * radius, palette.TARGET, alpha, 12 if radius < 0.1 * replay.radius else 24
                )

    def _obstacles(self, pen: Pen, moment: Moment) -> None:
        """The safe circle of every obstacle; of a sphere its outline, as seen.

        What keeps robots off an obstacle of another shape is drawn in the plane only.
        """
        camera = pen.scene.camera[0]
        up = np.array(camera.up, dtype=float)
        across = np.cross(np.array(camera.forward, dtype=float), up)
        around = self.replay.outlines
        for center, safe, radius, points in zip(
            moment.obstacles, self._safe, self.replay.obstacle_radius, around, strict=True
        ):
            if safe <= 0.0:
                continue
            spot = self._down(center, _LINKS)
            if radius == 0.0:
                if self.replay.planar:
                    pen.path(
                        spot + points + safe * in_space(outward(2)), palette.CONTACT, 1.5 * self._pixel, 0.55
                    )
                continue
            if self.replay.planar:
                pen.disc(spot, safe, palette.CONTACT, 0.07, 36)
                pen.path(circle(spot, safe, 48, _X, _Y), palette.CONTACT, 1.5 * self._pixel, 0.55)
            else:
                pen.path(circle(spot, safe, 48, across, up), palette.CONTACT, self._pixel, 0.45)

    def _escort(self, pen: Pen, moment: Moment) -> None:
        """The circle or sphere that the robots are to keep around the target, and their goals."""
        if not self._crowd:
            self._goals(pen, moment)
        replay, width = self.replay, 2.0 * self._pixel
        circles = [(moment.target, radius, palette.LIMIT) for radius in replay.rings(moment)]
        centers, sizes = replay.team_centers[moment.sample], replay.team_radius[moment.sample]
        for number, (place, size) in enumerate(zip(centers, sizes, strict=True)):
            circles.append((place, float(size), palette.team_color(number)))
        for place, radius, color in circles:
            center = self._down(place, _LINKS)
            if replay.planar:
                pen.path(circle(center, radius, 96, _X, _Y), color, width, 0.8, dashed=True)
                continue
            pen.ball(center, radius, (0.55, 0.65, 0.80), 0.10)
            for across, up in ((_X, _Y), (_Y, _Z), (_X, _Z)):
                pen.path(circle(center, radius, 96, across, up), color, width / 2, 0.45, dashed=True)

    def _goals(self, pen: Pen, moment: Moment) -> None:
        """A ring or a faint ball where each robot goes."""
        goals = self.replay.goals[moment.sample]
        for place, color, radius in zip(goals, self._colors, self.replay.robot_radius, strict=False):
            if self.replay.planar:
                spot = self._down(place, _LINKS)
                pen.path(circle(spot, 1.3 * radius, 24, _X, _Y), color, 2.0 * self._pixel, 0.9)
            else:
                pen.ball(place, 1.3 * radius, color, 0.2)

    def _links(self, pen: Pen, moment: Moment) -> None:
        """Who hears whom, without a radio who is whose neighbor.

        In a crowd those that are near; in space on this side of the target.
        """
        pairs = self.replay.linked(moment.sample)
        color = palette.RADIO if self.replay.communicates else palette.LIMIT
        ends = moment.robots[pairs]
        if self._crowd:
            ends = ends[np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) < self._near]
            if not self.replay.planar:
                beyond = (ends.mean(axis=1) - moment.target) @ np.array(pen.scene.camera[0].forward)
                ends = ends[beyond < 0.0]
        for pair in ends:
            pen.path(pair, color, 1.5 * self._pixel, 0.5 if self.replay.communicates else 0.35)

    def _knowledge(self, pen: Pen, moment: Moment) -> None:
        """A dashed line of sight from each robot that sees the target, and ghosts where robots believe it."""
        replay, lost, aims = self.replay, self.replay.lost[moment.sample], self.replay.aims(moment)
        for index in np.flatnonzero(replay.seen[moment.sample] & ~lost[: replay.seen.shape[1]]):
            sight = np.linspace(moment.robots[index], aims[index], SIGHT_PIECES)
            pen.path(sight, self._colors[index], 2.0 * self._pixel, 0.9, dashed=True)
        for place, color, absent in zip(replay.estimates[moment.sample], self._colors, lost, strict=False):
            if not absent:
                pen.ball(place, replay.ghost_radius, color, 0.3)

    def _returns(self, pen: Pen, moment: Moment) -> None:
        """The end of each ray of a lidar that met something."""
        for ends, robot in zip(*self.replay.returned(moment), strict=True):
            pen.path(ends, self._colors[robot], 2.5 * self._pixel, 0.9)

    def _trails(self, pen: Pen, moment: Moment) -> None:
        """Where everyone was lately, fading."""
        replay = self.replay
        if replay.escorts:
            target = self._trail(replay.target, moment.target, moment, TRAIL_PIECES)
            pen.path(target, palette.TARGET, 2.0 * self._pixel, _fade(target))
        if replay.opponents:
            last = slice(-replay.opponents, None)
            ways = self._trail(replay.obstacles[:, last], moment.obstacles[last], moment, self._pieces)
            for way in ways.swapaxes(0, 1):
                pen.path(way, palette.OPPONENT, 3.5 * self._pixel, _fade(way))
        if self._crowd:
            return
        robots = self._trail(replay.robots, moment.robots, moment, self._pieces)
        for index, color in enumerate(self._colors):
            color = LOST if replay.lost[moment.sample, index] else color
            pen.path(robots[:, index], color, 3.5 * self._pixel, _fade(robots))

    def _trail(self, values: Array, present: Array, moment: Moment, pieces: int) -> Array:
        past = self.replay.past(values, moment, self.trail, pieces)
        return self._down(np.concatenate([past, present[None]]), _TRAILS)

    def _events(self, pen: Pen, moment: Moment, avoiding: Flags, touching: Flags) -> None:
        """Halos of robots that avoid something, marks on robots that touched something."""
        for index in np.flatnonzero(avoiding | touching):
            center, radius = moment.robots[index], float(self.replay.robot_radius[index])
            color = palette.CONTACT if touching[index] else self._colors[index]
            pen.ball(center, 2.2 * radius, color, 0.35)
            if self.replay.planar:
                ring = circle(center * _FLAT + _MARKS * _Z, 2.6 * radius, 40, _X, _Y)
                pen.path(ring, color, 2.5 * self._pixel, 0.9)


def _fade(trail: Array) -> Array:
    return np.linspace(0.05, 0.9, max(len(trail) - 1, 0))


def _ground(replay: Replay) -> float:
    """Height of the grid below a mission in space [m]."""
    return float(replay.target[:, 2].min() - 1.4 * replay.radius)
