"""Synthetic records: every signal zero but those that a test gives."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from escort_mj.record.folder import RunFolder
from escort_mj.record.outcome import Verdict
from escort_mj.record.recording import NONE, Recording, Variable, record
from escort_mj.signals import EPISODE as COLUMNS
from escort_mj.signals import SIGNALS, record_sizes


def dimensions(
    robots: int, axes: int, obstacles: int, truth: bool = True, teams: int = 0, **more: int
) -> dict[str, int]:
    sizes = {
        "n": robots,
        "p": axes,
        "m": obstacles,
        "behaviors": 2,
        "coordinates": robots * axes,
        "watched": 4,
    }
    if truth:
        sizes |= dict.fromkeys(("known", "judged", "driven", "headed", "estimating", "several"), robots)
        sizes |= {"hearing": robots, "slots": 2, "returned": robots, "rays": 4}
    if truth and obstacles:
        sizes |= {"opponents": 1, "guarding": robots, "movers": 2}
    if teams:
        sizes |= {"teams": teams, "members": robots, "escorted": obstacles}
    return record_sizes(sizes | more)


def pack(time: Any, sizes: Mapping[str, int], **given: Any) -> np.ndarray:
    """Samples of shape (k, record_size); each given signal broadcasts to (k, its dims)."""
    time = np.asarray(time, float)
    columns = []
    for signal in SIGNALS:
        if not signal.recorded(sizes):
            continue
        shape = (len(time), *(sizes[dim] for dim in signal.dims))
        values = time if signal.name == "time" else given.pop(signal.name, 0.0)
        if signal.name == "robot_distance_min" and sizes["robot"] == 1:
            values = np.inf  # what the watcher leaves where there is nothing to be clear of
        if signal.name == "clearance" and np.ndim(values) == 0:
            there = sizes["robot"] > 1, True, sizes["obstacle"] > 0, False
            values = np.where(there, values, np.inf)
        columns.append(np.broadcast_to(values, shape).reshape(len(time), signal.size(sizes)))
    assert not given, given
    return np.concatenate(columns, axis=1)


def describe(sizes: Mapping[str, int], **changes: Any) -> dict[str, Any]:
    """Labels of a ring of robots; changes named like an attribute go to the attributes."""
    n, m = sizes["robot"], sizes["obstacle"]
    labels: dict[str, Any] = {
        "obstacles": [f"rock {j}" for j in range(1, m + 1)],
        "bodies": [*(f"robot_{i}" for i in range(1, n + 1)), "target"]
        + [*(f"rock {j}" for j in range(1, m + 1)), "floor"],
        "body_groups": [*["robots"] * n, "target", *["obstacles"] * m, "floor"],
        "body_motions": [*["free"] * n, "led", *["still"] * m, "still"],
        "body_thickness": [0.4] * n + [0.6] + [1.0] * m + [None],
        "groups": ["robots", "target", "obstacles", "walls"],
        "behaviors": ["vertices", "surface"],
        "robot_mass": [1.0] * n,
        "robot_radius": [0.2] * n,
        "obstacle_radius": [0.5] * m,
        "force_limit": [10.0] * n,
        "neighbors": [[i, i + 1] for i in range(1, n)],
        "spacing": 1.0,
        "teams": ["team"] * sizes.get("team", 0),
        "borders": [],
        "border_point": [],
        "border_normal": [],
        "movers": ["rock 1", "target"] * ("mover" in sizes),
        "lidar_ray": np.ones((sizes.get("ray", 0), sizes["axis"])).tolist(),
        "attributes": {
            "title": "synthetic",
            "description": "",
            "seed": 2**53 - 1,
            "timestep": 0.002,
            "mission_radius": 5.0,
            "target_radius": 0.3,
            "goal_reach": 0.1,
            "safe_distance": 0.0,
            "safe_distance_measure": "none",
            "phases": "mission",
            "height": 0.0,
            "gravity": 0.0,
            "wind": 0.0,
            "robots_mass": float(n),
            "version_numpy": np.__version__,
            "version_platform": "some machine",
        },
    }
    for key, value in changes.items():
        (labels if key in labels else labels["attributes"])[key] = value
    labels["spacing"] = np.broadcast_to(labels["spacing"], len(labels["neighbors"])).tolist()
    return labels


def build_trace(
    samples: Any, sizes: Mapping[str, int], labels: Mapping[str, Any], episodes: Any = NONE
) -> Any:
    """The labelled trace of recorded samples; arguments are those of `recording.record`."""
    return record(samples, sizes, labels, episodes).to_dataset()


def make_trace(
    time: Any,
    robots: int = 1,
    axes: int = 2,
    obstacles: int = 0,
    about: Any = None,
    truth: bool = True,
    episodes: Any = (),
    **given: Any,
) -> Any:
    sizes = dimensions(robots, axes, obstacles, truth)
    rows = np.reshape(np.asarray(episodes, float), (-1, len(COLUMNS)))
    return build_trace(pack(time, sizes, **given), sizes, describe(sizes, **(about or {})), rows)


def begin_run(path, made, overwrite=False):
    """The folder of a run under way, which has put its samples into the journal."""
    samples, sizes, labels = made
    folder = RunFolder.create(path, overwrite=overwrite)
    folder.begin("name: synthetic\n", "<mujoco/>\n", sizes, labels)
    folder.append(samples)
    return folder


def as_recording(trace):
    """A trace as plain arrays."""
    coords, variables = (
        {name: Variable(tuple(one.dims), one.values.copy(), {}) for name, one in group.items()}
        for group in (trace.coords, trace.data_vars)
    )
    return Recording(dict(trace.attrs), coords, variables)


def make_verdict(**changes: Any) -> Verdict:
    """A verdict that passed, but for what is to be another."""
    usual = {"metric": "contacts", "demanded": "none", "value": 0.0, "unit": "1", "time": None, "who": ""}
    usual |= {"margin": 0.0, "passed": True, "near_miss": False, "message": "contacts none: none"}
    return Verdict(**usual | changes)
