"""A run as the replay inside a page reads it: bodies, and where they were, as numbers of two bytes."""

from __future__ import annotations

import base64
import math
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.palette import LOST
from escort_mj.record.episodes import apart_from
from escort_mj.record.folder import MODEL, StoredRun
from escort_mj.report.video.replay import Replay, replay_of
from escort_mj.report.video.shots import plan_shot
from escort_mj.report.video.solids import floor_of, load_model, places, pose, solids_of
from escort_mj.scenario.geometry.shapes import in_space, outward

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

MOST_NUMBERS = 600_000  # coordinates of all moments together: two bytes each, a third more as text
FEWEST, MOST = 60, 1500  # moments
FIELD_OF_VIEW, ASPECT = 45.0, 16 / 9
STEPS = 65535
AVOIDING, TOUCHING, GONE = 1, 2, 4
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
        RenderError: If the model does not fit the trace.
    """
    replay, trace = replay_of(run.trace), run.trace
    model = load_model(run.path / MODEL, replay.qpos.shape[1])
    data = mujoco.MjData(model)
    solids = solids_of(model)
    rows = _moments(replay, len(solids.geoms))
    positions = np.empty((len(rows), len(solids.geoms), 3))
    turns = np.empty((len(rows), len(solids.geoms), 4))
    for moment, row in enumerate(rows):
        pose(model, data, replay.qpos[row], replay.target[row])
        positions[moment], turns[moment] = places(model, data, solids.geoms)
    tracks = _Tracks(replay, rows)
    crowd = replay.count > palette.MOST_LINES
    floor = floor_of(model)
    lowest = float(replay.target[:, 2].min() - 1.4 * replay.radius)
    view = plan_shot(replay, "overview", FIELD_OF_VIEW, ASPECT, 2.0).view(float(replay.time[0]))
    flags = AVOIDING * replay.avoiding + TOUCHING * replay.touching + GONE * replay.lost
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
        "obstacles": [tracks.number(way) for way in replay.obstacles[rows].swapaxes(0, 1)],
        "obstacle_radius": replay.obstacle_radius.tolist(),
        "safe_radius": replay.safe_radius.tolist(),
        "rims": _rims(replay),
        "flags": packed(_raised(flags, rows), "<u1"),
        "count": replay.count,
        "colors": replay.colors(0),
        "lost_color": LOST,
        "contact_color": palette.CONTACT,
        "target_color": palette.TARGET,
        "robot_radius": replay.robot_radius.tolist(),
        "target_radius": replay.target_radius,
        "radius": replay.radius,
        "links": [] if crowd else _links(replay, rows),
        "planar": replay.planar,
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
        every = np.concatenate(
            [replay.robots[rows].reshape(-1, 3), replay.target[rows], replay.obstacles[rows].reshape(-1, 3)]
        )
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


def _raised(flags: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Flags at the moments, with all that were raised since the moment before."""
    starts = np.concatenate([[0], rows[:-1] + 1])
    return np.bitwise_or.reduceat(flags, starts, axis=0)


def _links(replay: Replay, rows: NDArray[np.int64]) -> list[list[Any]]:
    """From which moment on who is whose neighbor."""
    return [[int(np.searchsorted(rows, start)), pairs.tolist()] for start, pairs in replay.formations]


def _rims(replay: Replay) -> list[list[list[float]]]:
    """Outlines of what keeps robots off obstacles that are no circles, relative to their centers [m]."""
    if not replay.planar or not replay.outlines.shape[1]:
        return []
    rims = replay.outlines + replay.safe_radius[:, None, None] * in_space(outward(2))
    return [np.round(rim, 4).tolist() for rim in rims]


def _contacts(trace: xarray.Dataset) -> list[float]:
    """Times at which episodes begin [s], for marks on the slider: of touches that are not the floor's."""
    return np.unique(trace["episode_start"].values[apart_from(trace, "floor")].round(3))[:500].tolist()
