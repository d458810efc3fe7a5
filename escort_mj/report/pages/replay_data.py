"""A run as the replay inside a page reads it: bodies, and where they were, as numbers of two bytes."""

from __future__ import annotations

import base64
import math
from collections import defaultdict
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.palette import LOST
from escort_mj.record.episodes import apart_from
from escort_mj.record.folder import MODEL, StoredRun
from escort_mj.report.video.camera import plan_shot
from escort_mj.report.video.marks import LAYERS, Mark, marks
from escort_mj.report.video.replay import Replay, replay_of
from escort_mj.report.video.solids import floor_of, load_model, places, pose, solids_of

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

MOST_NUMBERS = 600_000  # coordinates of all moments together: two bytes each, a third more as text
FEWEST, MOST = 60, 1500  # moments
FIELD_OF_VIEW, ASPECT = 45.0, 16 / 9
STEPS = 65535
LEFT_OUT = {"grid", "velocities", "numbers", "returns"}
BEYOND = 30.0  # radii of the mission around it; what drifts farther away is shown at this rim


def packed(values: NDArray[Any], kind: str) -> str:
    """Numbers as text: little-endian, base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()


def replay_data(run: StoredRun, speed: float) -> dict[str, Any]:
    """What `replay.js` draws.

    Args:
        run: A run folder with at least one sample.
        speed: Simulated seconds per second at which it begins to play.

    Returns:
        What JSON can hold. Places are tracks over `time`, by number, or still points, by -1 - number.

    Raises:
        RunFolderError: If the model is damaged or does not fit the trace.
    """
    replay, trace = replay_of(run.trace), run.trace
    model = load_model(run.path / MODEL, replay.qpos.shape[1])
    data = mujoco.MjData(model)
    solids = solids_of(model)
    rows = _moments(replay, len(solids.geoms) + replay.estimates.shape[1])
    positions = np.empty((len(rows), len(solids.geoms), 3))
    turns = np.empty((len(rows), len(solids.geoms), 4))
    for moment, row in enumerate(rows):
        pose(model, data, replay.qpos[row], replay.target[row])
        positions[moment], turns[moment] = places(model, data, solids.geoms)
    tracks = _Tracks(replay, rows)
    drawn = [*_marks(replay, rows, tracks)]
    crowd = replay.count > palette.MOST_LINES
    floor = floor_of(model)
    lowest = float(replay.target[:, 2].min() - 1.4 * replay.radius)
    view = plan_shot(replay, "overview", FIELD_OF_VIEW, ASPECT, 2.0).view(float(replay.time[0]))
    return {
        "time": packed(replay.time[rows], "<f4"),
        "meshes": [
            {"vertices": packed(mesh.vertices, "<f4"), "faces": packed(mesh.faces, "<u2")}
            for mesh in solids.meshes
        ],
        "solids": {
            "mesh": solids.mesh.tolist(),
            "scale": np.round(solids.scale, 6).tolist(),
            "color": np.round(solids.color, 4).tolist(),
            "robot": solids.robot.tolist(),
            "place": [tracks.number(way) for way in positions.swapaxes(0, 1)],
            "turn": [_turning(way) for way in turns.swapaxes(0, 1)],
        },
        "robots": [] if crowd else [tracks.number(way) for way in replay.robots[rows].swapaxes(0, 1)],
        "target": tracks.number(replay.target[rows]),
        "marks": drawn,
        "layers": {layer: LAYERS[layer] for layer in LAYERS if any(one["layer"] == layer for one in drawn)},
        "lost": packed(replay.lost[rows], "<u1"),
        "count": replay.count,
        "colors": replay.colors(0),
        "lost_color": LOST,
        "robot_radius": replay.robot_radius.tolist(),
        "target_radius": replay.target_radius,
        "radius": replay.radius,
        "floor": [*floor[0], *floor[1]] if floor else [*view.look_at[:2], lowest, 1.0, 0.0, 0.0, 0.0],
        "camera": [*view.look_at, view.distance, math.radians(view.azimuth), math.radians(view.elevation)],
        "field_of_view": math.radians(FIELD_OF_VIEW),
        "speed": speed,
        "tracks": tracks.packed(),
        "still": tracks.still,
        "low": tracks.low.tolist(),
        "high": tracks.high.tolist(),
        "contacts": _contacts(trace),
    }


class _Tracks:
    """Points over time, each once, as numbers of two bytes between two corners."""

    def __init__(self, replay: Replay, rows: NDArray[np.int64]) -> None:
        reach = BEYOND * replay.radius
        self._ways = np.concatenate(
            [replay.robots, replay.target[:, None], replay.obstacles, replay.team_centers], axis=1
        )[rows]
        every = self._ways.reshape(-1, 3)
        margin = replay.radius + replay.robot_radius.max()
        self.low = np.maximum(every.min(axis=0), replay.target.min(axis=0) - reach) - margin
        self.high = np.minimum(every.max(axis=0), replay.target.max(axis=0) + reach) + margin
        self.still: list[list[float]] = []
        self._found: dict[bytes, tuple[int, NDArray[np.uint16]]] = {}

    def number(self, way: Array) -> int:
        """Where a way, shape (moments, 3) [m], is to be found: a track, or a still point."""
        if np.ptp(way, axis=0).max() < 1e-6:
            self.still.append(np.round(way[0], 5).tolist())
            return -len(self.still)
        share = np.clip((way - self.low) / (self.high - self.low), 0.0, 1.0)
        steps = np.round(STEPS * share).astype(np.uint16)
        return self._found.setdefault(steps.tobytes(), (len(self._found), steps))[0]

    def number_of_part(self, way: Array, when: NDArray[np.int64]) -> int:
        """The same of a way that is known at some moments only, shape (k, 3): a body's, if one was there."""
        for body in np.flatnonzero((self._ways[when[0]] == way[0]).all(axis=1)):
            if np.array_equal(self._ways[when, body], way):
                return self.number(self._ways[:, body])
        known = np.clip(np.searchsorted(when, np.arange(len(self._ways)), side="right") - 1, 0, None)
        return self.number(way[known])

    def packed(self) -> str:
        """All tracks, one after another, each as (moments, 3)."""
        tracks = [steps for _, steps in self._found.values()]
        return packed(np.stack(tracks) if tracks else np.zeros(0), "<u2")


