"""One function per metric of `signals.METRICS`: pure functions of a trace or of a window of one.

Signals that hold the worst since the previous sample look back no further than the window, see
`metrics.window`; running totals are differenced over it, so they count every physics step in it; means weigh
samples by the time around them, so that more samples at one place change nothing. Robots that are lost count
no longer, but for contacts, distances and clearances: there they are what the others must not touch.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from escort_mj.record.episodes import apart_from, by_geometry, during, pair
from escort_mj.record.evenness import energy_ratios, lost
from escort_mj.record.means import mean
from escort_mj.signals import CAUSES

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded

SETTLED = 0.05  # of the radius
SHORT = "the window holds a single sample"
ALONE = "there is one robot"
LEFT_ALONE = "a single robot is left"
UNOBSTRUCTED = "there are no obstacles"
SHAPELESS = "the mission has no formation"
BROKEN = "a robot was lost before, and the others stand in another formation"
UNKNOWN = "the least energy of so many robots was not looked for"
FORCELESS = "touches were found by geometry, which knows no force"
UNTOLD = "the truth was not recorded (recording.truth)"
NO_LYAPUNOV = "the Lyapunov function belongs to the sliding-mode laws"


Bodies = tuple[str, ...]


class Measure(NamedTuple):
    """The value of a metric.

    Attributes:
        value: In the metric's unit; None where the metric says nothing of this run, infinite for "never".
        time: Moment of the worst value [s]; None where there is none.
        bodies: Names of the bodies that had it; empty where nobody in particular.
        reason: Why there is no value.
        broken: Whether that is an error of a plugin.
    """

    value: float | None
    time: float | None = None
    bodies: Bodies = ()
    reason: str = ""
    broken: bool = False

    @property
    def who(self) -> str:
        """The bodies in words."""
        return in_words(self.bodies)


def in_words(bodies: Bodies) -> str:
    """Names of bodies in a sentence: `robots 1 and 2`, `robot 1 and gate`."""
    bodies = tuple(dict.fromkeys(bodies))  # the same one in two parts: once
    numbers = [name.removeprefix("robot_") for name in bodies]
    if len(bodies) > 1 and all(number.isdigit() for number in numbers):
        return f"robots {' and '.join(numbers)}"
    return " and ".join(name.replace("robot_", "robot ") for name in bodies)


def radius_error(trace: Recorded) -> np.ndarray:
    """Signed | q - c | - radius, shape (time, robot) [m]; NaN where a robot is lost."""
    offset = trace["q"].values - trace["target_position"].values[:, None]
    return np.where(lost(trace), np.nan, np.linalg.norm(offset, axis=2) - trace.attrs["mission_radius"])


def spacing_error(trace: Recorded) -> np.ndarray | None:
    """Signed deviation of neighbors' distances from even, shape (time, edge) [m]; None without a formation.

    NaN from the first loss on, which is the end of this formation.
    """
    pairs = trace["neighbors"].values
    if not len(pairs):
        return None
    q = trace["q"].values
    apart = np.linalg.norm(q[:, pairs[:, 0] - 1] - q[:, pairs[:, 1] - 1], axis=2)
    return np.where(lost(trace).any(axis=1, keepdims=True), np.nan, apart - trace["spacing"].values)


def _at(trace: Recorded, values: np.ndarray, place: np.intp, name: Callable[[int], Bodies]) -> Measure:
    """The value at a flat place of values of shape (time, thing)."""
    row, column = divmod(int(place), values.shape[1])
    return Measure(float(values[row, column]), float(trace["time"][row]), name(column))


def _largest(trace: Recorded, values: np.ndarray, name: Callable[[int], Bodies]) -> Measure:
    """Largest of values of shape (time, thing), the first of equals; NaN is none."""
    return _at(trace, values, np.argmax(np.where(np.isnan(values), -np.inf, values)), name)


def _least(trace: Recorded, values: np.ndarray, name: Callable[[int], Bodies]) -> Measure:
    """Least of values of shape (time, thing), the first of equals."""
    return _at(trace, values, np.argmin(values), name)


def _robot(index: int) -> Bodies:
    return (f"robot_{index + 1}",)


def _nobody(index: int) -> Bodies:
    return ()


def _edge(trace: Recorded) -> Callable[[int], Bodies]:
    pairs = trace["neighbors"].values
    return lambda index: (f"robot_{pairs[index, 0]}", f"robot_{pairs[index, 1]}")


def radius_error_mean(trace: Recorded) -> Measure:
    """Mean of the absolute radius error."""
    return Measure(mean(trace, np.abs(radius_error(trace))))


def radius_error_max(trace: Recorded) -> Measure:
    """Largest absolute radius error."""
    return _largest(trace, np.abs(radius_error(trace)), _robot)


def settling_time(trace: Recorded) -> Measure:
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


def spacing_error_mean(trace: Recorded) -> Measure:
    """Mean absolute deviation of neighbors' distances from even."""
    error = spacing_error(trace)
    if error is None:
        return Measure(None, reason=SHAPELESS)
    return Measure(None, reason=BROKEN) if np.isnan(error).all() else Measure(mean(trace, np.abs(error)))


