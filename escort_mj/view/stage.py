"""What is seen in the browser: bodies, and marks of what robots do, as nodes of viser's scene."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.palette import LOST
from escort_mj.report.video.marks import LAYERS, Mark, marks
from escort_mj.report.video.replay import Moment, Replay
from escort_mj.report.video.scene import lines_of
from escort_mj.report.video.solids import Mesh, floor_of, places, pose, solids_of

if TYPE_CHECKING:
    import viser


Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

GLOW = 0.3  # how long a short event stays visible [s]
VEIL = 0.12  # opacity of the sphere that keeps robots off an obstacle
HIDDEN = 1e-6  # radius of what is not to be seen [m]
QUIET = (1.0, 0.0, 0.0, 0.0)


class StageView:
    """Draws one moment after another.

    Attributes:
        shown: Which layers are to be seen.
    """

    def __init__(self, server: viser.ViserServer, model: mujoco.MjModel, replay: Replay) -> None:
        """Adds everything that there is to see.

        Args:
            server: Viser's.
            model: The world.
            replay: Any samples of the run.
        """
        self._scene, self._model, self._data = server.scene, model, mujoco.MjData(model)
        self._solids = solids_of(model)
        self._ball = _ball(self._solids.meshes)
        self._nodes: dict[tuple[str, ...], Any] = {}
        self._drawn: dict[tuple[str, ...], tuple[NDArray[Any], ...]] = {}
        self._arrow = float(replay.robot_radius.min())
        few, crowd = replay.count <= palette.MOST_DISTINCT, replay.count > palette.MOST_LINES
        self.shown = dict.fromkeys(LAYERS, True) | {"numbers": few, "velocities": not crowd}
        self._lost: Flags = np.zeros(replay.count, dtype=bool)
        server.scene.set_up_direction("+z")
        server.scene.configure_environment_map("warehouse", environment_intensity=0.5)
        self._floor(replay)
        self._add_bodies()

    def draw(self, replay: Replay, now: float) -> Moment:
        """Show the moment of a time.

        Args:
            replay: Samples of a while before that time, and the one after it.
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
        hidden = {"shadows", "grid", *(layer for layer, shown in self.shown.items() if not shown)}
        self._draw_marks(marks(replay, moment, flags=replay.lately(moment, GLOW), left_out=hidden))
        return moment

    def _floor(self, replay: Replay) -> None:
        floor = floor_of(self._model)
        place, turn = floor or (
            np.array([0.0, 0.0, float(replay.target[0, 2]) - 1.4 * replay.radius]),
            QUIET,
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
                    batched_wxyzs=np.tile(np.array(QUIET), (count, 1)),
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

    def _draw_marks(self, given: Iterable[Mark]) -> None:
        """Show marks: all lines of a width in a layer are one node, and so are all balls, and all arrows."""
        nodes: dict[tuple[str, ...], list[Mark]] = defaultdict(list)
        for mark in given:
            if mark.kind in ("line", "trail", "circle"):
                nodes[mark.layer, "lines", f"{mark.width:g}"].append(mark)
            elif mark.kind in ("ball", "outline"):
                nodes[mark.layer, "balls"].append(mark)
            elif mark.kind == "arrow":
                nodes[mark.layer, "arrows"].append(mark)
            elif mark.kind == "text":
                nodes[mark.layer, "text", mark.name].append(mark)
        for name, node in self._nodes.items():
            node.visible = name in nodes
        for name, its in nodes.items():
            if name[1] == "text":
                self._write(name, its[0])
            elif name[1] == "balls":
                self._draw_balls(name, its)
            else:
                self._draw_lines(name, its)

    def _write(self, name: tuple[str, ...], mark: Mark) -> None:
        if name not in self._nodes:
            self._nodes[name] = self._scene.add_label(
                f"/{'/'.join(name)}", mark.text, anchor="bottom-center", font_screen_scale=0.8
            )
        self._nodes[name].position = mark.placed[0]

    def _draw_lines(self, name: tuple[str, ...], given: list[Mark]) -> None:
        """Lines or arrows."""
        pieces, inks = zip(*map(lines_of, given), strict=True)
        points, colors = np.concatenate(pieces).astype(np.float32), linear(np.concatenate(inks))
        if name[1] == "arrows":
            colors = colors[:, 0]  # one each
        if self._is_drawn(name, points, colors):
            return
        if name in self._nodes:
            self._nodes[name].points, self._nodes[name].colors = points, colors
        elif name[1] == "arrows":
            shaft, head, length = self._arrow * np.array([0.12, 0.35, 0.8])
            self._nodes[name] = self._scene.add_arrows(
                f"/{'/'.join(name)}", points, colors, shaft_radius=shaft, head_radius=head, head_length=length
            )
        else:
            self._nodes[name] = self._scene.add_line_segments(
                f"/{'/'.join(name)}", points, colors, thickness=float(name[2]), thickness_units="screen"
            )

    def _draw_balls(self, name: tuple[str, ...], given: list[Mark]) -> None:
        """Balls; a node has room for as many as there were, and those left over are too small to see."""
        spare = max(0, len(self._drawn.get(name, [()])[0]) - len(given))
        centers = np.concatenate([mark.placed for mark in given] + [np.zeros((spare, 3))]).astype(np.float32)
        sizes = np.array([mark.radius for mark in given] + [HIDDEN] * spare, dtype=np.float32)
        colors = linear(np.array([mark.color for mark in given] + [(1.0, 1.0, 1.0)] * spare))
        alphas = [VEIL if mark.kind == "outline" else mark.alpha for mark in given]
        opacities = np.array(alphas + [1.0] * spare, dtype=np.float32)
        if self._is_drawn(name, centers, sizes, colors, opacities):
            return
        if name in self._nodes and len(self._nodes[name].batched_positions) == len(centers):
            node = self._nodes[name]
            node.batched_positions, node.batched_scales = centers, sizes
            node.batched_colors, node.batched_opacities = colors, opacities
            return
        self._nodes[name] = self._scene.add_batched_meshes_simple(
            f"/{'/'.join(name)}",
            self._ball.vertices,
            self._ball.faces,
            batched_wxyzs=np.tile(np.array(QUIET), (len(centers), 1)),
            batched_positions=centers,
            batched_scales=sizes,
            batched_colors=colors,
            batched_opacities=opacities,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _is_drawn(self, name: tuple[str, ...], *arrays: NDArray[Any]) -> bool:
        """Whether a node shows these already."""
        before = self._drawn.get(name, ())
        self._drawn[name] = arrays
        return len(before) == len(arrays) and all(map(np.array_equal, before, arrays))


def _ball(meshes: list[Mesh]) -> Mesh:
    """A ball among the shapes: every mission has robots or a target that are round."""
    return next(mesh for mesh in meshes if np.allclose(np.linalg.norm(mesh.vertices, axis=1), 1.0))


def linear(colors: Array) -> NDArray[np.uint8]:
    """Colors as viser's arrays want them, in linear light; single colors it converts itself."""
    light = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.round(255 * light), dtype=np.uint8)
