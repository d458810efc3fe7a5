"""Checks of `teams`: every robot is in one, their targets move, and nothing else needs one team only."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from escort_mj.laws import LAWS
from escort_mj.scenario.checks.mission import behaviors_of, laws_of
from escort_mj.scenario.checks.obstacles import check_drive
from escort_mj.scenario.findings import Finding, Path, did_you_mean, listed, shown
from escort_mj.scenario.geometry.teams import escort_of
from escort_mj.scenario.geometry.trajectory import trajectory
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.scenario.schema.teams import Circle, Demand, Escort, Team, TeamTarget

IN_SPACE = 3  # axes
MOMENTS = 201  # at which targets are looked at


def check_team_targets(mission: Mission) -> Iterator[Finding]:
    """Teams have names of their own, and their targets have paths that the mission's axes have."""
    scenario = mission.scenario
    names = [team.name for team in scenario.teams]
    for index, team in enumerate(scenario.teams):
        table: Path = ("teams", index)
        if scenario.axes > IN_SPACE:
            yield Finding(table, f"found in {scenario.axes} axes; teams have their targets in 2 or 3")
        if team.name in names[:index]:
            yield Finding((*table, "name"), f"found the name {team.name} twice; name the others")
        for place, target in enumerate(team.targets):
            path: Path = (*table, "targets", place)
            if target.position is not None and target.waypoints is not None:
                yield Finding(path, "found both position and waypoints; give one of them")
            yield from check_drive(scenario, target.body, (*path, "body"))
            yield from _check_times(scenario, (*path, "escorted_by"), target.escorted_by)
            for k, escort in enumerate(target.escorted_by):
                if escort.team is not None and escort.team not in names:
                    yield Finding((*path, "escorted_by", k, "team"), _unknown(escort.team, names))
        yield from _check_times(scenario, (*table, "demand"), team.demand)
        yield from _check_times(scenario, (*table, "radii"), team.radii)


def _check_times(
    scenario: Scenario, path: Path, entries: Sequence[Circle | Demand | Escort]
) -> Iterator[Finding]:
    """Entries are in order of time, and begin before the run ends."""
    for place, entry in enumerate(entries):
        where: Path = (*path, place, "after")
        if place and entry.after <= entries[place - 1].after:
            before = entries[place - 1].after
            yield Finding(
                where, f"found {entry.after:g} s after {before:g} s; expected entries in order of time"
            )
        if entry.after >= scenario.duration:
            words = f"found {entry.after:g} s; the run ends at {scenario.duration:g} s"
            yield Finding(where, words, late=f"it begins at {entry.after:g} s")


def check_escorts(mission: Mission) -> Iterator[Finding]:
    """Each team has a target at every time."""
    scenario = mission.scenario
    targets = [(team, target) for team in scenario.teams for target in team.targets]
    changes = {each.after for _, target in targets for each in target.escorted_by}
    for moment in sorted({0.0, *changes}):
        escorts = {escort_of(team, target, moment) for team, target in targets}
        if not escorts <= {None, *(team.name for team in scenario.teams)}:
            return  # see `check_team_targets`
        for index, team in enumerate(scenario.teams):
            if team.name not in escorts:
                words = f"found no target of team {team.name} from {moment:g} s on; expected one at least"
                yield Finding(("teams", index, "targets"), f"{words}, at every time")
                return


def check_members(mission: Mission) -> Iterator[Finding]:
    """Each robot is in one team at the start, and teams never need more robots than there are."""
    scenario = mission.scenario
    if not scenario.teams:
        return
    count, found = mission.count, dict[int, str]()
    for index, team in enumerate(scenario.teams):
        for place, robot in enumerate(team.robots):
            path: Path = ("teams", index, "robots", place)
            if robot > count:
                words = f"found robot {robot}; allowed are 1 to {count}"
                yield Finding(path, words, related=(("robots", "count"),))
            elif robot in found:
                yield Finding(path, f"found robot {robot} again; it is in team {found[robot]}")
            found.setdefault(robot, team.name)
    if missing := sorted({*range(1, count + 1)} - {*found}):
        others = f" and {len(missing) - 1} others" if len(missing) > 1 else ""
        words = f"found robot {missing[0]}{others} in no team; expected each robot from 1 to {count} in one"
        yield Finding(("teams",), words, related=(("robots", "count"),))
    begins = sorted({demand.after for team in scenario.teams for demand in team.demand})
    for moment in begins:
        needed = [_needed(team, moment) for team in scenario.teams]
        if sum(needed) > count:
            words = (
                f"found demands of {sum(needed)} robots at {moment:g} s; expected at most {count}, all robots"
            )
            yield Finding(("teams",), words, related=(("robots", "count"),))
            return


def _needed(team: Team, moment: float) -> int:
    """Return how many robots a team has at least at a time: one, where it demands no more."""
    return max([1, *[demand.robots for demand in team.demand if demand.after <= moment][-1:]])


