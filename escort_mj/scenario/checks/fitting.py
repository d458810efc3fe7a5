"""What components say themselves of the mission that they are to take part in."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

from escort_mj.components.equations import Equations
from escort_mj.components.facts import Facts
from escort_mj.scenario.checks.mission import neighbor_spacing
from escort_mj.scenario.findings import Finding
from escort_mj.scenario.mission import Mission


def check_fits(mission: Mission) -> Iterator[Finding]:
    """Each component fits the mission, wherever it stands."""
    facts = facts_of(mission)
    components = (part for part in mission.parts if isinstance(part[1], Equations))
    for path, component in components:
        for words, key, because in chain(component.misfits_of_kind(facts), component.misfits(facts)):
            where = (key,) if isinstance(key, str) else key
            yield Finding((*path, *(part for part in where if part != "")), words, related=because)


def facts_of(mission: Mission) -> Facts:
    """Return what components may be made for."""
    scenario, robots = mission.scenario, mission.scenario.robots
    limits = dict.fromkeys(range(1, mission.count + 1), robots.force_limit)
    limits |= {each.robot: each.force_limit for each in robots.overrides if each.force_limit is not None}
    tables = (name for name in ("knowledge", "communication") if getattr(scenario, name) is not None)
    radio, sight = scenario.communication, scenario.sensing.radius
    reach = None
    if radio is not None and radio.range is not None:
        reach = radio.range + 2.0 * robots.largest_radius * (radio.measure == "surface")
    return Facts(
        axes=scenario.axes,
        robots=mission.count,
        robot_radius=robots.largest_radius,
        target_radius=0.0 if scenario.target is None else scenario.target.radius,
        radius=scenario.mission.radius,
        spacing=neighbor_spacing(scenario),
        target=scenario.target is not None,
        teams=bool(scenario.teams),
        known_by=next(tables, ""),
        heard=radio is not None,
        heard_within=reach,
        seen_within=(sight.robots, sight.obstacles),
        failures=bool(robots.failures),
        opponents=bool(scenario.opponents),
        lidar=scenario.sensing.lidar is not None,
        max_speed=scenario.mission.max_speed,
        force_limits=tuple(limits.values()),
        timestep=scenario.physics.timestep,
    )
