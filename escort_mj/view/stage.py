"""What is seen in the browser: bodies, and marks of what robots do, as nodes of viser's scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.palette import LOST
from escort_mj.record.recording import Recorded
from escort_mj.report.video.pen import circle
from escort_mj.report.video.replay import Moment, Replay
from escort_mj.report.video.solids import Mesh, floor_of, places, pose, solids_of
from escort_mj.scenario.geometry.shapes import in_space, outward

if TYPE_CHECKING:
    import viser


Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

TRAIL_PIECES = 150
PIECES = 64  # of a circle
GLOW = 0.3  # how long a short event stays visible [s]
HIDDEN = 1e-6  # scale of what is not to be seen
AHEAD = 3.0  # an arrow ends where its velocity leads to in this time [s]
_X, _Y, _Z = np.eye(3)
LAYERS = {
    "trails": "trails",
    "velocities": "task velocities",
    "safe": "safe distances",
    "contacts": "avoidance and contacts",
    "links": "neighbors, or who hears whom",
    "knowledge": "estimates, lines of sight and returns of lidars",
    "escort": "escort radius",
    "numbers": "numbers",
}
"""What can be switched on and off, and what it is called."""


class StageView:
    """Draws one moment after another.

    Attributes:
        shown: Which layers are to be seen.
    """

    def __init__(
        self, server: viser.ViserServer, model: mujoco.MjModel, part: Recorded, replay: Replay
    ) -> None:
        """Adds everything that there is to see.

        Args:
            server: Viser's.
            model: The world.
            part: Any samples of the run.
            replay: The same.
        """
        self._scene, self._model, self._data = server.scene, model, mujoco.MjData(model)
        self._solids = solids_of(model)
        self._colors = np.array(replay.colors(0))
        self._behaviors = np.array(
            [palette.BEHAVIORS.get(str(name), palette.OBSTACLE) for name in part["behavior"].values]
        ).reshape(-1, 3)
        self._crowd = replay.count > palette.MOST_LINES
        self._handles: dict[str, list[Any]] = {layer: [] for layer in LAYERS}
        few = replay.count <= palette.MOST_DISTINCT
        self.shown = dict.fromkeys(LAYERS, True) | {"numbers": few, "velocities": not self._crowd}
        self._lost: Flags = np.zeros(replay.count, dtype=bool)
        server.scene.set_up_direction("+z")
        server.scene.configure_environment_map("warehouse", environment_intensity=0.5)
        self._floor(replay)
        self._add_bodies()
        self._add_marks(replay)
        self.show()

    def show(self) -> None:
        """Hides and shows layers as `shown` has it."""
        for layer, handles in self._handles.items():
            for handle in handles:
                handle.visible = self.shown[layer]

    def draw(self, part: Recorded, replay: Replay, now: float) -> Moment:
        """Show the moment of a time.

        Args:
            part: Samples of a while before that time, and the one after it.
            replay: The same.
            now: [s].
        """
        moment = replay.at(now)
        pose(self._model, self._data, moment.qpos, moment.target)
        where, turn = places(self._model, self._data, self._solids.geoms)
        for chosen, handle in self._bodies:
            handle.batched_positions = where[chosen].astype(np.float32)
            handle.batched_wxyzs = turn[chosen].astype(np.float32)
        lost = replay.lost[moment.sample]
        if (lost != self._lost).any():
            self._lost = lost.copy()
            for chosen, handle in self._bodies:
                handle.batched_colors = self._body_colors(chosen)
        if self.shown["trails"]:
            self._draw_trails(replay, moment)
        if self.shown["velocities"]:
            self._draw_velocities(part, moment)
        self._draw_events(replay, moment)
        for handle in self._ring:
            if (rings := replay.rings(moment)) != self._rings:
                handle.points = np.concatenate([radius * self._dashes for radius in rings]).astype(np.float32)
                self._rings[:] = rings
            handle.position = moment.target if not replay.planar else moment.target * (1, 1, 0) + 0.012 * _Z
        above = moment.robots + 1.2 * replay.robot_radius[:, None] * _Z
        for handles, centers in ((self._safe, moment.obstacles), (self._labels, above)):
            for handle, center in zip(handles, centers, strict=False):
                handle.position = center
        return moment

    def _floor(self, replay: Replay) -> None:
        floor = floor_of(self._model)
        place, turn = floor or (
            np.array([0.0, 0.0, float(replay.target[0, 2]) - 1.4 * replay.radius]),
            _QUIET,
        )
        cell = replay.radius / 2
        self._scene.add_grid(
            "/floor",
            infinite_grid=True,
            cell_size=cell,
            section_size=4 * cell,
            cell_color=(222, 226, 231),
            section_color=(190, 196, 204),
            fade_distance=40 * replay.radius,
            shadow_opacity=0.15,
            position=place,
            wxyz=turn,
        )

    def _add_bodies(self) -> None:
        """One node for all bodies of a shape; those that are see-through have nodes of their own."""
        clear = self._solids.color[:, 3] < 1.0
        self._bodies: list[tuple[Flags, Any]] = []
        for index, mesh in enumerate(self._solids.meshes):
            for seethrough in (False, True):
                chosen = (self._solids.mesh == index) & (clear == seethrough)
                if not (count := int(chosen.sum())):
                    continue
                opacities = self._solids.color[chosen, 3].astype(np.float32)
                handle = self._scene.add_batched_meshes_simple(
                    f"/bodies/{index}{'_clear' * seethrough}",
                    mesh.vertices,
                    mesh.faces,
                    batched_wxyzs=np.tile(np.array(_QUIET), (count, 1)),
                    batched_positions=np.zeros((count, 3)),
                    batched_scales=self._solids.scale[chosen].astype(np.float32),
                    batched_colors=self._body_colors(chosen),
                    batched_opacities=opacities if seethrough else None,
                    lod="off",
                )
                self._bodies.append((chosen, handle))

    def _body_colors(self, chosen: Flags) -> NDArray[np.uint8]:
        colors = self._solids.color[chosen, :3].copy()
        owner = self._solids.robot[chosen]
        colors[(owner >= 0) & self._lost[owner]] = LOST
        return linear(colors)

    def _add_marks(self, replay: Replay) -> None:
        """Everything that is no body, empty as yet."""
        scene, handles, nothing = self._scene, self._handles, np.zeros((1, 2, 3))
        red, gray = _bytes(palette.CONTACT), _bytes(palette.LIMIT)
        line: dict[str, Any] = {"thickness_units": "screen"}
        self._trails = scene.add_line_segments("/trails", nothing, np.zeros((1, 2, 3)), thickness=3.0, **line)
        handles["trails"].append(self._trails)
        size = float(replay.robot_radius.min())
        self._arrows = scene.add_arrows(
            "/velocities",
            nothing,
            gray,
            shaft_radius=0.12 * size,
            head_radius=0.35 * size,
            head_length=0.8 * size,
        )
        handles["velocities"].append(self._arrows)
        heard = _bytes(palette.RADIO) if replay.communicates else gray
        self._links = scene.add_line_segments("/links", nothing, heard, thickness=1.5, **line)
        handles["links"].append(self._links)
        ring = circle(np.zeros(3), 1.0, PIECES, _X, _Y)
        rings = [ring] if replay.planar else [ring, ring[:, [0, 2, 1]], ring[:, [2, 0, 1]]]
        self._dashes = np.concatenate([np.stack([one[:-1:2], one[1::2]], axis=1) for one in rings])
        self._ring: list[Any] = []
        self._rings: list[float] = []
        if replay.escorts:
            self._ring.append(scene.add_line_segments("/escort", nothing, gray, thickness=2.0, **line))
        handles["escort"] += self._ring
        self._safe: list[Any] = []
        for k, (radius, safe) in enumerate(zip(replay.obstacle_radius, replay.safe_radius, strict=True)):
            handle = self._safe_mark(f"/safe/{k}", replay, k, float(radius), float(safe), red)
            self._safe.append(handle)
            handles["safe"].append(handle)
        self._halos = self._balls("/contacts", 0.35)
        handles["contacts"].append(self._halos)
        self._ghosts = self._balls("/estimates", 0.4)
        self._sight = scene.add_line_segments("/sight", nothing, np.zeros((1, 2, 3)), thickness=2.0, **line)
        self._returns = scene.add_line_segments("/lidar", nothing, np.zeros((1, 2, 3)), thickness=2.5, **line)
        handles["knowledge"] += [self._ghosts, self._sight, self._returns]
        self._labels = [
            scene.add_label(f"/numbers/{k + 1}", str(k + 1), anchor="bottom-center", font_screen_scale=0.8)
            for k in range(0 if self._crowd else replay.count)
        ]
        handles["numbers"] += self._labels

    def _balls(self, name: str, opacity: float) -> Any:
        """A ball in each robot's color, hidden as yet."""
        ball, count = _ball(self._solids.meshes), len(self._colors)
        return self._scene.add_batched_meshes_simple(
            name,
            ball.vertices,
            ball.faces,
            batched_wxyzs=np.tile(np.array(_QUIET), (count, 1)),
            batched_positions=np.zeros((count, 3)),
            batched_scales=np.full(count, HIDDEN),
            batched_colors=linear(self._colors),
            opacity=opacity,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _safe_mark(
        self, name: str, replay: Replay, k: int, radius: float, safe: float, red: tuple[int, int, int]
    ) -> Any:
        """What keeps robots off an obstacle: a sphere; in the plane its outline on the floor."""
        lift = np.array([0.0, 0.0, 0.01 - float(replay.obstacles[0, k, 2])])
        if not replay.planar and radius > 0.0 and safe > 0.0:
            return self._scene.add_icosphere(
                name, safe, color=red, opacity=0.12, cast_shadow=False, receive_shadow=False
            )
        rim = np.zeros((2, 3))
        if replay.planar and safe > 0.0:
            rim = circle(np.zeros(3), safe, PIECES, _X, _Y)
            if radius == 0.0:
                rim = replay.outlines[k] + safe * in_space(outward(2))
            rim = rim * (1, 1, 0) + lift
        pairs = np.stack([rim[:-1], rim[1:]], axis=1)
        return self._scene.add_line_segments(name, pairs, red, thickness=2.0, thickness_units="screen")

    def _draw_trails(self, replay: Replay, moment: Moment) -> None:
        """Where everyone was lately, fading toward white; of a crowd the target only."""
        rows = slice(0, moment.sample + 1)
        ways = [(replay.target[rows], moment.target, palette.TARGET)] if replay.escorts else []
        if not self._crowd:
            colors = np.where(self._lost[:, None], LOST, self._colors)
            ways += [
                (replay.robots[rows, k], moment.robots[k], tuple(color)) for k, color in enumerate(colors)
            ]
        points, inks = [], []
        for past, present, color in ways:
            way = np.concatenate([past[:: -(-len(past) // TRAIL_PIECES)], present[None]])
            faded = np.linspace(0.1, 1.0, len(way))[:, None]
            ink = 1.0 - faded * (1.0 - np.array(color))
            points.append(np.stack([way[:-1], way[1:]], axis=1))
            inks.append(np.stack([ink[:-1], ink[1:]], axis=1))
        self._trails.points = np.concatenate(points).astype(np.float32)
        self._trails.colors = linear(np.concatenate(inks))

    def _draw_velocities(self, part: Recorded, moment: Moment) -> None:
        """Velocities that the tasks ask for, in the color of the task that rules the robot."""
        asked = in_space(part["v_d"].values[moment.sample][:, :3])
        ruling = part["ruling"].values[moment.sample].astype(int)
        colors = np.where(
            (ruling >= 0)[:, None], self._behaviors[np.maximum(ruling, 0)], np.array(palette.OBSTACLE)
        )
        self._arrows.points = np.stack(
            [moment.robots, moment.robots + AHEAD * asked + HIDDEN * _X], axis=1
        ).astype(np.float32)
        self._arrows.colors = linear(colors)

    def _draw_events(self, replay: Replay, moment: Moment) -> None:
        """Links, what robots know, and halos of robots that avoid (their color) or touch (red) something."""
        if not self._crowd and self.shown["links"]:
            self._links.points = _segments(moment.robots[replay.linked(moment.sample)]).astype(np.float32)
        if replay.seen.size and not self._crowd and self.shown["knowledge"]:
            self._draw_knowledge(replay, moment)
        if replay.returns.size and not self._crowd and self.shown["knowledge"]:
            ends, whose = replay.returned(moment)
            self._returns.points = _segments(ends).astype(np.float32)
            self._returns.colors = linear(_segments(np.repeat(self._colors[whose, None], 2, axis=1)))
        touching, avoiding = (replay.lately(one, moment, GLOW) for one in (replay.touching, replay.avoiding))
        halo = touching | avoiding
        self._halos.batched_positions = moment.robots.astype(np.float32)
        self._halos.batched_scales = np.where(halo, 2.2 * replay.robot_radius, HIDDEN).astype(np.float32)
        colors = np.where(touching[:, None], np.array(palette.CONTACT), self._colors)
        self._halos.batched_colors = linear(colors)

    def _draw_knowledge(self, replay: Replay, moment: Moment) -> None:
        """Lines of sight to the target, and its ghosts where robots believe it to be; of a crowd none."""
        left = ~self._lost
        sees = replay.seen[moment.sample] & left
        ends = np.stack([moment.robots, replay.aims(moment)], axis=1)[sees]
        self._sight.points = _segments(ends).astype(np.float32)
        self._sight.colors = linear(_segments(np.repeat(self._colors[sees, None], 2, axis=1)))
        self._ghosts.batched_positions = replay.estimates[moment.sample].astype(np.float32)
        self._ghosts.batched_scales = np.where(left, replay.ghost_radius, HIDDEN).astype(np.float32)


_QUIET = (1.0, 0.0, 0.0, 0.0)


def _segments(ends: Array) -> Array:
    """Lines or their colors as viser's nodes want them, shape (k, 2, 3): at least one, of no length."""
    return ends if len(ends) else np.zeros((1, 2, 3))


def _ball(meshes: list[Mesh]) -> Mesh:
    """A ball among the shapes: every mission has robots or a target that are round."""
    return next(mesh for mesh in meshes if np.allclose(np.linalg.norm(mesh.vertices, axis=1), 1.0))


def linear(colors: Array) -> NDArray[np.uint8]:
    """Colors as viser's arrays want them, in linear light; single colors it converts itself."""
    light = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.round(255 * light), dtype=np.uint8)


def _bytes(color: palette.Color) -> tuple[int, int, int]:
    red, green, blue = (round(255 * channel) for channel in color)
    return red, green, blue
