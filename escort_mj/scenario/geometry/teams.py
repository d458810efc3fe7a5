"""Targets of teams as bodies, and where the middle of those of a team is at the start."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from escort_mj.palette import TEAMS
from escort_mj.scenario.geometry.obstacle_body import Body
from escort_mj.scenario.geometry.trajectory import trajectory
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.scenario.schema.teams import Team

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


def team_center(team: Team, axes: int) -> Array:
    """Return the middle of a team's targets at the start, shape (p,) [m]."""
    places = [trajectory(target, axes).position(0.0) for target in team.targets]
    return np.asarray(np.mean(places, axis=0))
