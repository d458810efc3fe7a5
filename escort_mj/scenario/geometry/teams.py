"""Targets of teams as bodies, and where the middle of those of a team is at the start."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from escort_mj.palette import TEAMS
from escort_mj.scenario.geometry.obstacle_body import Body
from escort_mj.scenario.geometry.trajectory import trajectory
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.scenario.schema.teams import Team, TeamTarget

Array = NDArray[np.float64]


def team_targets(scenario: Scenario) -> Iterator[Body]:
    """Yield the targets of the teams of a scenario, in the order in which traces number them."""
    for index, team in enumerate(scenario.teams):
        for place, target in enumerate(team.targets):
            yield Body(
                name=target.name,
                group="obstacles",
                shape="sphere",
                size=(target.radius,),
                position=trajectory(target, scenario.axes).position(0.0),
                bounding_radius=target.radius,
                path=("teams", index, "targets", place),
                motion=target,
                drive=target.body,
                policy=target.policy,
                color=TEAMS[index % len(TEAMS)],
            )


def escort_of(team: Team, target: TeamTarget, time: float) -> str | None:
    """Return the name of the team that escorts a target at a time; None for none.

    Args:
        team: Which lists it.
        target: The target.
        time: When [s].
    """
    return ([team.name] + [each.team for each in target.escorted_by if each.after <= time])[-1]


def team_center(scenario: Scenario, name: str) -> Array:
    """Return the middle of the targets of a team, by its name, at the start, shape (p,) [m]."""
    places = [
        trajectory(target, scenario.axes).position(0.0)
        for team in scenario.teams
        for target in team.targets
        if escort_of(team, target, 0.0) == name
    ]
    return np.asarray(np.mean(places, axis=0))
