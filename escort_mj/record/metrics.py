"""Numbers that sum up a run or a window of it: pure functions of a trace, with unit, moment and robot."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from escort_mj.record.outcome import Outcome
from escort_mj.signals import METRICS

if TYPE_CHECKING:
    import xarray

TAIL = 0.2  # share of a run that counts as its steady state
SETTLED = 0.05  # of the radius


class Measure(NamedTuple):
    """The value of a metric.

    Attributes:
        value: In the metric's unit; None where the metric says nothing of this run.
        time: Moment of the worst value [s]; None where there is none.
        who: Who had it; empty where nobody in particular.
        reason: Why there is no value.
    """

    value: float | None
    time: float | None = None
    who: str = ""
    reason: str = ""


def radius_error(trace: xarray.Dataset) -> np.ndarray:
    """Signed | q - c | - radius, shape (time, robot) [m]."""
    offset = trace["q"].values - trace["target_position"].values[:, None]
    return np.linalg.norm(offset, axis=2) - trace.attrs["mission_radius"]


def spacing_error(trace: xarray.Dataset) -> np.ndarray | None:
    """Signed deviation of neighbors' distances from even, shape (time, edge) [m]; None without a formation."""
    pairs = trace["neighbors"].values
    if not len(pairs):
        return None
    q = trace["q"].values
    return np.linalg.norm(q[:, pairs[:, 0] - 1] - q[:, pairs[:, 1] - 1], axis=2) - trace.attrs["spacing"]


def _largest(trace: xarray.Dataset, values: np.ndarray, name: Callable[[int], str]) -> Measure:
    """Largest of values of shape (time, thing)."""
    row, column = np.unravel_index(int(np.argmax(values)), values.shape)
    return Measure(float(values[row, column]), float(trace["time"][row]), name(int(column)))


def _least(trace: xarray.Dataset, values: np.ndarray, name: Callable[[int], str]) -> Measure:
    """Least of values of shape (time, thing)."""
    found = _largest(trace, -values, name)
    return found._replace(value=-(found.value or 0.0))


def _robot(index: int) -> str:
    return f"robot {index + 1}"


def _edge(trace: xarray.Dataset) -> Callable[[int], str]:
    pairs = trace["neighbors"].values
    return lambda index: f"robots {pairs[index, 0]} and {pairs[index, 1]}"


def radius_error_mean(trace: xarray.Dataset) -> Measure:
    """Mean of the absolute radius error."""
    return Measure(float(np.abs(radius_error(trace)).mean()))


def radius_error_max(trace: xarray.Dataset) -> Measure:
    """Largest absolute radius error."""
    return _largest(trace, np.abs(radius_error(trace)), _robot)


def settling_time(trace: xarray.Dataset) -> Measure:
    """Time after which every robot stays within 5 % of the radius to the end of the window."""
    outside = np.abs(radius_error(trace)) > SETTLED * trace.attrs["mission_radius"]
    late = np.flatnonzero(outside.any(axis=1))
    if not len(late):
        return Measure(float(trace["time"][0]))
    last = int(late[-1])
    who = _robot(int(np.argmax(outside[last])))
    if last == trace.sizes["time"] - 1:
        return Measure(math.inf, float(trace["time"][last]), who, "never settles")
    return Measure(float(trace["time"][last + 1]), float(trace["time"][last]), who)


def spacing_error_mean(trace: xarray.Dataset) -> Measure:
    """Mean absolute deviation of neighbors' distances from even."""
    error = spacing_error(trace)
    if error is None:
        return Measure(None, reason="the mission has no formation")
    return Measure(float(np.abs(error).mean()))


def spacing_error_max(trace: xarray.Dataset) -> Measure:
    """Largest absolute deviation of a neighbors' distance from even."""
    error = spacing_error(trace)
    if error is None:
        return Measure(None, reason="the mission has no formation")
    return _largest(trace, np.abs(error), _edge(trace))


def _rms(trace: xarray.Dataset, name: str) -> Measure:
    """Root mean square of a vector's length over time and robots."""
    return Measure(float(np.sqrt((trace[name].values ** 2).sum(axis=2).mean())))


def tracking_error_rms(trace: xarray.Dataset) -> Measure:
    """Root mean square of |e|."""
    return _rms(trace, "e")


def velocity_error_rms(trace: xarray.Dataset) -> Measure:
    """Root mean square of |e_dot|."""
    return _rms(trace, "e_dot")


def _gained(trace: xarray.Dataset, name: str) -> np.ndarray | None:
    """What a running total gained over the window, per robot; None for a window of one sample."""
    if trace.sizes["time"] < 2:
        return None
    return np.atleast_1d(trace[name].values[-1] - trace[name].values[0])


def _span(trace: xarray.Dataset) -> float:
    """Length of the window [s]."""
    return float(trace["time"][-1] - trace["time"][0])


SHORT = "the window holds a single sample"


