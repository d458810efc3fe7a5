"""What is worth saying of a mission before it is run, though nothing is wrong with it."""

from __future__ import annotations

import math

from escort_mj.behaviors import Surface
from escort_mj.scenario.checks.mission import behaviors_of
from escort_mj.scenario.checks.passage import narrowest_door
from escort_mj.scenario.mission import Mission, mission_of
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.sensing.lidar import widest_gap

LARGE_TRACE = 100e6  # bytes from which on its size is told beforehand


def notes(scenario: Scenario) -> list[str]:
    """Return all that there is to say."""
    mission = mission_of(scenario)
    found = trace_note(mission), passage_note(mission), lidar_note(mission), opponents_note(mission)
    return [note for note in found if note]


def trace_note(mission: Mission) -> str:
    """What to say of a large trace before it is written; empty of others."""
    size = mission.trace_size
    if size < LARGE_TRACE:
        return ""
    return f"the trace will take up to {size / 1e6:.0f} MB; a lower recording.rate makes it smaller"


def opponents_note(mission: Mission) -> str:
    """What to say of opponents that never set out; empty where all do."""
    duration = mission.scenario.duration
    for group in mission.scenario.opponents:
        last = group.start + (group.count - 1) * group.interval
        if last >= duration:
            return f"the last {group.name} sets out at {last:g} s; the run ends at {duration:g} s"
    return ""


def passage_note(mission: Mission) -> str:
    """What to say of a circle that is wider than a door; empty of others."""
    scenario = mission.scenario
    behaviors = [behavior for _, behavior in behaviors_of(scenario)]
    surface = next((each for each in behaviors if isinstance(each, Surface)), None)
    if surface is None or isinstance(surface.radius, str) or not scenario.walls:
        return ""
    margin = _margin(scenario)
    radius = surface.radius or scenario.mission.radius
    if surface.fit:
        radius = surface.least_radius(mission.setup)
    door = narrowest_door(mission, radius + margin)
    if door is None or door.width >= 2.0 * (radius + margin):
        return ""
    what = "the smallest circle" if surface.fit else "the circle"
    fits = 0.5 * door.width - margin
    if fits > 0.0:
        smaller = f"a radius of at most {fits:.3g} m fits"
        smaller += "" if surface.fit else "; surface with fit: true shrinks where necessary"
    else:
        smaller = f"no radius fits; centers of robots keep {margin:.3g} m from walls, and a radius fits "
        smaller += f"where they keep less than {0.5 * door.width:.3g} m"
    words = f"{what} of {radius:.3g} m needs {2.0 * (radius + margin):.3g} m with its safe distances, and "
    words += f"{door.between} leave {door.width:.3g} m at {door.time:.3g} s, so robots lose their places: "
    return words + smaller


def lidar_note(mission: Mission) -> str:
    """What to say of an obstacle that rays of a lidar can miss at the safe distance; empty of others."""
    scenario = mission.scenario
    lidar, axes = scenario.sensing.lidar, scenario.axes
    if lidar is None:
        return ""
    sine = math.sin(min(0.5 * widest_gap(lidar.count(axes), axes), 0.5 * math.pi))
    for body in mission.obstacles:
        low, high = body.corners(axes)
        width = float((high - low).max())
        if width < (gap := (2.0 * _margin(scenario) + width) * sine):
            return (
                f"{body.name} is {width:.3g} m wide, and rays of the lidar are {gap:.3g} m apart where it is "
                "at the safe distance: robots may not see it; more sensing.lidar.rays are nearer together"
            )
    return ""


def _margin(scenario: Scenario) -> float:
    """Return how far robots' centers keep from the surfaces of obstacles [m]."""
    radius = scenario.robots.largest_radius
    return max([radius, *(behavior.keeps_off(radius) for _, behavior in behaviors_of(scenario))])
