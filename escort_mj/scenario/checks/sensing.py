"""Checks of the table `sensing`: delays in whole steps, biases of as many axes, sight as far as safety."""

from __future__ import annotations

from collections.abc import Iterator

from escort_mj.scenario.checks.knowledge import HEADLESS, whole_steps, whole_time
from escort_mj.scenario.checks.mission import behaviors_of
from escort_mj.scenario.findings import Finding, Path, key_path
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.sensing import NAMES
from escort_mj.sensors import Plain
from escort_mj.sensors.lidar import RAYS

MAX_PAST = 64 * 2**20  # bytes that delays may keep


def check_delays(mission: Mission) -> Iterator[Finding]:
    """A whole number of steps, less than the run, and no more than memory holds."""
    scenario = mission.scenario
    timestep, count = scenario.physics.timestep, mission.count
    for number, (name, sensor) in enumerate(zip(NAMES, scenario.sensing.channels, strict=True)):
        if not isinstance(sensor, Plain):
            continue
        path: Path = ("sensing", name, "delay")
        steps = sensor.delay / timestep
        size = 8.0 * steps * scenario.axes * (count if number < 2 else 1)
        if sensor.delay >= scenario.duration:
            yield Finding(
                path,
                f"found {sensor.delay:g} s; the run ends at {scenario.duration:g} s: it would see the start",
            )
        elif size > MAX_PAST:
            most = MAX_PAST / size * sensor.delay
            yield Finding(
                path,
                f"found {steps:.4g} steps to remember, {size / 2**20:.3g} MiB; expected at most {most:.3g} s",
            )
        else:
            yield from whole_time(scenario, path, sensor.delay)


def check_headings(mission: Mission) -> Iterator[Finding]:
    """Robots that measure their headings have one."""
    heading = mission.scenario.sensing.heading
    if heading is None:
        return
    for robot, kind in enumerate(mission.kinds, 1):
        if not kind.has_heading:
            words = f"found {heading.sensor}; robot {robot} is a {kind.kind}, {HEADLESS}"
            yield Finding(("sensing", "heading"), words, related=(("robots",),))
            return


def check_lidar(mission: Mission) -> Iterator[Finding]:
    """Rays have axes, scans are whole steps apart, and behaviors need no more than returns."""
    scenario = mission.scenario
    lidar = scenario.sensing.lidar
    if lidar is None:
        return
    path: Path = ("sensing", "lidar")
    if scenario.axes not in RAYS:
        yield Finding(path, f"found a lidar in {scenario.axes} axes; expected null, or axes 2 or 3")
    yield from whole_steps(scenario, (*path, "rate"), lidar.rate)
    for place, behavior in behaviors_of(scenario):
        if lidar.range < (least := behavior.keeps_off(scenario.robots.largest_radius)):
            yield Finding(
                (*path, "range"),
                f"found {lidar.range:g} m from the robot's center, less than the safe distance of "
                f"{key_path(place)}; expected at least {least:g} m",
                related=(place,),
            )
