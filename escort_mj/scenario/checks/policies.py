"""Checks of what targets and opponents want."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from escort_mj.behaviors import Behavior
from escort_mj.numerics.program import Op
from escort_mj.scenario.checks.obstacles import check_drive
from escort_mj.scenario.findings import Finding, Path, did_you_mean, shown
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.expressions import Expression
from escort_mj.scenario.schema.scenario import Target
from escort_mj.scenario.schema.teams import TeamTarget

IN_SPACE = 3  # axes


def check_policy(mission: Mission) -> Iterator[Finding]:
    """A target with a policy begins at one place, and wants something else than to reach the target."""
    scenario = mission.scenario
    targets: list[tuple[Path, Target | TeamTarget]] = [
        (("teams", index, "targets", place), target)
        for index, team in enumerate(scenario.teams)
        for place, target in enumerate(team.targets)
    ]
    if scenario.target is not None:
        targets.append((("target",), scenario.target))
    for path, target in targets:
        if target.policy is None:
            continue
        found = target.policy.policy
        if target.policy.seeks:
            words = f"found {found}: an opponent's policy, which wants to reach the target"
            yield Finding((*path, "policy"), words)
        if path != ("target",) and not target.policy.of_teams:
            yield Finding((*path, "policy"), f"found {found}; it is for target and opponents")
        if target.waypoints is not None:
            words = f"found waypoints beside the policy {found}; expected position, its start"
            yield Finding((*path, "waypoints"), words)
        for axis in _moving(target):
            words = f"found an expression in t beside the policy {found}; expected a number"
            yield Finding((*path, "position", axis), words)


def check_leaders(mission: Mission) -> Iterator[Finding]:
    """Bodies follow others, at a distance that leaves room for both."""
    obstacles = mission.obstacles
    radii = {f"robot_{i}": mission.scenario.robots.largest_radius for i in range(1, mission.count + 1)}
    target = mission.scenario.target
    followers = [(body.name, body.path, body.bounding_radius, body.policy) for body in obstacles]
    if target is not None:
        radii["target"] = target.radius
        followers.append(("target", ("target",), target.radius, target.policy))
    radii |= {body.name: body.bounding_radius for body in obstacles}
    seen: set[Path] = set()
    for _, path, radius, policy in followers:
        if policy is None or policy.follows is None or path in seen:
            continue
        seen.add(path)
        own, (leader, distance) = [each for each, at, *_ in followers if at == path], policy.follows
        where: Path = (*path, "policy", "leader")
        if leader in own:
            yield Finding(where, f"found {leader}, the body itself; expected another one")
        elif leader not in radii:
            words = f"found {shown(leader)}; expected a robot, a target, an obstacle or an opponent"
            yield Finding(where, words + did_you_mean(leader, radii))
        elif distance <= (least := radius + radii[leader]):
            words = f"found {distance:g} m between centers; expected more than {least:.4g} m, both radii"
            yield Finding((*path, "policy", "distance"), words)


def _moving(target: Target | TeamTarget) -> list[int]:
    """Return the axes on which a target's position depends on time."""
    return [
        axis
        for axis, component in enumerate(target.position or ())
        if any(op == Op.AFFINE and rate for op, _, rate in Expression(component).instructions())
    ]


def check_opponents(mission: Mission) -> Iterator[Finding]:
    """Opponents have a target, a name of their own, and one start each if any."""
    scenario = mission.scenario
    names = [group.name for group in scenario.opponents]
    for index, group in enumerate(scenario.opponents):
        path: Path = ("opponents", index)
        if scenario.target is None and not scenario.teams:
            yield Finding(path, "found opponents without a target that they want to reach")
        if scenario.axes > IN_SPACE:
            yield Finding(path, f"found in {scenario.axes} axes; opponents move in 2 or 3")
        if group.name in names[:index]:
            yield Finding((*path, "name"), f"found the name {group.name} twice; name the others")
        if group.positions is not None and len(group.positions) != group.count:
            yield Finding(
                (*path, "positions"),
                f"found {len(group.positions)} positions; expected {group.count}, as count says",
            )
        yield from check_drive(scenario, group.body, (*path, "body"))


def check_guards(mission: Mission) -> Iterator[Finding]:
    """Behaviors against opponents have some, and robots that all know where these are."""
    scenario = mission.scenario
    behaviors = scenario.mission.behaviors
    stacks: list[tuple[Path, Sequence[Behavior]]] = [(("mission", "behaviors"), behaviors)]
    for number, phase in enumerate(scenario.mission.supervisor):
        stacks.append((("mission", "supervisor", number, "behaviors"), phase.behaviors))
    for path, stack in stacks:
        for place, behavior in enumerate(stack):
            found = f"found {behavior.behavior} against opponents"
            if behavior.guards and not scenario.opponents:
                yield Finding((*path, place), f"{found}, and no opponents")
            if behavior.guards and (scenario.knowledge or scenario.communication):
                yield Finding(
                    (*path, place),
                    f"{found} with knowledge or communication: the team agrees at once on who guards against "
                    "which opponent",
                )
