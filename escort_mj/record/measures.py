"""One function per metric of `signals.METRICS`: pure functions of a trace or of a window of one.

Signals that hold the worst since the previous sample look back one sample before a window's start; running
totals are differenced over the window, so they count every physics step in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import xarray

SETTLED = 0.05  # of the radius
SHORT = "the window holds a single sample"
ALONE = "there is one robot"
UNOBSTRUCTED = "there are no obstacles"
SHAPELESS = "the mission has no formation"
UNTOLD = "the truth was not recorded (recording.truth)"
NO_LYAPUNOV = "the Lyapunov function belongs to the sliding-mode laws"


class Measure(NamedTuple):
    """The value of a metric.

    Attributes:
        value: In the metric's unit; None where the metric says nothing of this run, infinite for "never".
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
    """Signed deviation of neighbors' distances from even, shape (time, edge) [m]; None without one."""
    pairs = trace["neighbors"].values
    if not len(pairs):
        return None
    q = trace["q"].values
    return np.linalg.norm(q[:, pairs[:, 0] - 1] - q[:, pairs[:, 1] - 1], axis=2) - trace["spacing"].values


def _at(trace: xarray.Dataset, values: np.ndarray, place: np.intp, name: Callable[[int], str]) -> Measure:
    """The value at a flat place of values of shape (time, thing)."""
    row, column = divmod(int(place), values.shape[1])
    return Measure(float(values[row, column]), float(trace["time"][row]), name(column))


def _largest(trace: xarray.Dataset, values: np.ndarray, name: Callable[[int], str]) -> Measure:
    """Largest of values of shape (time, thing), the first of equals."""
    return _at(trace, values, np.argmax(values), name)


def _least(trace: xarray.Dataset, values: np.ndarray, name: Callable[[int], str]) -> Measure:
    """Least of values of shape (time, thing), the first of equals."""
    return _at(trace, values, np.argmin(values), name)


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
        return Measure(None, reason=SHAPELESS)
    return Measure(float(np.abs(error).mean()))


def spacing_error_max(trace: xarray.Dataset) -> Measure:
    """Largest absolute deviation of a neighbors' distance from even."""
    error = spacing_error(trace)
    if error is None:
        return Measure(None, reason=SHAPELESS)
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
        return Measure(None, reason=UNOBSTRUCTED)
    distances = trace["obstacle_distance"].values
    names, count = trace["obstacle"].values, trace.sizes["obstacle"]
    flat = distances.reshape(len(distances), -1)
    return _least(trace, flat, lambda index: f"{_robot(index // count)} and {names[index % count]}")


def _clearance(trace: xarray.Dataset, name: str, reason: str) -> Measure:
    """Least of a clearance that was watched at every physics step."""
    return _least(trace, trace[name].values, _robot) if name in trace else Measure(None, reason=reason)


def obstacle_clearance_min(trace: xarray.Dataset) -> Measure:
    """Least distance robot to obstacle, surface to surface, at any physics step."""
    return _clearance(trace, "obstacle_clearance_worst", UNOBSTRUCTED)


def robot_distance_min(trace: xarray.Dataset) -> Measure:
    """Least distance between two robots, center to center."""
    return _clearance(trace, "robot_distance_min", ALONE)


def robot_clearance_min(trace: xarray.Dataset) -> Measure:
    """Least distance between two robots, surface to surface, at any physics step."""
    return _clearance(trace, "robot_clearance_worst", ALONE)


def saturated_share(trace: xarray.Dataset) -> Measure:
    """Share of time in which a robot's motor was at its limit, mean over robots."""
    gained = _gained(trace, "saturated_time")
    return Measure(None, reason=SHORT) if gained is None else Measure(float(gained.mean() / _span(trace)))


def contacts(trace: xarray.Dataset) -> Measure:
    """Touches in the window: those under way when it begins, and those begun in it."""
    onsets = trace["contact_onsets"].values
    touching = trace["contacts"].values
    when = np.flatnonzero((touching > 0) | (np.diff(onsets, prepend=onsets[:1]) > 0))
    count = float(onsets[-1] - onsets[0] + touching[0])
    return Measure(count, float(trace["time"][when[0]]) if len(when) else None)


def contact_force_max(trace: xarray.Dataset) -> Measure:
    """Largest normal contact force at any physics step."""
    found = _largest(trace, trace["contact_force"].values[:, None], lambda index: "")
    return found if found.value else Measure(0.0)


def _eigenvalues(trace: xarray.Dataset) -> np.ndarray:
    """Eigenvalues of each robot's mass matrix, ascending, shape (time, robot, axis) [kg]."""
    return np.linalg.eigvalsh(trace["mass_matrix"].values)


def mass_eigenvalue_min(trace: xarray.Dataset) -> Measure:
    """Least eigenvalue of a robot's mass matrix."""
    if "mass_matrix" not in trace:
        return Measure(None, reason=UNTOLD)
    return _least(trace, _eigenvalues(trace)[..., 0], _robot)


def mass_eigenvalue_max(trace: xarray.Dataset) -> Measure:
    """Largest eigenvalue of a robot's mass matrix."""
    if "mass_matrix" not in trace:
        return Measure(None, reason=UNTOLD)
    return _largest(trace, _eigenvalues(trace)[..., -1], _robot)


def skew_residual(trace: xarray.Dataset) -> Measure:
    """Largest symmetric part of dM/dt - 2 C."""
    return _residual(trace, "skew_residual")


def coriolis_residual(trace: xarray.Dataset) -> Measure:
    """Largest difference of C v + g from MuJoCo's bias force."""
    return _residual(trace, "coriolis_residual")


def _residual(trace: xarray.Dataset, name: str) -> Measure:
    """Largest of a residual of the truth channel."""
    return _largest(trace, trace[name].values, _robot) if name in trace else Measure(None, reason=UNTOLD)


def lyapunov_rise(trace: xarray.Dataset) -> Measure:
    """Largest rise of a robot's V1 above its least so far, without what the moving reference did to it."""
    if "lyapunov" not in trace:
        return Measure(None, reason=UNTOLD if "mass_matrix" not in trace else NO_LYAPUNOV)
    value = trace["lyapunov"].values - trace["lyapunov_change"].sel(cause="reference").values
    return _largest(trace, value - np.minimum.accumulate(value, axis=0), _robot)


def lyapunov_unexplained(trace: xarray.Dataset) -> Measure:
    """Sum over robots and samples of the absolute change of V1 that no known cause explains."""
    if "lyapunov" not in trace:
        return Measure(None, reason=UNTOLD if "mass_matrix" not in trace else NO_LYAPUNOV)
    total = trace["lyapunov_change"].sel(cause="unexplained").values
    return (
        Measure(float(np.abs(np.diff(total, axis=0)).sum()))
        if len(total) > 1
        else Measure(None, reason=SHORT)
    )
