"""One team of a mission with several: the trace as if its members were all robots, and its targets one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from escort_mj.record.recording import NOT_LOGGED, Recorded, Recording, Variable, not_logged, sealed


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
    """Return the distance that each robot is to keep from its target at the time, shape (time, robot) [m]."""
    if "kept_radius" in trace:
        return trace["kept_radius"].values
    shape = trace.sizes["time"], trace.sizes["robot"]
    if "team_radius" not in trace:
        return np.full(shape, float(trace.attrs["mission_radius"]))
    radius = trace["team_radius"].values
    if radius.ndim == 1:  # that of one team, in its own trace
        return np.broadcast_to(radius[:, None], shape)
    return np.asarray(np.take_along_axis(radius, trace["member_of"].values.astype(int) - 1, axis=1))


def rings(kept: NDArray[np.float64], lost: NDArray[np.bool_]) -> list[float]:
    """Return the distances that the robots of one moment keep from their target, each once, ascending [m].

    Args:
        kept: Shape (robot,) [m].
        lost: Who is left out, unless all are, shape (robot,).
    """
    return np.unique(kept[~lost if not lost.all() else lost].round(9)).tolist()


def of_team(trace: Recorded, name: str) -> Recording:
    """Return a trace as one team has it: robots of other teams count as lost.

    The middle of its targets is the target, with the radius of the largest of them. Neighbors are those of
    its own formation.

    Args:
        trace: The whole trace.
        name: Of the team.
    """
    trace, place = sealed(trace), team_names(trace).index(name)
    member = trace["member_of"].values == place + 1
    radius = trace["team_radius"].values[:, place]
    part = trace.isel(edge=_edges_of(trace, place, member)).assign(
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
    if "watch" in trace:
        labels, before = trace["watch"].values.tolist(), f"{name}."
        own = np.array([label.startswith(before) for label in labels])
        part = part.isel(watch=own)
        called = [label.removeprefix(before) for label in labels if label.startswith(before)]
        part = replace(part, coords={**part.coords, "watch": Variable("watch", np.array(called, str), {})})
    sizes = {
        "mission_radius": float(radius.max(initial=0.0)),
        "target_radius": float(
            trace["obstacle_radius"]
            .values[(trace["obstacle_team"].values == place + 1).any(axis=0)]
            .max(initial=0.0)
        ),
    }
    return replace(part, attrs={**trace.attrs, **sizes, NOT_LOGGED: " ".join(sorted(missing))})


def _edges_of(trace: Recording, place: int, member: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which pairs of neighbors are in the formation of a team, shape (edge,).

    Args:
        trace: The whole trace.
        place: Of the team, from 0.
        member: Which robots are in it, shape (time, robot).
    """
    if "edge_team" in trace:
        return np.asarray(trace["edge_team"].values == place + 1)
    pairs, radius = trace["neighbors"].values - 1, trace["team_radius"].values[:, place]
    if (radius != radius[:1]).any() or (member != member[:1]).any():  # the trace does not say more
        return np.zeros(len(pairs), dtype=np.bool_)
    together = np.asarray(member[:1].all(axis=0))
    return np.asarray(together[pairs].all(axis=1))
