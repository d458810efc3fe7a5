"""A run as MCAP, with Foxglove's messages: bodies, what robots do, contacts and verdicts over time.

Bodies are told once, each in a frame of its own; then only frames move. Messages are JSON, so that the file
needs no library but `mcap`, and their schemas bear the names by which Foxglove knows them:
https://docs.foxglove.dev/docs/visualization/message-schemas/introduction
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from escort_mj import palette
from escort_mj.errors import UsageError
from escort_mj.expect.verdicts import Verdict, mark
from escort_mj.record.episodes import apart_from, pair
from escort_mj.record.files import replaced
from escort_mj.record.folder import MODEL, SCENARIO, StoredRun
from escort_mj.report.video.pen import circle
from escort_mj.report.video.replay import Replay, replay_of
from escort_mj.report.video.solids import Solids, load_model, places, pose, solids_of

Array = NDArray[np.float64]
Message = dict[str, Any]

WORLD = "world"
RATE = 30.0  # moments of the bodies per second [Hz]
INFO, WARNING, ERROR = 2, 3, 4  # levels of foxglove.Log
STILL = 1e-9  # what moves less than this does not move [m]
_GEOM = mujoco.mjtGeom


def write_mcap(run: StoredRun, path: Path) -> None:
    """Write a run as MCAP; times are those of the simulation.

    Topics: `/scene` (foxglove.SceneUpdate), `/tf` (foxglove.FrameTransforms), `/robots/K` (position,
    velocity, reference velocity, force, tracking error, clearance, whether it avoids; SI units), `/target`
    (position, velocity), `/log` (foxglove.Log: contacts and verdicts). The scenario and the model are
    attached.

    Args:
        run: A run folder with at least one sample.
        path: An `.mcap` file.

    Raises:
        RenderError: If there is no sample, or the model does not fit.
        UsageError: If `mcap` is not installed.
        WriteError: If the file cannot be written; an earlier one stays as it was.
    """
    try:
        from mcap.writer import Writer
    except ImportError:
        raise UsageError(f'{path}: writing MCAP needs a package: pip install "escort-mj[mcap]"') from None
    with replaced(path) as temporary, temporary.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="escort_mj")
        channels: dict[str, int] = {}
        for topic, schema, time, message in _messages(run):
            if topic not in channels:
                name, fields = schema
                known = writer.register_schema(name, "jsonschema", json.dumps(fields).encode())
                channels[topic] = writer.register_channel(topic, "json", known)
            moment = round(1e9 * time)
            content = json.dumps(message, separators=(",", ":")).encode()
            writer.add_message(channels[topic], log_time=moment, publish_time=moment, data=content)
        for name, kind in ((SCENARIO, "application/yaml"), (MODEL, "application/xml")):
            writer.add_attachment(0, 0, name, kind, (run.path / name).read_bytes())
        versions = {key: str(value) for key, value in run.outcome.get("versions", {}).items()}
        writer.add_metadata("escort_mj", {"title": str(run.trace.attrs["title"]), **versions})
        writer.finish()


def _messages(run: StoredRun) -> Iterator[tuple[str, tuple[str, Message], float, Message]]:
    """Topic, schema, time [s] and content of each, by time."""
    replay = replay_of(run.trace)
    model = load_model(run.path / MODEL, replay.qpos.shape[1])
    solids, first = solids_of(model), float(replay.time[0])
    data = mujoco.MjData(model)

    def now(row: int) -> tuple[Array, Array]:
        pose(model, data, replay.qpos[row], {"": replay.target[row]})
        return places(model, data, solids.geoms)

    rows = _rows(replay)
    start, end = now(0), now(len(replay.time) - 1)
    middle = now(len(replay.time) // 2)
    moving = np.zeros(len(solids.geoms), dtype=bool)
    for other in (middle, end):
        moving |= np.abs(other[0] - start[0]).max(axis=1, initial=0.0) > STILL
        moving |= np.abs(other[1] - start[1]).max(axis=1, initial=0.0) > STILL
    yield "/scene", SCENE, first, _scene(replay, solids, model, moving, start)
    told: list[tuple[float, str, tuple[str, Message], Any]] = [
        (time, "/log", LOG, message) for time, message in _log(run)
    ]
    told += [(float(replay.time[row]), "/tf", TRANSFORMS, row) for row in rows]
    samples = [(row, float(time)) for row, time in enumerate(replay.time)]
    told += [(time, "/target", TARGET, row) for row, time in samples if replay.escorts]
    if replay.count <= palette.MOST_LINES:
        told += [(time, "/robots", ROBOT, row) for row, time in samples]
    robots = _robots(run, replay)
    for time, topic, schema, content in sorted(told, key=lambda one: one[0]):
        if topic == "/tf":
            yield topic, schema, time, _transforms(solids, moving, time, *now(content))
        elif topic == "/target":
            vectors = {name: run.trace[f"target_{name}"].values[content] for name in ("position", "velocity")}
            axes = run.trace["axis"].values.tolist()
            yield topic, schema, time, {name: _vector(axes, each) for name, each in vectors.items()}
        elif topic == "/robots":
            for robot in range(replay.count):
                yield f"{topic}/{robot + 1}", schema, time, robots(content, robot)
        else:
            yield topic, schema, time, content


def _rows(replay: Replay) -> NDArray[np.int64]:
    """Samples at which bodies are told."""
    count = min(len(replay.time), max(2, int(RATE * (replay.end - float(replay.time[0]))) + 1))
    return np.unique(np.linspace(0, len(replay.time) - 1, count).round().astype(np.int64))


def _scene(
    replay: Replay,
    solids: Solids,
    model: mujoco.MjModel,
    moving: NDArray[np.bool_],
    start: tuple[Array, Array],
) -> Message:
    """Every body once: in its own frame if it moves; with it the escort radius and the safe distances."""
    entities = []
    for k, name in enumerate(solids.names):
        own = moving[k]
        place = _pose((0, 0, 0), (1, 0, 0, 0)) if own else _pose(start[0][k], start[1][k])
        kind, body = _primitive(solids, model, k, place)
        entities.append(_entity(name, name if own else WORLD, kind, body))
    target = f"{replay.radius:g} m around the target"
    if not replay.escorts:
        return {"deletions": [], "entities": entities}
    moves = "target_body" if moving[solids.names.index("target_body")] else None
    rings = [([1, 0, 0], [0, 1, 0])] if replay.planar else [([1, 0, 0], [0, 1, 0]), ([1, 0, 0], [0, 0, 1])]
    center = np.zeros(3) if moves else replay.target[0]
    for number, axes in enumerate(rings):
        points = circle(center, replay.radius, 64, *map(np.array, axes))
        line = {
            "type": 0,
            "pose": _pose((0, 0, 0), (1, 0, 0, 0)),
            "thickness": 2.0,
            "scale_invariant": True,
            "points": [_xyz(point) for point in points],
            "color": _color((*palette.LIMIT, 0.8)),
            "colors": [],
            "indices": [],
        }
        entities.append(_entity(f"{target} ({number + 1})", moves or WORLD, "lines", line))
    return {"deletions": [], "entities": entities}


def _primitive(solids: Solids, model: mujoco.MjModel, k: int, place: Message) -> tuple[str, Message]:
    """One of Foxglove's shapes for a body, or triangles."""
    kind, scale, color = int(solids.kind[k]), solids.scale[k], _color(solids.color[k])
    shape = {"pose": place, "size": _xyz(2.0 * scale), "color": color}
    if kind in (_GEOM.mjGEOM_SPHERE, _GEOM.mjGEOM_ELLIPSOID):
        return "spheres", shape
    if kind == _GEOM.mjGEOM_BOX:
        return "cubes", shape
    if kind == _GEOM.mjGEOM_CYLINDER:
        return "cylinders", shape | {"bottom_scale": 1.0, "top_scale": 1.0}
    mesh = solids.meshes[solids.mesh[k]]
    return "triangles", {
        "pose": place,
        "points": [_xyz(point) for point in mesh.vertices * scale],
        "color": color,
        "colors": [],
        "indices": mesh.faces.ravel().tolist(),
    }


