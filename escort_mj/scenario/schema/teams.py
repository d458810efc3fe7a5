"""Tables of teams: robots that escort targets of their own."""

from typing import Annotated

from pydantic import Field, NonNegativeFloat, PositiveInt

from escort_mj.components.parameters import Parameters, Radius
from escort_mj.scenario.schema.fields import Law, Policy
from escort_mj.scenario.schema.obstacle_tables import Drive, Motion, Name
from escort_mj.scenario.schema.robots import MAX_ROBOTS

MOST_TEAMS = 20
MOST_TARGETS = 20


class Escort(Parameters):
    """Team that escorts a target from a given time on."""

    after: NonNegativeFloat = 0.0
    """Time from which the team escorts the target [s]."""
    team: Name | None
    """Name of the team; null: no team."""


class TeamTarget(Motion):
    """A target of a team. It follows its path or a policy, and counts among the obstacles."""

    name: Name
    """Name in figures and verdicts."""
    radius: Radius = 0.3
    """Radius of the body [m]."""
    body: Drive = Drive()
    """Mass and drive of the body."""
    policy: Policy | None = None
    """Policy of the target; null: it follows its path. With a policy, the target starts at `position`."""
    escorted_by: Annotated[tuple[Escort, ...], Field(max_length=100)] = ()
    """Teams that escort the target, each from a given time on; before the first time, the team that lists the
    target escorts it."""


class Demand(Parameters):
    """Number of robots that a team needs from a given time on."""

    after: NonNegativeFloat = 0.0
    """Time from which the team needs the robots [s]."""
    robots: PositiveInt
    """Number of robots that the team needs."""


class Circle(Parameters):
    """Distance of a team from its targets, valid from a given time on."""

    after: NonNegativeFloat
    """Time from which the distance applies [s]."""
    radius: Radius
    """Distance of the robots from the middle of the targets [m]."""


class Team(Parameters):
    """Robots that escort the same targets."""

    name: Name
    """Name in figures and verdicts."""
    robots: Annotated[tuple[PositiveInt, ...], Field(min_length=1, max_length=MAX_ROBOTS)]
    """Initial members: numbers of robots, from 1."""
    targets: Annotated[tuple[TeamTarget, ...], Field(min_length=1, max_length=MOST_TARGETS)]
    """Targets of the team; the robots surround the middle of these targets. Targets can change teams."""
    radius: Radius | None = None
    """Distance of the robots from the middle of the targets [m]; null: `mission.radius`."""
    radii: Annotated[tuple[Circle, ...], Field(max_length=100)] = ()
    """Distances that replace `radius`, each from a given time on, for example when targets join."""
    controller: Law | None = None
    """Law of the team: a name, or a table with gains, as in `controller`; null: that of the scenario."""
    demand: Annotated[tuple[Demand, ...], Field(max_length=100)] = ()
    """Numbers of robots that the team needs, each from a given time on. A team with too few robots gets the
    nearest ones that other teams can spare."""