def check_laws(mission: Mission) -> Iterator[Finding]:
    """Laws that differ between robots are among those that ship."""
    if len(mission.scenario.laws) == 1:
        return
    for path, law in laws_of(mission.scenario):
        if type(law) not in LAWS:
            words = f"found {law.law}, the law of a plugin; other robots have other laws"
            yield Finding(path, f"{words}: expected one law for all")


def check_one_team(mission: Mission) -> Iterator[Finding]:
    """Nothing of the mission needs all robots to be one team, with one target."""
    scenario = mission.scenario
    if not scenario.teams:
        return
    teams: tuple[Path, ...] = (("teams",),)
    if scenario.target is not None:
        words = "found a target beside teams, each of which has its own; expected target: null"
        yield Finding(("target",), words, related=teams)
    if scenario.clutter:
        yield Finding(("clutter",), "found clutter with teams; expected one or the other", related=teams)
    for name in ("target_position", "target_velocity"):
        if getattr(scenario.sensing, name) != type(scenario.sensing)().target_position:
            words = "found errors; expected none with teams; knowledge.target has errors of its own"
            yield Finding(("sensing", name), words, related=teams)
    for index, phase in enumerate(scenario.mission.supervisor):
        if phase.when is not None and {"target", "obstacles"}.issubset(phase.when.looks_at):
            words = f"found {phase.when.quantity}; targets of teams are obstacles themselves"
            yield Finding(("mission", "supervisor", index, "when", "quantity"), words, related=teams)


def check_circles(mission: Mission) -> Iterator[Finding]:
    """The circle of each team has its targets inside, as far as avoidance wants robots to stay off them.

    Of targets with a policy, the ways are not known before: those of their team are looked at at the start.
    """
    scenario = mission.scenario
    targets = [(team, target) for team in scenario.teams for target in team.targets]
    changes = {each.after for _, target in targets for each in target.escorted_by}
    changes |= {each.after for team in scenario.teams for each in team.radii}
    moments = sorted({*np.linspace(0.0, scenario.duration, MOMENTS).tolist(), *changes})
    for index, team in enumerate(scenario.teams):
        its = [
            (owner, target)
            for owner, target in targets
            if team.name in (owner.name, *(each.team for each in target.escorted_by))
        ]
        times = np.array(moments if all(target.policy is None for _, target in its) else [0.0])
        here = np.array([[escort_of(*each, time) == team.name for time in times] for each in its])
        ways = np.array([trajectory(target, scenario.axes).position(times) for _, target in its])
        center = (ways * here[:, :, None]).sum(axis=0) / here.sum(axis=0)[:, None]
        apart, off = np.linalg.norm(ways - center, axis=2), _kept_off(scenario, [target for _, target in its])
        radii = [team.radius or scenario.mission.radius, *(each.radius for each in team.radii)]
        entry = np.array([sum(each.after <= time for each in team.radii) for time in times])
        needed = np.where(here, apart + off[:, None], 0.0)
        lack = needed - np.array(radii)[entry]
        which, when = np.unravel_index(int(lack.argmax()), lack.shape)
        if lack[which, when] > 0.0:
            path: Path = ("radii", int(entry[when]) - 1, "radius") if entry[when] else ("radius",)
            yield Finding(
                ("teams", index, *path),
                f"found {radii[entry[when]]:g} m; expected at least {needed[which, when]:.4g} m: "
                f"{its[which][1].name} is {apart[which, when]:.3g} m from the middle at {times[when]:.3g} s, "
                f"and robots stay {off[which]:.4g} m off its center",
                related=(("teams", index), ("mission", "radius")),
            )


def _kept_off(scenario: Scenario, targets: Sequence[TeamTarget]) -> NDArray[np.float64]:
    """Return how far the centers of robots stay off those of targets, shape (targets,) [m]."""
    behaviors = [each for _, each in behaviors_of(scenario)]
    bodies = [target.radius + scenario.robots.largest_radius for target in targets]
    return np.array([max([body, *(each.keeps_off(body) for each in behaviors)]) for body in bodies])


def check_of_team(mission: Mission) -> Iterator[Finding]:
    """Phases and expectations name teams that exist, and what is of one team only names its team."""
    scenario = mission.scenario
    names = [team.name for team in scenario.teams]
    for index, phase in enumerate(scenario.mission.supervisor):
        if phase.team is not None and phase.team not in names:
            yield Finding(("mission", "supervisor", index, "team"), _unknown(phase.team, names))
    for index, expectation in enumerate(scenario.expect):
        path: Path = ("expect", index)
        team = getattr(expectation, "team", None)
        if team is not None and team not in names:
            yield Finding((*path, "team"), _unknown(team, names))
        elif team is not None and not expectation.of_one_team:
            words = f"found the team {team}; {expectation.subject} is of all robots: expected no team"
            yield Finding((*path, "team"), words)
        elif names and team is None and expectation.of_one_team:
            words = f"found {expectation.subject} without a team; give team: {listed(names)}"
            yield Finding(path, words, related=(("teams",),))


def _unknown(team: str, names: list[str]) -> str:
    """Say that there is no team of a name."""
    allowed = f"allowed are {listed(names)}" if names else "this scenario has no teams"
    return f"found {shown(team)}; {allowed}{did_you_mean(team, names)}"
