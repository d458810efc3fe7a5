"""Whether stored results are what a run writes: names, dimensions, types and ranges."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, Field

from escort_mj.errors import RunFolderError
from escort_mj.files import checked
from escort_mj.monitor.signals import CAUSES, GROUPS
from escort_mj.record.outcome import LARGEST, Outcome, Verdict
from escort_mj.record.recording import NAMES, NUMBERS, Recorded, not_logged
from escort_mj.signals import EPISODE, LYAPUNOV, SIGNALS, TRUTH

TEXT = "OUST"  # kinds of types
Finite = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(gt=0.0, lt=1e9)]
Speed = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class Attributes(BaseModel, strict=True, defer_build=True):
    """Attributes of a trace that are read."""

    title: str
    description: str
    phases: str
    safe_distance_measure: str
    seed: Finite
    height: Finite
    gravity: Finite
    wind: Finite
    robots_mass: Finite
    safe_distance: Finite
    timestep: Positive
    mission_radius: Positive
    target_radius: Annotated[float, Field(ge=0.0, lt=1e9)]  # 0: no target
    max_speed: Speed = 1.0
    target_speed: Speed = 1.0


class OutcomeEntries(BaseModel, strict=True, defer_build=True):
    """Entries of outcome.json that are read."""

    outcome: Annotated[Outcome, Field(strict=False)]
    message: str = ""
    platform: str = ""
    started: str = ""
    ended: str = ""
    scenario_sha256: str = ""
    simulated_time: Finite | None = None
    real_time_factor: Finite | None = None
    wall_time: Finite = 0.0
    versions: dict[str, Any] = {}


class MetricEntries(BaseModel, strict=True, defer_build=True):
    """Entries of a metric in metrics.json that are read."""

    value: Finite | None
    unit: str
    window: Annotated[list[Finite], Field(min_length=2, max_length=2)]
    time: Finite | None
    who: str
    meaning: str = ""
    over: str = ""
    read: str = ""
    reason: str = ""
    rate: Finite | None = None


class MetricsFile(BaseModel, extra="allow", defer_build=True):
    """A table of metrics, and what is known of the run."""

    __pydantic_extra__: dict[str, MetricEntries]
    run: dict[str, Any] = {}


VerdictsFile = Annotated[list[Verdict], Field(min_length=1)]
"""The first verdict is that of how the run ended."""


def check_trace(trace: Recorded, path: Path) -> None:
    """Refuse a trace that no run has written.

    Args:
        trace: As it was read.
        path: Its file.

    Raises:
        RunFolderError: With the first thing that is wrong.
    """
    plain = {key: one.item() if isinstance(one, np.generic) else one for key, one in trace.attrs.items()}
    checked(Attributes, plain, path, "attribute ")
    for fault in chain(_shape_faults(trace), _value_faults(trace)):
        raise RunFolderError(f"{path}: the trace is damaged: {fault}")


def _shape_faults(trace: Recorded) -> Iterator[str]:
    """Variables that are missing, or have other dimensions or types."""
    channels = {"", *(signal.channel for signal in SIGNALS if signal.name in trace)}
    alone = "robot_distance_min" if trace.sizes.get("robot") == 1 else ""  # left out
    wanted: dict[str, tuple[tuple[str, ...], str]] = {"time": (("time",), "f"), "robot": (("robot",), "fiu")}
    wanted["axis"] = ("axis",), TEXT
    for signal in SIGNALS[1:]:
        if signal.channel in channels and signal.name != alone:
            wanted[signal.name] = ("time", *signal.dims), _kinds(signal.dtype)
    for column in EPISODE:
        wanted[column.name] = column.dims, _kinds(column.dtype)
    for fact in (*NAMES, *NUMBERS):
        if fact.needs in channels or fact.name in trace:
            wanted[fact.name] = fact.dims, _kinds(fact.dtype)
    for name, (dims, kinds) in wanted.items():
        if name not in trace:
            yield f"it has no {name}"
        elif trace[name].dims != dims or trace[name].dtype.kind not in kinds:
            found = f"{trace[name].dtype} of {', '.join(map(str, trace[name].dims)) or 'no dimension'}"
            yield f"{name} is {found}; expected dimensions {', '.join(dims)}"
    sizes = trace.sizes
    if not (sizes["axis"] >= 2 and sizes["robot"] >= 1 and sizes["end"] == 2):
        yield f"it has {sizes['axis']} axes and {sizes['robot']} robots"
    if TRUTH in channels and sizes["axis_2"] != sizes["axis"]:
        yield f"its matrices have {sizes['axis_2']} columns; expected {sizes['axis']}"
    if LYAPUNOV in channels and sizes["cause"] != len(CAUSES):
        yield f"it has {sizes['cause']} causes; expected {len(CAUSES)}"
    if sizes["body"] < sizes["robot"] + 1 + sizes["obstacle"]:
        yield f"it has {sizes['body']} bodies"
    groups = [str(name) for name in trace["group"].values]
    if missing := [group for group in GROUPS if group not in groups]:
        yield f"it has no group {missing[0]}"


def _kinds(dtype: str) -> str:
    """Return the kinds of types that will do for a type: texts, whole numbers, or any numbers."""
    return {"U": TEXT, "i": "iu", "f": "fiu"}[np.dtype(dtype).kind]


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
