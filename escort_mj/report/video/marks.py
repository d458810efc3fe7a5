"""What pictures of a mission show beside its bodies: lines, circles, balls, discs, arrows and texts.

MuJoCo's renderer (`scene.py`), the viewer in the browser (`view/stage.py`) and the replay of a page
(`pages/replay_data.py`) draw these marks, each in its own way.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator
from functools import partial
from itertools import chain
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.numerics.formation import widest_spacing
from escort_mj.palette import LOST, Color
from escort_mj.report.video.cuts import cut, hatched
from escort_mj.report.video.replay import Flags, Moment, Replay
from escort_mj.scenario.geometry.shapes import in_space, outward

Array = NDArray[np.float64]

Kind = Literal["line", "trail", "circle", "outline", "ball", "disc", "arrow", "text"]
"""An outline is what is seen of a sphere from where the camera is; a disc lies on the floor."""
LAYERS = {
    "trails": "trails",
    "velocities": "task velocities",
    "safe": "safe distances and borders",
    "contacts": "avoidance and contacts",
    "links": "neighbors, or who hears whom",
    "knowledge": "estimates and lines of sight",
    "returns": "returns of lidars",
    "escort": "escort radius and goals",
    "numbers": "numbers",
}
"""What can be switched on and off, and what it is called; `shadows` and `grid` are always there."""
OF_FEW = ("knowledge", "returns", "numbers")  # layers that crowds do not have
NEAR = 1.7  # spacings up to which neighbors in a crowd are linked
TRAIL_PIECES, MOST_TRAIL_PIECES = 60, 1000  # of one trail, and of all robots' together
AHEAD = 3.0  # an arrow ends where its velocity leads to in this time [s]
LEAST = np.array([1e-6, 0.0, 0.0])  # an arrow of no length has no direction [m]
VEIL = (0.55, 0.65, 0.80)  # of the sphere that robots keep to
ON_FLOOR, LINKED, TRAILED, RINGED = 0.003, 0.010, 0.014, 0.018  # heights, so that none hides another [m]


class Mark(NamedTuple):
    """One mark at one moment.

    Attributes:
        layer: What it belongs to.
        kind: What it is.
        name: What it is of; a mark of this layer and name at another moment is the same one.
        points: Of a line or an arrow; else its center; shape (k, 3) [m].
        color: Its color.
        alpha: Opacity in 0..1.
        radius: Of a circle, a ball, a disc [m].
        width: Of a line, for a picture 1280 wide [pixel].
        height: Where it lies on the floor, above the ground's zero [m]; None where it is in space.
        dashed: Whether every other piece of a line is left out.
        normal: Axis (0, 1, 2) that a circle goes around.
        pieces: Of a circle or a disc.
        text: Of a text.
    """

    layer: str
    kind: Kind
    name: str
    points: Array
    color: Color
    alpha: float = 1.0
    radius: float = 0.0
    width: float = 0.0
    height: float | None = None
    dashed: bool = False
    normal: int = 2
    pieces: int = 48
    text: str = ""

    @property
    def placed(self) -> Array:
        """The points where they are drawn, shape (k, 3) [m]."""
        if self.height is None:
            return self.points
        return np.column_stack([self.points[:, :2], np.full(len(self.points), self.height)])


def marks(
    replay: Replay,
    moment: Moment,
    trail: float = 8.0,
    flags: tuple[Flags, Flags] | None = None,
    forward: Array | None = None,
    left_out: Container[str] = (),
) -> Iterator[Mark]:
    """Yield the marks of a moment, those that hide others last.

    Args:
        replay: The run.
        moment: Now.
        trail: How long trails are [s].
        flags: Robots to show as avoiding, and as touching something, shape (n,) each; None for nobody.
        forward: Where the camera looks, shape (3,): of a crowd in space, links on this side are shown.
        left_out: Layers that are not asked for.
    """
    scene = _Scene(replay, moment)
    layers: dict[str, Callable[[], Iterable[Mark]]] = {
        "grid": scene.grid,
        "shadows": scene.shadows,
        "safe": lambda: chain(scene.obstacles(), scene.borders()),
        "escort": scene.escort,
        "links": partial(scene.links, forward),
        "knowledge": scene.knowledge,
        "returns": scene.returns,
        "trails": partial(scene.trails, trail),
        "velocities": scene.velocities,
        "numbers": scene.numbers,
        "contacts": partial(scene.contacts, *flags) if flags else tuple,
    }
    for layer, draw in layers.items():
        if layer not in left_out and not (scene.crowd and layer in OF_FEW):
            yield from draw()


def ground_of(replay: Replay) -> float:
    """Height of the floor, or of the grid that stands for one in space [m]."""
    return 0.0 if replay.planar else float(replay.target[:, 2].min() - 1.4 * replay.radius)


class _Scene:
    """The marks of a moment, by what they show."""

    def __init__(self, replay: Replay, moment: Moment) -> None:
        self.replay, self.moment = replay, moment
        self.crowd = replay.count > palette.MOST_LINES
        self.lost = replay.lost[moment.sample]
        self.colors = replay.colors(moment.sample)
        self.ground = ground_of(replay)

    def on_floor(self, height: float) -> float | None:
        """A height of marks that lie on the floor in a planar mission, and where they are in space."""
        return height if self.replay.planar else None

    @property
    def extent(self) -> tuple[Array, Array]:
        """Lower and upper corner of where the mission is, shape (3,) each [m]."""
        way, around = self.replay.target, 2.5 * self.replay.radius
        return way.min(axis=0) - around, way.max(axis=0) + around

    def grid(self) -> Iterator[Mark]:
        """A grid below a mission in space, faint: without one, nothing tells near from far."""
        replay = self.replay
        if replay.planar:
            return
        low, high = self.extent
        step = replay.radius / 2 * max(1.0, np.ceil((high - low)[:2].max() / (30 * replay.radius)))
        first, last = np.floor(low[:2] / step) * step, np.ceil(high[:2] / step) * step
        for axis, name in enumerate("xy"):
            for place in np.arange(first[axis], last[axis] + step / 2, step):
                ends = np.array([[*first, self.ground], [*last, self.ground]])
                ends[:, axis] = place
                yield Mark("grid", "line", f"{name}{place:g}", ends, palette.OBSTACLE, 0.25, width=1.0)

    def shadows(self) -> Iterator[Mark]:
        """Soft discs below everything: what a vertical sun would cast, at no cost."""
        replay, moment = self.replay, self.moment
        bodies = [] if self.crowd else [*zip(moment.robots, replay.robot_radius, strict=True)]
        bodies += [*zip(moment.obstacles, replay.obstacle_radius, strict=True)]
        if replay.escorts:
            bodies.append((moment.target, 1.5 * float(replay.robot_radius.mean())))
        for number, (center, radius) in enumerate(bodies):
            height, pieces = self.ground + ON_FLOOR, 12 if radius < 0.1 * replay.radius else 24
            for size, alpha in ((1.25, 0.10), (1.0, 0.14)):
                about = (f"{number} {size}", center[None], palette.TARGET, alpha, size * radius)
                yield Mark("shadows", "disc", *about, height=height, pieces=pieces)

    def obstacles(self) -> Iterator[Mark]:
        """The safe circle of every obstacle; of a sphere its outline, as seen.

        What keeps robots off an obstacle of another shape is shown in the plane only.
        """
        replay, height, red = self.replay, self.on_floor(LINKED), palette.CONTACT
        for k, center in enumerate(self.moment.obstacles):
            safe, name = float(replay.safe_radius[k]), f"obstacle {k}"
            if safe <= 0.0:
                continue
            if replay.obstacle_radius[k] == 0.0:
                if replay.planar:
                    rim = center + replay.outlines[k] + safe * in_space(outward(2))
                    yield Mark("safe", "line", name, rim, red, 0.55, width=1.5, height=height)
            elif replay.planar:
                yield Mark(
                    "safe", "disc", f"{name} inside", center[None], red, 0.07, safe, height=height, pieces=36
                )
                yield Mark("safe", "circle", name, center[None], red, 0.55, safe, 1.5, height)
            else:
                yield Mark("safe", "outline", name, center[None], red, 0.45, safe, 1.0)

    def borders(self) -> Iterator[Mark]:
        """Lines that robots do not cross, with strokes on the other side; planes as grids."""
        replay, (low, high), red = self.replay, self.extent, palette.CONTACT
        step, flat = 0.25 * replay.radius, slice(2 if replay.planar else 3)
        for k, (point, normal) in enumerate(replay.borders):
            rim, m = cut(point[flat], normal[flat], low[flat], high[flat]), normal / np.linalg.norm(normal)
            if len(rim) < 2:
                continue
            if replay.planar:
                count = max(int(np.linalg.norm(rim[1] - rim[0]) / step), 1)
                along = in_space(np.linspace(rim[0], rim[1], count + 1))
                comb = np.stack([along, along - 0.5 * step * m, along], axis=1).reshape(-1, 3)
                yield Mark("safe", "line", f"border {k}", comb, red, 0.8, width=2.0, height=LINKED)
                continue
            yield Mark("safe", "line", f"border {k}", rim[[*range(len(rim)), 0]], red, 0.8, width=2.0)
            for number, line in enumerate(hatched(rim, 2.0 * step)):
                yield Mark("safe", "line", f"border {k} {number}", line, red, 0.25, width=1.0)

    def escort(self) -> Iterator[Mark]:
        """The circle or sphere that the robots are to keep around the target, and their goals."""
        replay, moment = self.replay, self.moment
        goals = () if self.crowd else replay.goals[moment.sample]
        for k, (place, color, size) in enumerate(zip(goals, self.colors, replay.robot_radius, strict=False)):
            about = (f"goal {k}", place[None], color)
            if replay.planar:
                yield Mark("escort", "circle", *about, 0.9, 1.3 * size, 2.0, LINKED, pieces=24)
            else:
                yield Mark("escort", "ball", *about, 0.2, 1.3 * size)
        rings = [(moment.target, radius, palette.LIMIT) for radius in replay.rings(moment)]
        teams = zip(replay.team_centers[moment.sample], replay.team_radius[moment.sample], strict=True)
        rings += [(place, float(size), palette.team_color(k)) for k, (place, size) in enumerate(teams)]
        for k, (place, radius, color) in enumerate(rings):
            ring = Mark(
                "escort", "circle", f"{k}", place[None], color, 0.8, radius, 2.0, dashed=True, pieces=96
            )
            if replay.planar:
                yield ring._replace(height=LINKED)
                continue
            yield Mark("escort", "ball", f"{k} within", place[None], VEIL, 0.1, radius)
            for normal in (2, 0, 1):
                yield ring._replace(name=f"{k} {normal}", alpha=0.45, width=1.0, normal=normal)

    def links(self, forward: Array | None) -> Iterator[Mark]:
        """Tethers, and who hears whom, without a radio who is whose neighbor.

        Of a crowd without tethers, those that are near; in space on this side of the target.
        """
        replay, target, robots = self.replay, self.moment.target, self.moment.robots
        for a, b in () if self.crowd else replay.tethers:
            ends = np.vstack([target, robots])[[a, b]]
            yield Mark("links", "line", f"tether {a} {b}", ends, palette.LIMIT, 0.9, width=2.5)
        pairs = replay.linked(self.moment.sample)
        if self.crowd:
            near = NEAR * widest_spacing(replay.count, 2 if replay.planar else 3, replay.radius)
            pairs = pairs[np.linalg.norm(np.diff(robots[pairs], axis=1)[:, 0], axis=1) < near]
            if not replay.planar and forward is not None:
                pairs = pairs[(robots[pairs].mean(axis=1) - target) @ forward < 0.0]
        color, alpha = (palette.RADIO, 0.5) if replay.communicates else (palette.LIMIT, 0.35)
        for i, j in pairs:
            yield Mark("links", "line", f"{i} {j}", robots[[i, j]], color, alpha, width=1.5)

    def knowledge(self) -> Iterator[Mark]:
        """A dashed line of sight from each robot that sees the target, and ghosts where robots believe it."""
        replay, moment, aims = self.replay, self.moment, self.replay.aims(self.moment)
        for k in map(int, np.flatnonzero(replay.seen[moment.sample] & ~self.lost[: replay.seen.shape[1]])):
            sight = np.stack([moment.robots[k], aims[k]])
            yield Mark("knowledge", "line", f"sight {k}", sight, self.colors[k], 0.9, width=2.0, dashed=True)
        for k, place in enumerate(replay.estimates[moment.sample]):
            if not self.lost[k]:
                about = (f"ghost {k}", place[None], self.colors[k])
                yield Mark("knowledge", "ball", *about, 0.3, replay.ghost_radius)

    def returns(self) -> Iterator[Mark]:
        """The end of each ray of a lidar that met something."""
        for k, (ends, robot) in enumerate(zip(*self.replay.returned(self.moment), strict=True)):
            yield Mark("returns", "line", f"{k}", ends, self.colors[robot], 0.9, width=2.5)

    def trails(self, duration: float) -> Iterator[Mark]:
        """Where everyone was lately; of a crowd the target and opponents only."""
        replay, moment = self.replay, self.moment
        height, pieces = self.on_floor(TRAILED), max(6, min(TRAIL_PIECES, MOST_TRAIL_PIECES // replay.count))

        def past(values: Array, present: Array, pieces: int) -> Array:
            before = replay.past(values, moment, duration, pieces) if duration else values[:0]
            return np.concatenate([before, present[None]])

        if replay.escorts:
            way = past(replay.target, moment.target, TRAIL_PIECES)
            yield Mark("trails", "trail", "target", way, palette.TARGET, width=2.0, height=height)
        if replay.opponents:
            last = slice(-replay.opponents, None)
            ways = past(replay.obstacles[:, last], moment.obstacles[last], pieces)
            for k, way in enumerate(ways.swapaxes(0, 1)):
                about = (f"opponent {k}", way, palette.OPPONENT)
                yield Mark("trails", "trail", *about, width=3.5, height=height)
        if self.crowd:
            return
        for k, way in enumerate(past(replay.robots, moment.robots, pieces).swapaxes(0, 1)):
            color = LOST if self.lost[k] else self.colors[k]
            yield Mark("trails", "trail", f"robot {k}", way, color, width=3.5, height=height)

    def velocities(self) -> Iterator[Mark]:
        """Velocities that the tasks ask for, in the color of the task that rules the robot."""
        replay, sample = self.replay, self.moment.sample
        tasks = [palette.BEHAVIORS.get(name, palette.OBSTACLE) for name in replay.behaviors]
        for k, (start, asked) in enumerate(zip(self.moment.robots, replay.wish[sample], strict=True)):
            ruling = int(replay.ruling[sample, k])
            color = tasks[ruling] if ruling >= 0 else palette.OBSTACLE
            yield Mark("velocities", "arrow", f"{k}", np.stack([start, start + AHEAD * asked + LEAST]), color)

    def numbers(self) -> Iterator[Mark]:
        """The number of each robot, above it."""
        above = self.moment.robots + 1.2 * self.replay.robot_radius[:, None] * np.array([0.0, 0.0, 1.0])
        for k, place in enumerate(above):
            yield Mark("numbers", "text", f"{k}", place[None], palette.TARGET, text=str(k + 1))

    def contacts(self, avoiding: Flags, touching: Flags) -> Iterator[Mark]:
        """Halos of robots that avoid something in their colors, of those that touch something in red."""
        for k in map(int, np.flatnonzero(avoiding | touching)):
            place, radius = self.moment.robots[k][None], float(self.replay.robot_radius[k])
            color = palette.CONTACT if touching[k] else self.colors[k]
            yield Mark("contacts", "ball", f"{k}", place, color, 0.35, 2.2 * radius)
            if self.replay.planar:
                about = (f"{k} around", place, color, 0.9, 2.6 * radius, 2.5, RINGED)
                yield Mark("contacts", "circle", *about, pieces=40)
