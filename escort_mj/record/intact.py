"""Whether stored results are what a run writes: names, dimensions, types and ranges."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from escort_mj.errors import RunFolderError
from escort_mj.monitor.signals import CAUSES, GROUPS
from escort_mj.record.recording import Recorded, not_logged
from escort_mj.signals import (
    DRIVES,
    EPISODE,
    GOALS,
    KNOWLEDGE,
    LIDAR,
    LYAPUNOV,
    MEMORIES,
    MOVERS,
    OPPONENTS,
    POLICIES,
    RADII,
    RADIO,
    READINGS,
    SEVERAL,
    SIGNALS,
    TEAMS,
    TRUTH,
    WATCHES,
)

NUMBER, TEXT = (int, float, np.integer, np.floating), (str,)
ATTRIBUTES: dict[str, tuple[type, ...]] = {
    **dict.fromkeys(("title", "description", "phases", "safe_distance_measure"), TEXT),
    **dict.fromkeys(("seed", "height", "gravity", "wind", "robots_mass"), NUMBER),
    **dict.fromkeys(("timestep", "mission_radius", "safe_distance", "target_radius"), NUMBER),
}
"""Attributes of every trace, and what they are."""
SPEEDS = ("max_speed", "target_speed")
"""Attributes that a trace may have: speeds above 0."""

LABELS = {name: name for name in ("axis", "obstacle", "body", "group", "behavior")} | {"body_group": "body"}
"""Names of every trace, and their dimension."""

FIXED: dict[str, tuple[str, ...]] = {
    "robot": ("robot",),
    "robot_mass": ("robot",),
    "robot_radius": ("robot",),
    "force_limit": ("robot",),
    "obstacle_radius": ("obstacle",),
    "body_thickness": ("body",),
    "neighbors": ("edge", "end"),
    "spacing": ("edge",),
}
"""Numbers of every trace that do not change, and their dimensions."""

INDICES = (
    *("clearance_body", "target_clearance_body", "ruling"),
    *("episode_first", "episode_second", "neighbors"),
)
LARGEST = 1e300  # number of a run: sums of squares of larger ones are no numbers
Kinds = tuple[type, ...]
NOTHING = type(None)
REAL, MAYBE, WORDS, FLAG = (int, float), (int, float, NOTHING), (str,), (bool,)
OUTCOME: dict[str, Kinds] = {
    **dict.fromkeys(("message", "platform", "started", "ended", "scenario_sha256"), WORDS),
    **dict.fromkeys(("simulated_time", "real_time_factor"), MAYBE),
    "wall_time": REAL,
    "versions": (dict,),
}
VERDICT: dict[str, Kinds] = {
    **dict.fromkeys(("metric", "demanded", "unit", "who", "message"), WORDS),
    **dict.fromkeys(("value", "time", "margin"), MAYBE),
    **dict.fromkeys(("passed", "near_miss"), FLAG),
}
VERDICT_MORE: dict[str, Kinds] = {
    "bodies": (list,), "held": FLAG, "xfail": WORDS, "expectation": (int, NOTHING), "broken": FLAG,
    "skip": WORDS,
}  # fmt: skip
METRIC: dict[str, Kinds] = {
    **dict.fromkeys(("value", "time"), MAYBE),
    **dict.fromkeys(("unit", "meaning", "over", "read", "who", "reason"), WORDS),
    "window": (list,),
    "rate": MAYBE,
}
"""Entries of the JSON files of a run folder, and what they are."""


def check_trace(trace: Recorded, path: Path) -> None:
    """Refuse a trace that no run has written.

    Args:
        trace: As it was read.
        path: Its file.

    Raises:
        RunFolderError: With the first thing that is wrong.
    """
    for fault in chain(_attribute_faults(trace), _shape_faults(trace), _value_faults(trace)):
        raise RunFolderError(f"{path}: the trace is damaged: {fault}")


def _attribute_faults(trace: Recorded) -> Iterator[str]:
    for name, kinds in ATTRIBUTES.items():
        value = trace.attrs.get(name)
        if not isinstance(value, kinds) or (kinds is NUMBER and not math.isfinite(float(value))):  # type: ignore[arg-type]
            yield f"the attribute {name} is {value!r}"
    for name in ("timestep", "mission_radius", "target_radius"):
        value = trace.attrs[name]
        if not (0.0 < value < 1e9 or (value == 0.0 and name == "target_radius")):  # 0: no target
            yield f"the attribute {name} is {trace.attrs[name]!r}"
    for name in SPEEDS:
        value = trace.attrs.get(name, 1.0)
        if not isinstance(value, NUMBER) or not 0.0 < value < math.inf:
            yield f"the attribute {name} is {value!r}"


def _shape_faults(trace: Recorded) -> Iterator[str]:
    """Variables that are missing, or have other dimensions or types."""
    marks = {TRUTH: "mass_matrix", LYAPUNOV: "lyapunov", DRIVES: "drive_force", GOALS: "goal"}
    marks |= {KNOWLEDGE: "target_estimate", RADIO: "heard_from", LIDAR: "lidar_range"}
    marks |= {
        OPPONENTS: "opponent_status",
        TEAMS: "member_of",
        MOVERS: "mover_work",
        MEMORIES: "component_memory",
        READINGS: "readings",
        POLICIES: "policy_memory",
        SEVERAL: "point_speed_max",
        RADII: "kept_radius",
        WATCHES: "watch_value",
    }
    channels = {channel: signal in trace for channel, signal in marks.items()}
    wanted: dict[str, tuple[tuple[str, ...], str]] = {"time": (("time",), "f")}
    wanted |= {name: (dims, "fiu") for name, dims in FIXED.items()}
    wanted |= {name: ((dim,), "OUST") for name, dim in LABELS.items()}
    for signal in SIGNALS[1:]:
        if channels.get(signal.channel, True) and not _alone(trace, signal.name):
            wanted[signal.name] = ("time", *signal.dims), "fiu"
    wanted |= {column.name: (column.dims, "fiu") for column in EPISODE}
    if "obstacle_outline" in trace:
        wanted["obstacle_outline"] = ("obstacle", "point", "axis"), "f"
    if channels[TEAMS]:
        wanted["team"] = ("team",), "OUST"
    if channels[WATCHES]:
        wanted["watch"] = ("watch",), "OUST"
    if channels[MEMORIES]:
        wanted |= dict.fromkeys(("memory", "memory_unit", "memory_truth"), (("memory",), "OUST"))
    if channels[READINGS]:
        wanted["reading"] = wanted["reading_unit"] = ("reading",), "OUST"
    if channels[POLICIES]:
        wanted["policy_value"] = wanted["policy_unit"] = ("policy_value",), "OUST"
    if channels[MOVERS]:
        wanted["mover"] = ("mover",), "OUST"
    if channels[LIDAR]:
        wanted["lidar_ray"] = ("ray", "axis"), "f"
    wanted |= {name: (wanted[name][0], "iu") for name in INDICES}
    for name, (dims, kinds) in wanted.items():
        if name not in trace:
            yield f"it has no {name}"
        elif trace[name].dims != dims or trace[name].dtype.kind not in kinds:
            found = f"{trace[name].dtype} of {', '.join(map(str, trace[name].dims)) or 'no dimension'}"
            yield f"{name} is {found}; expected dimensions {', '.join(dims)}"
    sizes = trace.sizes
    if not (sizes["axis"] >= 2 and sizes["robot"] >= 1 and sizes["end"] == 2):
        yield f"it has {sizes['axis']} axes and {sizes['robot']} robots"
    if channels[TRUTH] and sizes["axis_2"] != sizes["axis"]:
        yield f"its matrices have {sizes['axis_2']} columns; expected {sizes['axis']}"
    if channels[LYAPUNOV] and sizes["cause"] != len(CAUSES):
        yield f"it has {sizes['cause']} causes; expected {len(CAUSES)}"
    if sizes["body"] < sizes["robot"] + 1 + sizes["obstacle"]:
        yield f"it has {sizes['body']} bodies"
    groups = [str(name) for name in trace["group"].values]
    if missing := [group for group in GROUPS if group not in groups]:
        yield f"it has no group {missing[0]}"


def _alone(trace: Recorded, name: str) -> bool:
    """Whether a signal is left out because there is one robot."""
    return name == "robot_distance_min" and trace.sizes.get("robot") == 1


def _value_faults(trace: Recorded) -> Iterator[str]:
    """Times that do not rise, what is not a number, and places in lists that have none such."""
    time = trace["time"].values
    if not np.isfinite(time).all() or (np.diff(time) <= 0.0).any():
        yield "its times do not rise"
    bodies, robots, behaviors = (trace.sizes[dim] for dim in ("body", "robot", "behavior"))
    spans = dict.fromkeys(("clearance_body", "target_clearance_body"), (-1, bodies - 1))
    spans |= dict.fromkeys(("episode_first", "episode_second"), (0, bodies - 1))
    spans |= {"neighbors": (1, robots), "ruling": (-1, behaviors - 1)}
    for name, (low, high) in spans.items():
        values = trace[name].values
        if values.size and not (low <= values.min() and values.max() <= high):
            yield f"{name} has the value {values.min() if values.min() < low else values.max()}"
    least = np.atleast_1d(trace.attrs.get("least_energy", ()))
    lost = int((trace["lost"].values > 0).sum(axis=1).max(initial=0))
    if len(least) and (least.dtype.kind not in "fiu" or len(least) <= lost):
        yield f"the attribute least_energy is {trace.attrs['least_energy']!r} with {lost} robots lost"
    missing = not_logged(trace)
    for signal in (*(one for one in SIGNALS[1:] if not one.channel), *EPISODE):
        if signal.name in trace and signal.name not in missing and np.isnan(trace[signal.name].values).any():
            yield f"{signal.name} has values that are not numbers"
    for name in ("q", "v", "q_d", "target_position", "force", "tau", "qpos", "robot_radius", "robot_mass"):
        if np.abs(trace[name].values).max(initial=0.0) > LARGEST:
            yield f"{name} has values beyond {LARGEST:g}"


def check_outcome(found: Mapping[str, Any], path: Path) -> None:
    """Refuse an outcome whose entries are of other types than a run's.

    Raises:
        RunFolderError: With the first that is.
    """
    check_table(found, OUTCOME, path)


def check_verdicts(found: Any, path: Path) -> None:
    """Refuse what is not a list of verdicts.

    Raises:
        RunFolderError: With the first thing that is wrong.
    """
    if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
        raise RunFolderError(f"{path}: is damaged: expected a list of verdicts")
    for place, verdict in enumerate(found):
        if unknown := [key for key in verdict if key not in VERDICT | VERDICT_MORE]:
            raise RunFolderError(f"{path}: is damaged: verdict {place + 1} has the unknown key {unknown[0]}")
        needed = VERDICT if "metric" in verdict else ("passed",)
        check_table(verdict, VERDICT | VERDICT_MORE, path, f"[{place}].", needed)
        if not all(isinstance(name, str) for name in verdict.get("bodies", ())):
            raise RunFolderError(f"{path}: is damaged: bodies of verdict {place + 1} are not names")


def check_metrics(found: Any, path: Path) -> None:
    """Refuse what is not a table of metrics.

    Raises:
        RunFolderError: With the first thing that is wrong.
    """
    if not isinstance(found, dict) or not all(isinstance(one, dict) for one in found.values()):
        raise RunFolderError(f"{path}: is damaged: expected a table of metrics")
    for name, metric in found.items():
        if name == "run":
            continue
        check_table(metric, METRIC, path, f"{name}.", ("value", "unit", "window", "time", "who"))
        numbers = all(isinstance(each, REAL) and abs(each) <= LARGEST for each in metric["window"])
        if len(metric["window"]) != 2 or not numbers:
            raise RunFolderError(f"{path}: is damaged: {name}.window is {str(metric['window'])[:60]!r}")


def check_table(
    found: Mapping[str, Any],
    kinds: Mapping[str, Kinds],
    path: Path,
    place: str = "",
    needed: Iterable[str] = (),
    infinite: bool = False,
) -> None:
    """Refuse a table whose entries are missing or of other types.

    Args:
        found: The table.
        kinds: What each entry is, where it is there.
        path: Its file.
        place: Where in the file it is, as it stands before a key.
        needed: Entries that must be there.
        infinite: Whether numbers may be infinite.

    Raises:
        RunFolderError: With the first entry that is wrong.
    """
    for key in needed:
        if key not in found:
            raise RunFolderError(f"{path}: is damaged: {place}{key} is missing")
    for key in kinds.keys() & found.keys():
        value = found[key]
        right = isinstance(value, kinds[key])
        if isinstance(value, int | float) and kinds[key] is not FLAG:  # a flag is an int to Python
            endless = infinite and isinstance(value, float) and math.isinf(value)
            right = right and not isinstance(value, bool) and (endless or abs(value) <= LARGEST)
        if not right:
            raise RunFolderError(f"{path}: is damaged: {place}{key} is {str(value)[:60]!r}")
