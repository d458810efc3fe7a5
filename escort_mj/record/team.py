"""One team of a mission with several: the trace as if its members were all robots, and its targets one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.record.recording import NOT_LOGGED, not_logged, sealed

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded, Recording


def team_names(trace: Recorded) -> list[str]:
    """Return the names of the teams; none where all robots are one team."""
    return [*map(str, trace["team"].values)] if "team" in trace else []


def own_targets(trace: Recorded) -> NDArray[np.float64]:
    """Return where each robot's target is, or the middle of its team's, shape (time, robot, axis) [m]."""
    if "member_of" not in trace:
        return np.broadcast_to(trace["target_position"].values[:, None], trace["q"].values.shape)
    rows = np.arange(trace.sizes["time"])[:, None]
    return np.asarray(trace["team_center"].values[rows, trace["member_of"].values.astype(int) - 1])


def kept_radius(trace: Recorded) -> NDArray[np.float64]:
    """Return the distance to keep from the target, of a team in a trace `of_team`, shape (time,) [m]."""
    if "team_radius" in trace:
        return trace["team_radius"].values
    return np.full(trace.sizes["time"], float(trace.attrs["mission_radius"]))


def of_team(trace: Recorded, name: str) -> Recording:
    """Return a trace as one team has it: robots of other teams count as lost.

    The middle of its targets is the target, with the radius of the largest of them. The formation has no
    neighbors where members come or go, or the radius changes.

    Args:
        trace: The whole trace.
        name: Of the team.
    """
    trace, place = sealed(trace), team_names(trace).index(name)
    member = trace["member_of"].values == place + 1
    pairs = trace["neighbors"].values - 1
    radius = trace["team_radius"].values[:, place]
    steady = (radius == radius[:1]).all()
    kept = steady & (member == member[:1]).all() & member[:1].all(axis=0)[pairs].all(axis=1)
    part = trace.isel(edge=kept).assign(
        lost=(("time", "robot"), np.maximum(trace["lost"].values, ~member)),
        team_radius=("time", radius),
    )
    missing = not_logged(trace)
    if "team_center" in missing:
        missing |= {"target_position", "target_velocity"}
        known = {name: one for name, one in part.data_vars.items() if name not in missing}
        part = replace(part, data_vars=known)
    else:
        part = part.assign(
            target_position=(("time", "axis"), trace["team_center"].values[:, place]),
            target_velocity=(("time", "axis"), trace["team_velocity"].values[:, place]),
        )
    sizes = {
        "mission_radius": float(radius.max(initial=0.0)),
        "target_radius": float(
            trace["obstacle_radius"]
            .values[(trace["obstacle_team"].values == place + 1).any(axis=0)]
            .max(initial=0.0)
        ),
    }
    return replace(part, attrs={**trace.attrs, **sizes, NOT_LOGGED: " ".join(sorted(missing))})
