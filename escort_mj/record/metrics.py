"""Numbers that sum up a run or a window of it, with their unit, moment and robot."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from escort_mj.control.custom.place import place_of
from escort_mj.record import measures
from escort_mj.record.measures import Measure
from escort_mj.record.outcome import Outcome
from escort_mj.record.recording import sealed
from escort_mj.scenario.geometry.steps import SLACK
from escort_mj.signals import METRICS, Metric

if TYPE_CHECKING:
    from escort_mj.record.recording import Part, Recorded

__all__ = ["Measure", "measure", "summarize", "window"]

TAIL = 0.2  # share of a run that counts as its steady state
EMPTY = "the run has no sample in the window"
NOTHING_YET: dict[str, Any] = {  # the worst, and whose, where nobody has looked since the previous sample
    "clearance": math.inf,
    "clearance_body": -1,
    "target_clearance": math.inf,
    "target_clearance_body": -1,
    "target_speed_max": 0.0,
    "obstacle_speed_max": 0.0,
}

FUNCTIONS: dict[str, Callable[[Any], Measure]] = {
    metric.name: getattr(measures, metric.name) for metric in METRICS
}


def window(trace: Part, after: float = 0.0, before: float | None = None) -> Part:
    """The samples of a window of time [s], its ends included.

    Where the first of them would tell of steps before the window, it tells of its own moment alone.
    """
    time = trace["time"].values
    if not len(time):
        return trace
    timestep = float(trace.attrs["timestep"])
    slack = SLACK * timestep
    inside = (time >= after - slack) & (time <= (math.inf if before is None else before) + slack)
    if inside.all():
        return trace
    part, first = cast("Part", trace.isel(time=inside)), int(np.argmax(inside))
    looks_back = inside.any() and first > 0 and time[first - 1] + timestep < after - slack
    return _without_past(part) if looks_back else part


def _without_past(trace: Part) -> Part:
    """A trace whose first sample knows nothing of what was before it."""
    now = dict(NOTHING_YET)
    if "speed_max" in trace:
        now["speed_max"] = np.linalg.norm(trace["v"].values[0], axis=1)
    if "kinetic_energy" in trace:
        now["kinetic_energy"] = 0.5 * (trace["robot_mass"].values * now["speed_max"] ** 2).sum()
    changed: dict[str, Any] = {}
    for name in now:
        if name in trace:
            values = trace[name].values.copy()
            values[0] = now[name]
            changed[name] = trace[name].dims, values
    return cast("Part", trace.assign(**changed))


def measure(
    metric: str | Metric, trace: Recorded, after: float = 0.0, before: float | None = None
) -> Measure:
    """Value of a metric, told by its name or, of a plugin's, itself, over a window of a trace."""
    part = window(trace, after, before)
    if not part.sizes["time"]:
        return Measure(None, reason=EMPTY)
    return _value(metric, part)


def measures_of(trace: Recorded, metrics: Sequence[Metric] = METRICS) -> dict[str, Measure]:
    """Every metric: over the whole run or, for steady state, over its last fifth."""
    if not trace.sizes["time"]:
        return {metric.name: Measure(None, reason=EMPTY) for metric in metrics}
    tail = window(trace, (1.0 - TAIL) * float(trace["time"][-1]))
    return {metric.name: _value(metric, tail if metric.tail else trace) for metric in metrics}


def _value(metric: str | Metric, part: Part) -> Measure:
    """Value of a metric over all of a part of a trace; an error of a plugin's is no value."""
    if isinstance(metric, str) or metric.function is None:
        return FUNCTIONS[metric if isinstance(metric, str) else metric.name](part)
    try:
        found = metric.function(sealed(part))
        if isinstance(found, Measure):
            return found
        if found is None:
            return Measure(None, reason=f"{metric.name} says nothing of this run")
        return Measure(float(found))
    except Exception as error:
        return Measure(None, reason=place_of(error, metric.function), broken=True)


def summarize(
    found: dict[str, Measure],
    trace: Recorded,
    outcome: Outcome,
    steps: int,
    wall_time: float,
    metrics: Sequence[Metric] = METRICS,
) -> dict[str, Any]:
    """Contents of metrics.json: every metric, over the run or, for steady state, over its last fifth.

    Args:
        found: What `measures_of` says of the trace.
        trace: The whole trace.
        outcome: How the run ended.
        steps: Physics steps taken.
        wall_time: Time that they took [s].
        metrics: Which.
    """
    time = trace["time"].values
    reached = float(time[-1]) if len(time) else 0.0
    tail = float(window(trace, (1.0 - TAIL) * reached)["time"][0]) if len(time) else 0.0
    summary: dict[str, Any] = {
        "run": {
            "outcome": outcome.value,
            "simulated_time": reached,
            "steps": steps,
            "wall_time": wall_time,
            "real_time_factor": reached / wall_time if wall_time > 0.0 else None,
        }
    }
    for metric in metrics:
        one = _finite(found[metric.name])
        summary[metric.name] = {
            "value": one.value,
            "unit": metric.unit,
            "window": [tail if metric.tail else 0.0, reached],
            "time": one.time,
            "who": one.who,
        } | ({"reason": one.reason} if one.reason else {})
    return summary


def _finite(found: Measure) -> Measure:
    """A measure as JSON can hold it: where the value is no finite number, the reason says so."""
    if found.value is None or math.isfinite(found.value):
        return found
    return found._replace(value=None, reason=found.reason or f"the value is {found.value}")