def _moments(replay: Replay, bodies: int) -> NDArray[np.int64]:
    """Samples that the page gets: evenly spaced, the first and the last among them."""
    most = int(np.clip(MOST_NUMBERS // (3 * (bodies + replay.count)), FEWEST, MOST))
    count = min(len(replay.time), most)
    return np.unique(np.linspace(0, len(replay.time) - 1, count).round().astype(np.int64))


def _turning(way: Array) -> str | list[float]:
    """Orientations over the moments; one where it never changes."""
    if np.ptp(way, axis=0).max() < 1e-6:
        return np.round(way[0], 6).tolist()
    flipped = np.einsum("ij,ij->i", way[1:], way[:-1]) < 0.0  # q and -q are the same turn
    sign = np.cumprod(np.where(flipped, -1.0, 1.0))
    return packed(np.round(32767 * way * np.concatenate([[1.0], sign])[:, None]), "<i2")


def _marks(replay: Replay, rows: NDArray[np.int64], tracks: _Tracks) -> Iterator[dict[str, Any]]:
    """Each mark once: where its points are, when it is shown, and from which moments on how it looks.

    What cannot be told so briefly is left out: velocities, returns of lidars and links of crowds. The replay
    draws numbers and the grid by itself.
    """
    starts = np.concatenate([[0], rows[:-1] + 1])  # of what was raised since the moment before
    avoiding, touching = (
        np.logical_or.reduceat(one, starts, axis=0) for one in (replay.avoiding, replay.touching)
    )
    left_out = LEFT_OUT | ({"links"} if replay.count > palette.MOST_LINES else set())
    found: dict[tuple[str, str], dict[int, Mark]] = defaultdict(dict)
    for number, row in enumerate(rows):
        moment = replay.at(float(replay.time[row]))
        raised = avoiding[number], touching[number]
        for mark in marks(replay, moment, trail=0.0, flags=raised, left_out=left_out):
            found[mark.layer, mark.name][number] = mark
    for (layer, _), its in found.items():
        mark, when = next(iter(its.values())), np.array([*its])
        ways = np.stack([one.points for one in its.values()], axis=1)
        rigid = bool(np.ptp(ways - ways[0], axis=1).max() < 1e-6)
        looks: list[tuple[int, list[float]]] = []
        for number, one in its.items():
            look = [*np.round(one.color, 4).tolist(), one.alpha, float(one.radius)]
            if not looks or looks[-1][1] != look:
                looks.append((number, look))
        shown = np.isin(np.arange(len(rows)), when)
        yield {
            **{"layer": layer, "kind": mark.kind, "width": mark.width, "height": mark.height},
            **{"dashed": mark.dashed, "normal": mark.normal, "looks": looks},
            "shown": "" if shown.all() else packed(shown, "<u1"),
            "points": [tracks.number_of_part(way, when) for way in (ways[:1] if rigid else ways)],
            "rim": np.round(ways[:, 0] - ways[0, 0], 5).tolist() if rigid and len(ways) > 1 else [],
        }


def _contacts(trace: xarray.Dataset) -> list[float]:
    """Times at which episodes begin [s], for marks on the slider: of touches that are not the floor's."""
    return np.unique(trace["episode_start"].values[apart_from(trace, "floor")].round(3))[:500].tolist()
