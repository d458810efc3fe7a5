"""Contact episodes: one row per unbroken touch of one pair of bodies, watched at every physics step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.numerics.steps import SLACK
from escort_mj.record.recording import Recorded

Array = NDArray[np.float64]

BODIES = ("episode_first", "episode_second")


def during(trace: Recorded, start: float, end: float) -> Recorded:
    """The episodes that have a step within a stretch of time [s], its ends included."""
    if not len(trace["episode_start"].values):
        return trace
    timestep = float(trace.attrs["timestep"])
    slack = SLACK * timestep
    last = trace["episode_end"].values - timestep
    inside = (trace["episode_start"].values <= end + slack) & (last >= start - slack)
    return trace.isel(episode=inside)


def apart_from(trace: Recorded, *groups: str) -> NDArray[np.bool_]:
    """Whether neither body of an episode is of one of these groups, shape (episode,)."""
    others = ~np.isin(trace["body_group"].values, groups)
    apart: NDArray[np.bool_] = others[trace["episode_first"].values] & others[trace["episode_second"].values]
    return apart


def without_forces(trace: Recorded) -> bool:
    """Whether MuJoCo has no contacts at all in a mission, because it has more than three axes."""
    return str(trace.attrs.get("contact_forces", "")).startswith("none")


def moving_as(trace: Recorded, motion: str) -> NDArray[np.bool_]:
    """Whether each body moves in a way, see `scenario.bodies`, shape (body,); traces of old do not say."""
    names = "body_motion" if "body_motion" in trace else "body"
    found: NDArray[np.bool_] = trace[names].values == motion
    return found


def by_geometry(trace: Recorded) -> NDArray[np.bool_]:
    """Whether each episode was found by geometry alone, without forces, shape (episode,).

    So are those of a target that is led with what stands, and all beyond three axes.
    """
    first, second = (trace[name].values for name in BODIES)
    if without_forces(trace):
        return np.ones(len(first), dtype=bool)
    led, still = moving_as(trace, "led"), moving_as(trace, "still")
    found: NDArray[np.bool_] = (led[first] & still[second]) | (still[first] & led[second])
    return found


def pair(trace: Recorded, episode: int) -> tuple[str, str]:
    """Names of the two bodies of an episode."""
    first, second = (str(trace["body"].values[int(trace[name][episode])]) for name in BODIES)
    return first, second


def touched(trace: Recorded) -> NDArray[np.bool_]:
    """Whether each robot touched something other than the floor since the previous sample, shape (T, n)."""
    time, robots, step = trace["time"].values, trace.sizes["robot"], float(trace.attrs["timestep"])
    flags = np.zeros((len(time), robots), dtype=bool)
    start, end = trace["episode_start"].values, trace["episode_end"].values
    for episode in np.flatnonzero(apart_from(trace, "floor")):
        first = int(np.searchsorted(time, start[episode] - 0.5 * step))
        last = int(np.searchsorted(time, end[episode] - 1.5 * step))  # of its last step, or the next one
        for name in BODIES:
            body = int(trace[name].values[episode])
            if body < robots:
                flags[first : last + 1, body] = True
    return flags
