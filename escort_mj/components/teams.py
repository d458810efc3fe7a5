"""Teams with targets of their own: which robot is in which, and how far from its target it stays."""

from __future__ import annotations

from typing import Annotated, Any

from escort_mj.components.setup import MissionSetup
from escort_mj.native.fields import Array, Fields, Recorded, Value
from escort_mj.native.kernels import inlined
from escort_mj.native.lanes import Lanes, everywhere, greatest, load
from escort_mj.native.vectors import Vec, rows_from
from escort_mj.plan import Plan, State


class TeamParameters(Fields):
    """Teams with targets of their own; none where all robots are one team."""

    apart: Annotated[
        bool,
        Value("1", "whether robots have targets and teammates each by itself: of its team, or as it knows"),
    ]
    team_radius: Annotated[Array, "teams", Value("m", "distance to keep from its targets at the start")]
    team_start: Annotated[Array, "members", Value("1", "team of each robot at the start, from 1")]
    target_team: Annotated[Array, "targets", Value("1", "team of each target at the start, from 1")]
    target_obstacle: Annotated[Array, "targets", Value("1", "which obstacle it is, from 0")]
    demand_team: Annotated[Array, "demands", Value("1", "team, from 1; those of a team in order of time")]
    demand_after: Annotated[Array, "demands", Value("s", "from when on")]
    demand_robots: Annotated[Array, "demands", Value("1", "how many robots it needs")]
    circle_team: Annotated[Array, "circles", Value("1", "team, from 1; those of a team in order of time")]
    circle_after: Annotated[Array, "circles", Value("s", "from when on")]
    circle_radius: Annotated[Array, "circles", Value("m", "distance that it keeps then")]
    escort_target: Annotated[Array, "escorts", Value("1", "target, from 0; those of one in order of time")]
    escort_after: Annotated[Array, "escorts", Value("s", "from when on")]
    escort_team: Annotated[Array, "escorts", Value("1", "team that escorts it, from 1; 0 for none")]

    @classmethod
    def packed(cls, setup: MissionSetup) -> dict[str, Any]:
        """Return the values of the fields for a mission."""
        numbered = [*enumerate(setup.teams, 1)]
        numbers = {team.name: number for number, team in numbered}
        demands = [(number, each) for number, team in numbered for each in team.demand]
        circles = [(number, each) for number, team in numbered for each in team.radii]
        targets = [(number, target) for number, team in numbered for target in team.targets]
        escorts = [(place, each) for place, (_, target) in enumerate(targets) for each in target.escorted_by]
        return {
            "apart": setup.apart,
            "team_radius": [setup.radii_of(team)[0] for team in setup.teams],
            "team_start": [*setup.members + 1] if setup.teams else [],
            "target_team": [number for number, _ in targets],
            "target_obstacle": [place for places in setup.target_places for place in places],
            "demand_team": [number for number, _ in demands],
            "demand_after": [each.after for _, each in demands],
            "demand_robots": [each.robots for _, each in demands],
            "circle_team": [number for number, _ in circles],
            "circle_after": [each.after for _, each in circles],
            "circle_radius": [each.radius for _, each in circles],
            "escort_target": [place for place, _ in escorts],
            "escort_after": [each.after for _, each in escorts],
            "escort_team": [numbers.get(each.team, 0) for _, each in escorts],
        }


class TeamSignals(Fields):
    """Who is in which team, which targets it has, and where they are; recorded where there are teams."""

    member_of: Annotated[Array, "members", Recorded("1", "team of the robot, from 1", "int8")]
    obstacle_team: Annotated[
        Array, "escorted", Recorded("1", "team that escorts the obstacle, from 1; 0 for none", "int8")
    ]
    team_center: Annotated[Array, "teams", "p", Recorded("m", "middle of the targets of each team")]
    team_radius: Annotated[
        Array, "teams", Recorded("m", "distance that each team keeps from the middle of its targets")
    ]
    team_velocity: Annotated[Array, "teams", "p", Recorded("m/s", "velocity of `team_center`")]


class TeamState(Fields):
    """What changes where robots move from one team to another."""

    own_radius: Annotated[Array, "members", Value("m", "distance that a robot keeps from its team's targets")]
    missed: Annotated[Array, "members", Value("1", "1 for lost robots whose teams have closed ranks")]
    team_left: Annotated[Array, "teams", Value("1", "members that are not lost")]
    team_formed: Annotated[
        Array, "teams", Value("1", "step in which members last came, went or were lost; -1 for none")
    ]
    team_aimed: Annotated[Array, "teams", Value("1", "step in which its targets last changed; -1 for none")]
    told: Annotated[Array, "members", Value("1", "1 for robots that have other targets from this step on")]


@inlined
def team_of(target: int, plan: Plan, state: State) -> int:
    """Return the team that escorts a target of teams now, from 1; 0 for none.

    Args:
        target: Which target of teams, from 0.
        plan: Gives who escorts it when.
        state: Gives the time.
    """
    time, found = state.time[0] + 0.5 * plan.timestep, plan.target_team[target]
    for e in range(plan.escort_target.shape[0]):
        if plan.escort_target[e] == target and plan.escort_after[e] <= time:
            found = plan.escort_team[e]
    return int(found)


@inlined
def of_teams(i: int, table: Array, state: State) -> Vec:
    """Return the rows of a table of teams that robots i to i + 7 are in."""
    return rows_from(state, table, greatest(load(state.member_of, i) - 1.0, 0.0))


@inlined
def radius_rows(i: int, plan: Plan, state: State) -> Lanes:
    """Return the distances that robots i to i + 7 keep from their targets [m]."""
    if plan.team_radius.shape[0] > 0:
        own: Lanes = load(state.own_radius, i)
        return own
    return everywhere(plan.radius)


@inlined
def radius_of(robot: int, plan: Plan, state: State) -> float:
    """Return the distance that a robot keeps from its target [m]."""
    return state.own_radius[robot] if plan.team_radius.shape[0] > 0 else plan.radius