def spacing_error_max(trace: Recorded) -> Measure:
    """Largest absolute deviation of a neighbors' distance from even."""
    error = spacing_error(trace)
    if error is None:
        return Measure(None, reason=SHAPELESS)
    if np.isnan(error).all():
        return Measure(None, reason=BROKEN)
    return _largest(trace, np.abs(error), _edge(trace))


def energy_ratio(trace: Recorded) -> Measure:
    """Largest Coulomb energy of the directions of the robots that are left, over the least of that many."""
    ratios = energy_ratios(trace)
    if ratios is None:
        return Measure(None, reason=ALONE if trace.sizes["robot"] == 1 else UNKNOWN)
    if np.isnan(ratios).all():
        return Measure(None, reason=LEFT_ALONE)
    return _largest(trace, ratios[:, None], _nobody)


def _rms(trace: Recorded, name: str) -> Measure:
    """Root mean square of a vector's length over time and robots."""
    square = np.where(lost(trace), np.nan, (trace[name].values ** 2).sum(axis=2))
    return Measure(math.sqrt(mean(trace, square)))


def tracking_error_rms(trace: Recorded) -> Measure:
    """Root mean square of |e|."""
    return _rms(trace, "e")


def velocity_error_rms(trace: Recorded) -> Measure:
    """Root mean square of |e_dot|."""
    return _rms(trace, "e_dot")


def _gained(trace: Recorded, name: str) -> float | None:
    """What a running total gained over the window, sum over robots; None for a window of one sample."""
    if trace.sizes["time"] < 2:
        return None
    total, last = trace[name].values, _last(trace)
    return float((total[last, np.arange(len(last))] - total[0]).sum())


def _rate(trace: Recorded, name: str) -> float | None:
    """What a running total gained per second, mean over robots; None for a window of one sample."""
    gained, time = _gained(trace, name), trace["time"].values
    return None if gained is None else gained / float((time[_last(trace)] - time[0]).sum())


def _last(trace: Recorded) -> np.ndarray:
    """The last sample in which each robot was not lost, the first if it always was, shape (robot,)."""
    return np.maximum((~lost(trace)).sum(axis=0) - 1, 0)


def force_rms(trace: Recorded) -> Measure:
    """Root mean square of a robot's force, from the running total of its square."""
    rate = _rate(trace, "effort")
    return Measure(None, reason=SHORT) if rate is None else Measure(math.sqrt(rate))


def chattering(trace: Recorded) -> Measure:
    """Total variation of force per second, mean over robots."""
    rate = _rate(trace, "force_variation")
    return Measure(None, reason=SHORT) if rate is None else Measure(rate)


def outer_update_rate(trace: Recorded) -> Measure:
    """Runs of the outer loop per second, mean over robots."""
    rate = _rate(trace, "outer_updates")
    return Measure(None, reason=SHORT) if rate is None else Measure(rate)


def energy(trace: Recorded) -> Measure:
    """Integral of |force . velocity|, sum over robots."""
    gained = _gained(trace, "work")
    return Measure(None, reason=SHORT) if gained is None else Measure(gained)