def _entity(name: str, frame: str, kind: str, primitive: Message) -> Message:
    lists: Message = {one: [] for one in PRIMITIVES}
    return {
        "timestamp": _time(0.0),
        "frame_id": frame,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [],
        **lists,
        kind: [primitive],
    }


def _transforms(solids: Solids, moving: NDArray[np.bool_], time: float, where: Array, turn: Array) -> Message:
    return {
        "transforms": [
            {
                "timestamp": _time(time),
                "parent_frame_id": WORLD,
                "child_frame_id": solids.names[k],
                "translation": _xyz(where[k]),
                "rotation": _quaternion(turn[k]),
            }
            for k in np.flatnonzero(moving)
        ]
    }


def _robots(run: StoredRun, replay: Replay) -> Callable[[int, int], Message]:
    """What a robot does at a sample: by index of the sample and of the robot."""
    trace = run.trace
    axes = [str(axis) for axis in trace["axis"].values]
    vectors = {
        name: trace[signal].values
        for name, signal in (
            ("position", "q"),
            ("velocity", "v"),
            ("reference_velocity", "v_d"),
            ("force", "force"),
        )
    }
    vectors = {name: values for name, values in vectors.items() if not np.isnan(values).all()}  # not logged
    error = np.linalg.norm(trace["e"].values, axis=2)
    clearance = trace["clearance"].values.min(axis=2, initial=np.inf)

    def told(row: int, robot: int) -> Message:
        message: Message = {name: _vector(axes, values[row, robot]) for name, values in vectors.items()}
        return message | {
            "tracking_error": _finite(error[row, robot]),
            "clearance": _finite(clearance[row, robot]),
            "avoiding": bool(replay.avoiding[row, robot]),
            "lost": bool(replay.lost[row, robot]),
        }

    return told


