"""Windows of time of a trace."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any, Literal, NamedTuple, cast, get_args

import numpy as np

from escort_mj.numerics.steps import SLACK
from escort_mj.record.recording import Part, Recorded, gaps_of

Over = Literal["whole", "tail"]
OVERS: tuple[Over, ...] = get_args(Over)
TAIL = 0.2
"""Share of a run that is its *tail*, which counts as its steady state: the last fifth."""
WORDS = {"whole": "whole run", "tail": "last fifth"}

NOTHING_YET: dict[str, Any] = {  # the worst, and whose, where nothing was watched since the previous sample
    "clearance": math.inf,
    "clearance_body": -1,
    "target_clearance": math.inf,
    "target_clearance_body": -1,
    "point_speed_max": 0.0,
    "target_speed_max": 0.0,
    "obstacle_speed_max": 0.0,
    "watch_count": 0.0,
}


class Span(NamedTuple):
    """A part of a run that something looks at: all of it, its tail, or what lies between two times.

    Attributes:
        over: `whole` or `tail`; None where the times say it.
        after: Start [s].
        before: End [s]; None for the end of the run.
    """

    over: Over | None = None
    after: float = 0.0
    before: float | None = None

    def bounds(self, end: float) -> tuple[float, float | None]:
        """Return its start and end in a run that ends at a time [s]; None for the end of the run."""
        return (1.0 - TAIL) * end if self.over == "tail" else self.after, self.before

    def of(self, trace: Part) -> Part:
        """Return the samples of a run that it looks at."""
        return window(trace, *self.bounds(end_of(trace)))

    @property
    def words(self) -> str:
        """What it is, as heads of tables say it."""
        return WORDS[self.over] if self.over else when(self.after, self.before).strip() or WORDS["whole"]

    @property
    def suffix(self) -> str:
        """What it is, as part of a name: `over_tail`, `after_20_before_40`."""
        if self.over or not (self.after or self.before):
            return f"over_{self.over or 'whole'}"
        return re.sub(r" s\b", "", when(self.after, self.before)).strip().replace(" ", "_")


def span_of(over: Over | None, after: float | None, before: float | None) -> Span | None:
    """Return the part of a run that is given by these keys; None where none is given."""
    return None if over is after is before is None else Span(over, after or 0.0, before)


def span_faults(over: Over | None, after: float | None, before: float | None) -> Iterator[str]:
    """Say what is wrong with a part of a run that is given by these keys; None for one that is not given."""
    times = " and ".join(key for key, time in (("after", after), ("before", before)) if time is not None)
    if over is not None and times:
        yield f"found over and {times}; a window is given by over, or by after and before"
    if before is not None and before <= (after or 0.0):
        yield f"its window is empty: after {after or 0.0:g} s and before {before:g} s"


def when(after: float, before: float | None) -> str:
    """Return a window of time in words, after a space; nothing for the whole run."""
    start = f" after {after:g} s" if after > 0.0 else ""
    return start + ("" if before is None else f" before {before:g} s")


def end_of(trace: Part) -> float:
    """Return the time of a trace's last sample [s]; 0 of none."""
    time = trace["time"].values
    return float(time[-1]) if len(time) else 0.0


def rate_of(trace: Recorded) -> float | None:
    """Return how many samples a trace has per second [1/s], most of the time; None of fewer than two."""
    time, timestep = trace["time"].values, float(trace.attrs["timestep"])
    steps = np.rint(np.diff(time) / timestep)
    return 1.0 / (float(np.sort(steps)[len(steps) // 2]) * timestep) if len(steps) else None


def window(trace: Part, after: float = 0.0, before: float | None = None) -> Part:
    """The samples of a window of time [s], its ends included.

    Where the first of them would tell of steps before the window, it tells of its own moment alone. The first
    sample after a gap of a log tells of nothing before it anyway.
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
    since_gap = np.abs(gaps_of(trace)[:, 1] - time[first]).min(initial=math.inf) < timestep
    looks_back = inside.any() and first > 0 and time[first - 1] + timestep < after - slack and not since_gap
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