def force_rms(trace: xarray.Dataset) -> Measure:
    """Root mean square of a robot's force, from the running total of its square."""
    gained = _gained(trace, "effort")
    return (
        Measure(None, reason=SHORT)
        if gained is None
        else Measure(float(np.sqrt(gained.mean() / _span(trace))))
    )


def chattering(trace: xarray.Dataset) -> Measure:
    """Total variation of force per second, mean over robots."""
    gained = _gained(trace, "force_variation")
    return Measure(None, reason=SHORT) if gained is None else Measure(float(gained.mean() / _span(trace)))


def energy(trace: xarray.Dataset) -> Measure:
    """Integral of |force . velocity|, sum over robots."""
    gained = _gained(trace, "work")
    return Measure(None, reason=SHORT) if gained is None else Measure(float(gained.sum()))


def obstacle_distance_min(trace: xarray.Dataset) -> Measure:
    """Least distance robot to obstacle, center to center."""
    if not trace.sizes["obstacle"]:
        return Measure(None, reason="there are no obstacles")
    distances = trace["obstacle_distance"].values
    names, count = trace["obstacle"].values, trace.sizes["obstacle"]
    flat = distances.reshape(len(distances), -1)
    return _least(trace, flat, lambda index: f"{_robot(index // count)} and {names[index % count]}")


def _clearance(trace: xarray.Dataset, name: str, reason: str) -> Measure:
    """Least of a clearance that was watched at every physics step."""
    return _least(trace, trace[name].values, _robot) if name in trace else Measure(None, reason=reason)


def obstacle_clearance_min(trace: xarray.Dataset) -> Measure:
    """Least distance robot to obstacle, surface to surface, at any physics step."""
    return _clearance(trace, "obstacle_clearance_worst", "there are no obstacles")


def robot_distance_min(trace: xarray.Dataset) -> Measure:
    """Least distance between two robots, center to center."""
    return _clearance(trace, "robot_distance_min", "there is one robot")


def robot_clearance_min(trace: xarray.Dataset) -> Measure:
    """Least distance between two robots, surface to surface, at any physics step."""
    return _clearance(trace, "robot_clearance_worst", "there is one robot")


def saturated_share(trace: xarray.Dataset) -> Measure:
    """Share of time in which a robot's motor was at its limit, mean over robots."""
    gained = _gained(trace, "saturated_time")
    return Measure(None, reason=SHORT) if gained is None else Measure(float(gained.mean() / _span(trace)))


def contacts(trace: xarray.Dataset) -> Measure:
    """Touches in the window: those under way when it begins, and those begun in it."""
    onsets = trace["contact_onsets"].values
    touching = trace["contacts"].values
    count = (
        int(onsets[-1]) if float(trace["time"][0]) == 0.0 else int(onsets[-1] - onsets[0] + (touching[0] > 0))
    )
    when = np.flatnonzero(touching)
    return Measure(float(count), float(trace["time"][when[0]]) if len(when) else None)


def contact_force_max(trace: xarray.Dataset) -> Measure:
    """Largest normal contact force at any physics step."""
    found = _largest(trace, trace["contact_force"].values[:, None], lambda index: "")
    return found if found.value else Measure(0.0)


FUNCTIONS: dict[str, Callable[[Any], Measure]] = {metric.name: globals()[metric.name] for metric in METRICS}


def window(trace: xarray.Dataset, after: float = 0.0, before: float | None = None) -> xarray.Dataset:
    """The samples of a window of time [s], its ends included."""
    time = trace["time"].values
    slack = 1e-9 * max(1.0, float(time[-1]) if len(time) else 1.0)
    inside = (time >= after - slack) & (time <= (math.inf if before is None else before) + slack)
    return trace.isel(time=inside)


def measure(name: str, trace: xarray.Dataset, after: float = 0.0, before: float | None = None) -> Measure:
    """Value of a metric over a window of a trace."""
    part = window(trace, after, before)
    if not part.sizes["time"]:
        return Measure(None, reason="the run has no sample in the window")
    return FUNCTIONS[name](part)


def summarize(trace: xarray.Dataset, outcome: Outcome, steps: int, wall_time: float) -> dict[str, Any]:
    """Contents of metrics.json: every metric, over the run or, for steady state, over its last fifth.

    Args:
        trace: The whole trace.
        outcome: How the run ended.
        steps: Physics steps taken.
        wall_time: Time that they took [s].
    """
    time = trace["time"].values
    reached = float(time[-1]) if len(time) else 0.0
    summary: dict[str, Any] = {
        "run": {
            "outcome": outcome.value,
            "simulated_time": reached,
            "steps": steps,
            "wall_time": wall_time,
            "real_time_factor": reached / wall_time if wall_time > 0.0 else None,
        }
    }
    for metric in METRICS:
        after = (1.0 - TAIL) * reached if metric.tail else 0.0
        found = measure(metric.name, trace, after)
        summary[metric.name] = {
            "value": found.value,
            "unit": metric.unit,
            "window": [after, reached],
            "time": found.time,
            "who": found.who,
        } | ({"reason": found.reason} if found.reason else {})
    return summary