def _vector(axes: list[str], values: Array) -> Message:
    return dict(zip(axes, map(float, values), strict=True))


def _finite(value: float) -> float | None:
    """A number as JSON can hold it."""
    return float(value) if np.isfinite(value) else None


def _log(run: StoredRun) -> Iterator[tuple[float, Message]]:
    """Contacts when they begin, verdicts when what they tell was found, or else at the end."""
    trace = run.trace
    end = float(trace["time"][-1])

    def line(time: float, level: int, name: str, words: str) -> tuple[float, Message]:
        return time, {
            "timestamp": _time(time),
            "level": level,
            "name": name,
            "message": words,
            "file": "",
            "line": 0,
        }

    for k in np.flatnonzero(apart_from(trace, "floor")):
        force, time = (float(trace[name][k]) for name in ("episode_peak_force", "episode_start"))
        first, second = pair(trace, int(k))
        yield line(time, WARNING, "contact", f"{first} and {second} touch, up to {force:.4g} N")
    for verdict in (Verdict(**one) for one in run.verdicts if "metric" in one):
        time = end if verdict.time is None else min(verdict.time, end)
        level = INFO if verdict.passed else ERROR
        yield line(time, level, "verdict", f"{mark(verdict)}: {verdict.message}")


def _time(time: float) -> Message:
    nanoseconds = round(1e9 * time)
    return {"sec": nanoseconds // 10**9, "nsec": nanoseconds % 10**9}


def _xyz(point: Any) -> Message:
    return dict(zip("xyz", (round(float(x), 6) for x in point), strict=True))


def _quaternion(turn: Any) -> Message:
    """From (w, x, y, z)."""
    return dict(zip("wxyz", (round(float(x), 8) for x in turn), strict=True))


def _pose(place: Any, turn: Any) -> Message:
    return {"position": _xyz(place), "orientation": _quaternion(turn)}


def _color(rgba: Any) -> Message:
    return dict(zip("rgba", (round(float(x), 4) for x in rgba), strict=True))


PRIMITIVES = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")


def _object(**properties: Any) -> Message:
    return {"type": "object", "properties": properties}


def _list(items: Message) -> Message:
    return {"type": "array", "items": items}


_NUMBER, _WHOLE, _TEXT, _FLAG = ({"type": kind} for kind in ("number", "integer", "string", "boolean"))
_MOMENT = _object(sec=_WHOLE, nsec=_WHOLE)
_POINT = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_TURN = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_VECTOR = {"type": "object", "additionalProperties": _NUMBER}

SCENE = (
    "foxglove.SceneUpdate",
    _object(
        deletions=_list(_object(timestamp=_MOMENT, type=_WHOLE, id=_TEXT)),
        entities=_list(
            _object(
                timestamp=_MOMENT,
                frame_id=_TEXT,
                id=_TEXT,
                lifetime=_MOMENT,
                frame_locked=_FLAG,
                metadata=_list(_object(key=_TEXT, value=_TEXT)),
                **{name: _list({"type": "object"}) for name in PRIMITIVES},
            )
        ),
    ),
)
TRANSFORMS = (
    "foxglove.FrameTransforms",
    _object(
        transforms=_list(
            _object(
                timestamp=_MOMENT,
                parent_frame_id=_TEXT,
                child_frame_id=_TEXT,
                translation=_POINT,
                rotation=_TURN,
            )
        )
    ),
)
LOG = (
    "foxglove.Log",
    _object(timestamp=_MOMENT, level=_WHOLE, message=_TEXT, name=_TEXT, file=_TEXT, line=_WHOLE),
)
TARGET = ("escort_mj.Target", _object(position=_VECTOR, velocity=_VECTOR))
ROBOT = (
    "escort_mj.Robot",
    _object(
        **{name: _VECTOR for name in ("position", "velocity", "reference_velocity", "force")},
        tracking_error={"type": ["number", "null"]},
        clearance={"type": ["number", "null"]},
        avoiding=_FLAG,
        lost=_FLAG,
    ),
)
