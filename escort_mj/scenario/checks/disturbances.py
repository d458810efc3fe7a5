"""Checks of what disturbs the robots."""

from __future__ import annotations

from collections.abc import Iterator

from escort_mj.disturbances import Disturbance
from escort_mj.scenario.checks.typed import check_function
from escort_mj.scenario.findings import Finding, Path
from escort_mj.scenario.mission import Mission


def check_disturbances(mission: Mission) -> Iterator[Finding]:
    """Forces have a function for each axis, defined through the whole run; equations fit so many axes."""
    scenario = mission.scenario
    for index, each in enumerate(scenario.uncertainty.disturbances):
        path: Path = ("uncertainty", "disturbances", index)
        place = (*path, *each.of_time_key)
        force = each.of_time
        if len(force) != scenario.axes and (force or type(each).force is Disturbance.force):
            yield Finding(place, f"found {len(force)} numbers; expected {scenario.axes}, as axes says")
        for axis, component in enumerate(() if each.of_time_key else force):  # keys say it themselves
            yield from check_function((*place, axis), component, scenario.duration)
