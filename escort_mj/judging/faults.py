"""What is wrong with a log as a whole: time that it does not cover, units that are not SI."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from escort_mj.judging.log import POSITION, Log
from escort_mj.judging.resampling import at
from escort_mj.metrics.measure import in_words
from escort_mj.numerics.steps import SLACK, last_step
from escort_mj.scenario import Scenario

FAR_OFF = 30.0  # times what a quantity should be: its unit is wrong
MOMENTS = 100  # at which the size of the team is looked at


def faults_of(log: Log, scenario: Scenario, start: float | None) -> Iterator[str]:
    """What keeps a log from being judged against a scenario.

    Args:
        log: As it was read.
        scenario: The mission.
        start: Time stamp of the mission's start [s]; None for the first at which all bodies are logged.
    """
    yield from log.faults
    yield from _track_faults(log)
    if all(track.ascends for track in log.tracks.values()):
        yield from _time_faults(log, scenario, start)
        yield from _scale_faults(log, scenario, start)


def span_of(log: Log, scenario: Scenario, start: float | None) -> tuple[float, float]:
    """Time stamp of the start, and how long all bodies are logged from there on, at most to the end [s]."""
    times = [track.time for track in log.tracks.values() if len(track.time)]
    if not times:
        return 0.0, 0.0
    begun = max(float(time[0]) for time in times) if start is None else start
    end = min(float(time[-1]) for time in times)
    for gap in log.gaps:
        if gap.start < begun < gap.end and start is None:
            begun = gap.end
        if gap.start < end < gap.end:
            end = gap.start
    timestep = scenario.physics.timestep
    whole = last_step(end - begun, timestep) * timestep if end > begun else 0.0
    return begun, min(scenario.duration, whole)


def is_short(log: Log, scenario: Scenario, length: float) -> bool:
    """Whether a log ends more than a usual step between two stamps before the scenario does."""
    usual = max(float(np.median(np.diff(track.time))) for track in log.tracks.values())
    return length < scenario.duration - usual - SLACK * scenario.physics.timestep


def _track_faults(log: Log) -> Iterator[str]:
    """What is wrong with single bodies; where all share the same time stamps, that of these once."""
    told = set()
    for track in log.tracks.values():
        for fault in track.faults():
            words = fault.partition(": ")[2]
            if not words.startswith("time") or words not in told:
                yield fault
            told.add(words)


def _time_faults(log: Log, scenario: Scenario, start: float | None) -> Iterator[str]:
    """Logs that do not cover what is to be judged."""
    tracks = [track for track in log.tracks.values() if len(track.time)]
    if not tracks:
        return
    begun, length = span_of(log, scenario, start)
    first = max(tracks, key=lambda track: float(track.time[0]))
    last = min(tracks, key=lambda track: float(track.time[-1]))
    span = float(last.time[-1] - first.time[0])
    if span > FAR_OFF * scenario.duration:
        words = f"time goes from {first.time[0]:.16g} to {last.time[-1]:.16g}, the mission lasts"
        yield f"{words} {scenario.duration:g} s: time must be in seconds"
        return
    if begun < float(first.time[0]) - SLACK * scenario.physics.timestep:
        yield f"--start {begun:.16g}: {first.name} is logged from {first.time[0]:.16g} s on"
    for gap in log.gaps:
        if gap.start < begun < gap.end:
            words = f"{in_words(gap.bodies)} from {gap.start:.16g} to {gap.end:.16g} s"
            yield f"--start {begun:.16g}: the log has no position of {words}"
    if start is not None and begun > float(last.time[-1]):
        yield f"--start {begun:.16g}: {last.name} is logged up to {last.time[-1]:.16g} s"
    elif length < scenario.physics.timestep:
        words = (
            f"{first.name} is logged from {first.time[0]:.16g} s on, {last.name} up to {last.time[-1]:.16g} s"
        )
        yield f"no time at which all bodies are logged: {words}"
        return


def _scale_faults(log: Log, scenario: Scenario, start: float | None) -> Iterator[str]:
    """Positions of another unit than meters: the team is far larger or smaller than its formation."""
    begun, length = span_of(log, scenario, start)
    tracks = [track for track in log.tracks.values() if len(track.time) > 1]
    if len(tracks) < 2 or length <= 0.0 or not all(one.sound for one in tracks):
        return
    times = np.linspace(begun, begun + length, MOMENTS)
    team = np.stack([at(times, track.time, track.values[POSITION]) for track in tracks])
    away = np.linalg.norm(team - team.mean(axis=0), axis=2)
    size, radius = float(np.median(away)), scenario.mission.radius
    if not radius / FAR_OFF < size < radius * FAR_OFF:
        words = (
            f"its bodies are a median of {size:.3g} from their center, the mission's radius is {radius:g} m"
        )
        yield f"{words}: positions must be in meters"