def obstacle_distance_min(trace: Recorded) -> Measure:
    """Least distance robot to obstacle, center to center."""
    if not trace.sizes["obstacle"]:
        return Measure(None, reason=UNOBSTRUCTED)
    distances = trace["obstacle_distance"].values
    names, count = trace["obstacle"].values, trace.sizes["obstacle"]
    flat = distances.reshape(len(distances), -1)
    return _least(trace, flat, lambda index: (*_robot(index // count), str(names[index % count])))


def _clearance(trace: Recorded, group: str, reason: str) -> Measure:
    """Least clearance of robots to a group, watched at every physics step."""
    column = [str(name) for name in trace["group"].values].index(group)
    values = trace["clearance"].values[:, :, column]
    if not np.isfinite(values).any():
        return Measure(None, reason=reason)
    nearest = trace["clearance_body"].values[:, :, column]
    row, robot = np.unravel_index(np.argmin(values), values.shape)
    who = (*_robot(int(robot)), str(trace["body"].values[nearest[row, robot]]))
    return Measure(float(values[row, robot]), float(trace["time"][row]), who)


def obstacle_clearance_min(trace: Recorded) -> Measure:
    """Least distance robot to obstacle, surface to surface, at any physics step."""
    return _clearance(trace, "obstacles", UNOBSTRUCTED)


def robot_distance_min(trace: Recorded) -> Measure:
    """Least distance between two robots, center to center."""
    name = "robot_distance_min"
    return _least(trace, trace[name].values, _robot) if name in trace else Measure(None, reason=ALONE)


def robot_clearance_min(trace: Recorded) -> Measure:
    """Least distance between two robots, surface to surface, at any physics step."""
    return _clearance(trace, "robots", ALONE)


def saturated_share(trace: Recorded) -> Measure:
    """Share of time in which a robot's motor was at its limit, mean over robots."""
    rate = _rate(trace, "saturated_time")
    return Measure(None, reason=SHORT) if rate is None else Measure(rate)


def _touches(trace: Recorded) -> Recorded:
    """Episodes within the trace's samples between bodies other than the floor."""
    time = trace["time"].values
    found = during(trace, float(time[0]), float(time[-1]))
    apart = apart_from(found, "floor")
    return found if apart.all() else found.isel(episode=apart)


def contacts(trace: Recorded) -> Measure:
    """Touches in the window: those under way when it begins, and those begun in it."""
    found = _touches(trace)
    count = found.sizes["episode"]
    if not count:
        return Measure(0.0)
    return Measure(
        float(count), max(float(found["episode_start"][0]), float(trace["time"][0])), pair(found, 0)
    )


def contact_force_max(trace: Recorded) -> Measure:
    """Largest normal force of the touches in the window."""
    found = _touches(trace)
    if by_geometry(found).any():
        return Measure(None, reason=FORCELESS)
    forces = found["episode_peak_force"].values
    if not forces.any():
        return Measure(0.0)
    hardest = int(np.argmax(forces))
    return Measure(float(forces[hardest]), float(found["episode_peak_time"][hardest]), pair(found, hardest))


def contacts_untold(trace: Recorded) -> Measure:
    """Contacts that the log had no room for."""
    total = trace["contacts_untold"].values
    return Measure(float(total[-1] - total[0]))


def tunneling(trace: Recorded) -> Measure:
    """Most that two bodies can close in a step, over the thickness of the thinnest body.

    At most the sum of the two largest displacements in a physics step among robots, target and obstacles. It
    is of the fastest and the thinnest, so that it bounds what any two bodies can do.
    """
    moving = ("speed_max", "target_speed_max", "obstacle_speed_max")
    speeds = np.column_stack([trace[name].values for name in moving])
    steps = np.sort(speeds, axis=1)[:, -2:].sum(axis=1, keepdims=True) * trace.attrs["timestep"]
    thickness, names = trace["body_thickness"].values, trace["body"].values
    fastest = int(np.argmax(speeds[int(np.argmax(steps))]))
    bodies = str(names[fastest]), str(names[int(np.argmin(thickness))])
    return _largest(trace, steps / float(thickness.min()), lambda index: bodies)


def kinetic_energy_max(trace: Recorded) -> Measure:
    """Largest kinetic energy of all that moves freely."""
    return _largest(trace, trace["kinetic_energy"].values[:, None], _nobody)


def _eigenvalues(trace: Recorded) -> np.ndarray:
    """Eigenvalues of each robot's mass matrix, ascending, shape (time, robot, axis) [kg]."""
    return np.linalg.eigvalsh(trace["mass_matrix"].values)


def mass_eigenvalue_min(trace: Recorded) -> Measure:
    """Least eigenvalue of a robot's mass matrix."""
    if "mass_matrix" not in trace:
        return Measure(None, reason=UNTOLD)
    return _least(trace, _eigenvalues(trace)[..., 0], _robot)


def mass_eigenvalue_max(trace: Recorded) -> Measure:
    """Largest eigenvalue of a robot's mass matrix."""
    if "mass_matrix" not in trace:
        return Measure(None, reason=UNTOLD)
    return _largest(trace, _eigenvalues(trace)[..., -1], _robot)


def skew_residual(trace: Recorded) -> Measure:
    """Largest symmetric part of dM/dt - 2 C."""
    return _residual(trace, "skew_residual")


def coriolis_residual(trace: Recorded) -> Measure:
    """Largest difference of C v + g from MuJoCo's bias force."""
    return _residual(trace, "coriolis_residual")


def _residual(trace: Recorded, name: str) -> Measure:
    """Largest of a residual of the truth channel."""
    return _largest(trace, trace[name].values, _robot) if name in trace else Measure(None, reason=UNTOLD)


def lyapunov_rise(trace: Recorded) -> Measure:
    """Largest rise of a robot's V1 above its least so far, without what the moving reference did to it."""
    if "lyapunov" not in trace:
        return Measure(None, reason=UNTOLD if "mass_matrix" not in trace else NO_LYAPUNOV)
    value = trace["lyapunov"].values - _changed_by(trace, "reference")
    value = np.where(lost(trace), np.nan, value)
    return _largest(trace, value - np.minimum.accumulate(value, axis=0), _robot)


def _changed_by(trace: Recorded, cause: str) -> np.ndarray:
    """Change of V1 so far by one cause, shape (time, robot) [J]."""
    return trace["lyapunov_change"].values[:, :, CAUSES.index(cause)]


def lyapunov_unexplained(trace: Recorded) -> Measure:
    """Sum over robots and samples of the absolute change of V1 that no known cause explains."""
    if "lyapunov" not in trace:
        return Measure(None, reason=UNTOLD if "mass_matrix" not in trace else NO_LYAPUNOV)
    total = np.where(lost(trace), np.nan, _changed_by(trace, "unexplained"))
    return (
        Measure(float(np.nansum(np.abs(np.diff(total, axis=0)))))
        if len(total) > 1
        else Measure(None, reason=SHORT)
    )
