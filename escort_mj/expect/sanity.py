"""Can the simulation itself be trusted? One function per check."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from escort_mj.record.measures import Bodies, in_words
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.expectations import SanityCheck

if TYPE_CHECKING:
    import xarray

MAY_BE_INFINITE = ("clearance", "target_clearance")  # where there is nothing to be clear of


@dataclass(frozen=True)
class Report:
    """What one check found.

    Attributes:
        held: Whether all is well.
        words: What was found.
        value: Worst value, where there is one.
        unit: Its unit.
        time: When it was found [s].
        bodies: Names of the bodies that had it.
        margin: Distance from the bound, negative beyond it.
        room: The margin as a share of the bound.
    """

    held: bool
    words: str
    value: float | None = None
    unit: str = ""
    time: float | None = None
    bodies: Bodies = ()
    margin: float | None = None
    room: float = math.inf


def sanity(check: SanityCheck, trace: xarray.Dataset, outcome: Outcome) -> Report:
    """Looks at one kind of trouble.

    Args:
        check: Which.
        trace: A trace, or a window of one, with a sample at least.
        outcome: How the run ended.
    """
    if check == "warnings":
        return _warnings(outcome)
    if check == "finite":
        return _finite(trace, outcome)
    return _energy(trace) if check == "energy" else _tunneling(trace)


def _warnings(outcome: Outcome) -> Report:
    """MuJoCo did not warn; a run that it warned in ends as unstable."""
    if outcome is Outcome.UNSTABLE:
        return Report(False, "MuJoCo warned")
    return Report(True, "no warning")


def _finite(trace: xarray.Dataset, outcome: Outcome) -> Report:
    """Every recorded number is one, and the run did not diverge."""
    for name, variable in trace.data_vars.items():
        if variable.dtype.kind != "f" or "time" not in variable.dims:
            continue
        wrong = np.isnan(variable.values) if name in MAY_BE_INFINITE else ~np.isfinite(variable.values)
        if wrong.any():
            time = float(trace["time"][np.argmax(wrong.reshape(len(wrong), -1).any(axis=1))])
            return Report(False, f"{name} is no finite number at {time:.2f} s", time=time)
    if outcome is Outcome.DIVERGED:
        return Report(False, "the run diverged")
    return Report(True, "all numbers finite")


def _energy(trace: xarray.Dataset) -> Report:
    """Motion has no more energy than was put into it: by motors, disturbance, gravity, medium and touches.

    Each of these is bounded from above: gravity and disturbance as if they pulled along the motion, the
    medium as if it gave every robot the speed of the wind, and a touch as if its impulse came from a body as
    fast as the fastest robot and the closing speed together. Twice that is allowed, and what one step adds
    from rest.
    """
    mass, speed, time = trace["robot_mass"].values, trace["speed_max"].values, trace["time"].values
    gravity, wind = (float(trace.attrs.get(name, 0.0)) for name in ("gravity", "wind"))
    force, pull, start = (
        np.linalg.norm(trace[name].values, axis=-1) for name in ("force", "disturbance", "v")
    )
    step = (force.max(axis=0) + mass * gravity) * float(trace.attrs["timestep"])
    path = speed * np.diff(time, prepend=time[0])[:, None]
    given = 0.5 * mass * (start[0] ** 2 + wind**2) + 0.5 * step**2 / mass
    given = given + trace["work"].values - trace["work"].values[0]
    given = (given + np.cumsum((pull + mass * gravity) * path, axis=0)).sum(axis=1)
    pushed = trace["episode_impulse"].values * (trace["episode_closing_speed"].values + speed.max())
    given = 2.0 * (given + (time[:, None] >= trace["episode_start"].values) @ pushed)
    kinetic = 0.5 * mass * speed**2
    total = kinetic.sum(axis=1)
    room = 1.0 - total / np.maximum(given, 1e-300)
    row = int(np.argmin(room))
    robot = (f"robot_{int(np.argmax(kinetic[row])) + 1}",)
    margin = float(given[row] - total[row])
    words = f"kinetic energy {total[row]:.3g} J of at most {given[row]:.3g} J at {time[row]:.2f} s"
    return Report(
        margin >= 0.0, words, float(total[row]), "J", float(time[row]), robot, margin, float(room[row])
    )


def _tunneling(trace: xarray.Dataset) -> Report:
    """No two bodies come nearer in one step than the thinnest body is thick: none can pass through another.

    The closing speed is bounded by the sum of the two largest speeds of all bodies.
    """
    speed = trace["speed_max"].values
    target = np.linalg.norm(trace["target_velocity"].values, axis=-1)
    names = [f"robot_{robot + 1}" for robot in range(speed.shape[1])] + ["target"]
    every = np.column_stack([speed, target])
    two = np.partition(np.column_stack([every, np.zeros(len(every))]), -2, axis=1)[:, -2:].sum(axis=1)
    row = int(np.argmax(two))
    step = float(two[row]) * float(trace.attrs["timestep"])
    thickness = np.concatenate(
        [
            2.0 * trace["robot_radius"].values,
            [2.0 * float(trace.attrs["target_radius"])],
            2.0 * trace["obstacle_radius"].values,
        ]
    )
    thinnest = float(thickness.min())
    bodies = (names[int(np.argmax(every[row]))], str(trace["body"].values[int(np.argmin(thickness))]))
    time = float(trace["time"][row])
    words = (
        f"bodies come nearer by up to {1e3 * step:.3g} mm a step at {time:.2f} s, {in_words(bodies[:1])} "
        f"the fastest; the thinnest, {in_words(bodies[1:])}, is {1e3 * thinnest:.3g} mm"
    )
    margin = thinnest - step
    return Report(margin >= 0.0, words, step, "m", time, bodies, margin, margin / thinnest)
