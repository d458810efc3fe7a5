"""Windows of time of a trace."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from escort_mj.numerics.steps import SLACK

if TYPE_CHECKING:
    from escort_mj.record.recording import Part

NOTHING_YET: dict[str, Any] = {  # the worst, and whose, where nothing was watched since the previous sample
    "clearance": math.inf,
    "clearance_body": -1,
    "target_clearance": math.inf,
    "target_clearance_body": -1,
    "target_speed_max": 0.0,
    "obstacle_speed_max": 0.0,
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
