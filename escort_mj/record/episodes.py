"""Contact episodes: one row per unbroken touch of one pair of bodies, watched at every physics step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]


class Quantity(NamedTuple):
    """One column of the log.

    Attributes:
        name: Variable name in the trace.
        unit: SI unit, `1` for none.
        meaning: One sentence for the trace's attributes.
    """

    name: str
    unit: str
    meaning: str


COLUMNS = (
    Quantity("episode_first", "1", "the body that touches, as an index into `body`"),
    Quantity("episode_second", "1", "the body that it touches, the later one in `body`"),
    Quantity("episode_start", "s", "time of the first physics step in which they touch"),
    Quantity("episode_end", "s", "end of the last physics step in which they touch"),
    Quantity("episode_touch_time", "s", "physics steps in which they touch, times the timestep"),
    Quantity("episode_peak_force", "N", "largest normal force of a physics step, all contact points summed"),
    Quantity("episode_peak_time", "s", "time of that step"),
    Quantity("episode_impulse", "N s", "sum of normal force times timestep"),
    Quantity("episode_depth", "m", "largest penetration"),
    Quantity("episode_closing_speed", "m/s", "speed along the normal at which they meet, in the first step"),
)
FIRST, SECOND, START, END, TOUCH_TIME, PEAK_FORCE, PEAK_TIME, IMPULSE, DEPTH, CLOSING_SPEED = range(
    len(COLUMNS)
)
WHOLE = ("episode_first", "episode_second")
NONE: Array = np.zeros((0, len(COLUMNS)))
"""No episode at all."""


def episode_variables(episodes: Array) -> dict[str, Any]:
    """Variables of a trace, dimension `episode`, by time of the first touch.

    Args:
        episodes: Shape (k, len(COLUMNS)), in any order.
    """
    order = np.lexsort((episodes[:, SECOND], episodes[:, FIRST], episodes[:, START]))
    return {
        column.name: (
            "episode",
            episodes[order, place].astype("int32" if column.name in WHOLE else "float64"),
            {"units": column.unit, "long_name": column.meaning},
        )
        for place, column in enumerate(COLUMNS)
    }


def during(trace: xarray.Dataset, start: float, end: float) -> xarray.Dataset:
    """The episodes that have a step within a stretch of time [s], its ends included."""
    half = 0.5 * float(trace.attrs["timestep"])
    inside = (trace["episode_start"].values < end + half) & (trace["episode_end"].values > start + half)
    return trace[[column.name for column in COLUMNS]].isel(episode=inside)


def of_groups(trace: xarray.Dataset, *without: str) -> NDArray[np.bool_]:
    """Whether neither body of an episode is of one of these groups, shape (episode,)."""
    known = ~np.isin(trace["body_group"].values, without)
    allowed: NDArray[np.bool_] = known[trace["episode_first"].values] & known[trace["episode_second"].values]
    return allowed


def pair(trace: xarray.Dataset, episode: int) -> str:
    """The two bodies of an episode in words: `robot_1 and gate`."""
    names = trace["body"].values
    first, second = (int(trace[name][episode]) for name in WHOLE)
    return f"{names[first]} and {names[second]}"


def touched(trace: xarray.Dataset) -> NDArray[np.bool_]:
    """Whether each robot touched something other than the floor since the previous sample, shape (T, n)."""
    time, robots, step = trace["time"].values, trace.sizes["robot"], float(trace.attrs["timestep"])
    flags = np.zeros((len(time), robots), dtype=bool)
    start, end = trace["episode_start"].values, trace["episode_end"].values
    for episode in np.flatnonzero(of_groups(trace, "floor")):
        first = int(np.searchsorted(time, start[episode] - 0.5 * step))
        last = int(np.searchsorted(time, end[episode] - 1.5 * step))  # of its last step, or the next one
        for name in WHOLE:
            body = int(trace[name].values[episode])
            if body < robots:
                flags[first : last + 1, body] = True
    return flags
